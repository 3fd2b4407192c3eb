/* Unchanged tables of `posegate table build`. (`posegate table export --format c` writes a table as a C header instead.) */
    .include "examples/c/in_flash.inc"

    flash table_dock, "examples/tables/dock.posegate"
    flash table_see_t7, "examples/tables/see-t7.posegate"
