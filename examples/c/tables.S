/* Unchanged tables of `posegate table build`, each in its own section, so that only tables which a program names
 * are linked. (`posegate table export --format c` writes a table as a C header instead.) */
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
