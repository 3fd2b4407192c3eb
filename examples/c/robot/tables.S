/* The tables of the three tasks, each in its own section. */
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

    flash table_dock, "examples/c/robot/dock.posegate"
    flash table_see_t7, "examples/c/robot/see-t7.posegate"
    flash table_wait, "examples/c/robot/wait.posegate"
