/*
 * The parts of the board that QEMU calls virt (riscv32), from reset on. It has no LED: the interlock is a word of memory.
 */
#include "../board.h"

#define UART 0x10000000U
#define UART_STATE (UART + 5U)
#define UART_SEND_EMPTY 0x20U
#define TEST_DEVICE 0x00100000U
#define PASS 0x5555U
#define FAIL 0x13333U

extern uint32_t data_load[];
extern uint32_t data_start[];
extern uint32_t data_end[];
extern uint32_t bss_start[];
extern uint32_t bss_end[];

int main(void);
void start(void);

static volatile bool led;

/* The stack, and the address that a trap jumps to. */
__asm__(".section .vectors, \"ax\"\n"
        ".global reset\n"
        "reset:\n"
        "  la sp, stack_top\n"
        "  la t0, on_fault\n"
        ".option push\n"
        ".option arch, +zicsr\n"
        "  csrw mtvec, t0\n"
        ".option pop\n"
        "  j start\n"
        ".text\n");

__attribute__((used)) void start(void)
{
    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; to++) {
        *to = *from;
        from++;
    }
    for (uint32_t *to = bss_start; to < bss_end; to++) {
        *to = 0U;
    }
    (void)main();
    on_fault();
    for (;;) {
    }
}

void led_drive(bool high)
{
    led = high;
}

bool led_is_high(void)
{
    return led;
}

void print(const char *text)
{
    while (*text != '\0') {
        while ((*(volatile uint8_t *)(uintptr_t)UART_STATE & UART_SEND_EMPTY) == 0U) {
        }
        *(volatile uint8_t *)(uintptr_t)UART = (uint8_t)*text;
        text++;
    }
}

void stop(bool good)
{
    for (;;) {
        *(volatile uint32_t *)(uintptr_t)TEST_DEVICE = good ? PASS : FAIL;
    }
}
