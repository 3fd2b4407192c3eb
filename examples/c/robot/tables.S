/* The tables of the three tasks. */
    .include "examples/c/in_flash.inc"

    flash table_dock, "examples/c/robot/dock.posegate"
    flash table_see_t7, "examples/c/robot/see-t7.posegate"
    flash table_wait, "examples/c/robot/wait.posegate"
