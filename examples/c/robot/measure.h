/* Measures a program under QEMU: with `-icount shift=6` on Arm, where an instruction takes 64 ns of the system timer, and with
 * `-icount shift=0` on RISC-V, which counts instructions. */
#ifndef MEASURE_H
#define MEASURE_H

#include <stdint.h>

void counter_init(void);
void counter_start(void);
/* Returns the instructions since the start, without the counter's own; at most 10.4 million. */
uint32_t counter_instructions(void);

/* Paints the stack below the caller, and returns how many bytes of it were written since then. */
void stack_paint(void);
uint32_t stack_used(void);

#endif
