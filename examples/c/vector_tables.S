/* The additional data of vectors.c. */
    .include "examples/c/in_flash.inc"

    flash table_see_t7_grid, "examples/tables/see-t7-grid.posegate"
    flash table_whole_circle, "tests/data/whole-circle.posegate"
    flash table_turning, "tests/data/turning.posegate"
    flash table_over_180, "tests/data/over-180.posegate"
    flash table_over_180_grid, "tests/data/over-180-grid.posegate"
    flash table_corner, "tests/data/corner.posegate"
    flash vector_file, "tests/data/vectors.bin"
