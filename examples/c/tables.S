/* Tables of `posegate table build` as they are, each in a section of its own: what a program does not name
 * is not linked. (`posegate table export --format c` writes a table as a C header instead.) */
    .macro flash name, file
    .section .rodata.\name, "a"
    .global \name
    .global \name\()_length
    .balign 4
\name\()_length:
    .word 0f - \name
\name:
    .incbin "\file"
0:
    .endm

    flash table_dock, "examples/tables/dock.posegate"
    flash table_see_t7, "examples/tables/see-t7.posegate"
