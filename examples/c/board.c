#include "board.h"

#if defined(__ARM_ARCH_8M_MAIN__)
/* mps2-an505, in secure state. */
#define UART 0x50200000U
#define LEDS 0x50302000U
#else
#define UART 0x40004000U
#define LEDS 0x40028000U
#endif
#define UART_DATA UART
#define UART_STATE (UART + 4U)
#define UART_CONTROL (UART + 8U)
#define UART_DIVIDER (UART + 16U)
#define UART_SEND_FULL 1U
#define UART_RECEIVE_FULL 2U
#define LED_0 1U
#define TIMER_CONTROL 0xe000e010U
#define TIMER_RELOAD 0xe000e014U
#define TIMER_CURRENT 0xe000e018U
#define TIMER_ENABLE_ON_CORE_CLOCK 5U
#define TIMER_HAS_REACHED_ZERO (1UL << 16)
#define CPUID 0xe000ed00U

/* Semihosting calls. */
#define OPEN 0x01U
#define OPEN_TO_WRITE 4U
#define WRITE 0x05U
#define EXIT 0x18U
#define EXIT_GOOD 0x20026U
#define EXIT_BAD 0x20023U

static uint32_t get(uint32_t address)
{
    return *(volatile uint32_t *)(uintptr_t)address;
}

static void set(uint32_t address, uint32_t value)
{
    *(volatile uint32_t *)(uintptr_t)address = value;
}

void led_drive(bool high)
{
    uint32_t rest = get(LEDS) & ~LED_0;
    set(LEDS, high ? (rest | LED_0) : rest);
}

bool led_is_high(void)
{
    return (get(LEDS) & LED_0) != 0U;
}

/* 25 MHz / 217 = 115,207 bits a second. */
void uart_init(void)
{
    set(UART_DIVIDER, 217U);
    set(UART_CONTROL, 3U);
}

int32_t uart_receive(void)
{
    if ((get(UART_STATE) & UART_RECEIVE_FULL) == 0U) {
        return -1;
    }
    return (int32_t)(get(UART_DATA) & 0xffU);
}

void uart_send(const uint8_t *bytes, size_t length)
{
    for (size_t i = 0; i < length; i++) {
        while ((get(UART_STATE) & UART_SEND_FULL) != 0U) {
        }
        set(UART_DATA, bytes[i]);
    }
}

void timer_init(uint32_t ticks)
{
    set(TIMER_RELOAD, ticks);
    set(TIMER_CONTROL, TIMER_ENABLE_ON_CORE_CLOCK);
    timer_restart();
}

/* Writing any value clears the counter and the flag; the next tick loads the counter. */
void timer_restart(void)
{
    set(TIMER_CURRENT, 0U);
    while (get(TIMER_CURRENT) == 0U) {
    }
}

bool timer_has_run_out(void)
{
    return (get(TIMER_CONTROL) & TIMER_HAS_REACHED_ZERO) != 0U;
}

/*
 * QEMU has no ARMv6-M board that is large enough, so its code runs on a Cortex-M3, which executes
 * all of it.
 */
const char *core_name(void)
{
    switch ((get(CPUID) >> 4) & 0xfffU) {
    case 0xc23U:
#if defined(__ARM_ARCH_6M__)
        return "ARMv6-M on Cortex-M3";
#else
        return "Cortex-M3";
#endif
    case 0xc24U:
        return "Cortex-M4";
    case 0xd21U:
        return "Cortex-M33";
    default:
        return "unknown core";
    }
}

static uint32_t semihosting(uint32_t call, uint32_t argument)
{
    register uint32_t r0 __asm__("r0") = call;
    register uint32_t r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static uint32_t address(const void *pointer)
{
    return (uint32_t)(uintptr_t)pointer;
}

/* To the emulator's own output, whose name is ":tt". */
void print(const char *text)
{
    static uint32_t console;
    uint32_t block[3];
    uint32_t length = 0U;
    if (console == 0U) {
        block[0] = address(":tt");
        block[1] = OPEN_TO_WRITE;
        block[2] = 3U;
        console = semihosting(OPEN, address(block));
    }
    while (text[length] != '\0') {
        length++;
    }
    block[0] = console;
    block[1] = address(text);
    block[2] = length;
    (void)semihosting(WRITE, address(block));
}

void stop(bool good)
{
    for (;;) {
        (void)semihosting(EXIT, good ? EXIT_GOOD : EXIT_BAD);
    }
}
