/*
 * The parts of the boards that QEMU calls mps2-an385, mps2-an386 and mps2-an505 (Arm MPS2+ with a Cortex-M3, a
 * Cortex-M4F, a Cortex-M33) used by the examples: one LED, the serial line, the system timer, and semihosting. A product
 * uses its HAL instead.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Ticks of the system timer per second. */
#define TICKS_PER_SECOND 25000000U

/* User LED 0 represents the interlock. */
void led_drive(bool high);
bool led_is_high(void);

void uart_init(void);
/* Returns the byte that has arrived, or -1. */
int32_t uart_receive(void);
void uart_send(const uint8_t *bytes, size_t length);

/* A timer that counts down once; at most 2^24 - 1 ticks. */
void timer_init(uint32_t ticks);
void timer_restart(void);
/* Call it once per interval, because reading clears the flag. */
bool timer_has_run_out(void);

/* Returns the core, from its CPUID register. */
const char *core_name(void);

/* Print text and numbers on the console of the emulator. */
void print(const char *text);

static inline void print_number(uint32_t number)
{
    char digits[11];
    size_t at = sizeof digits - 1U;
    digits[at] = '\0';
    do {
        at--;
        digits[at] = (char)('0' + (char)(number % 10U));
        number /= 10U;
    } while (number != 0U);
    print(&digits[at]);
}

/* Ends the emulation. */
void stop(bool good);

/* Defined by each example: handles a processor fault. Does not return. */
void on_fault(void);

#endif
