#include "measure.h"
#include "../board.h"

#define PAINT 0xa5a5a5a5U
#define PAINTED_BYTES 16384U

static uint32_t *painted_to;
static uint32_t started;
static uint32_t own;

#if defined(__riscv)
static uint32_t current(void)
{
    uint32_t count;
    __asm__ volatile(".option push\n.option arch, +zicsr\ncsrr %0, minstret\n.option pop" : "=r"(count) : : "memory");
    return count;
}

void counter_start(void)
{
    started = current();
}

static uint32_t passed(void)
{
    return current() - started;
}
#else
#define TIMER_CURRENT 0xe000e018U
#define LONGEST 0xffffffU
/* A tick of the timer takes 40 ns, an instruction 64 ns. */
#define TICK_NS 40U
#define INSTRUCTION_NS 64U

static uint32_t current(void)
{
    return *(volatile uint32_t *)(uintptr_t)TIMER_CURRENT;
}

void counter_start(void)
{
    timer_restart();
    started = current();
}

static uint32_t passed(void)
{
    uint32_t ticks = started - current();
    return (uint32_t)(((uint64_t)ticks * TICK_NS + INSTRUCTION_NS / 2U) / INSTRUCTION_NS);
}
#endif

void counter_init(void)
{
#if !defined(__riscv)
    timer_init(LONGEST);
#endif
    counter_start();
    own = passed();
}

uint32_t counter_instructions(void)
{
    uint32_t instructions = passed();
    return instructions > own ? instructions - own : 0U;
}

__attribute__((noinline)) void stack_paint(void)
{
    volatile uint32_t *here = (volatile uint32_t *)__builtin_frame_address(0);
    painted_to = (uint32_t *)(uintptr_t)here;
    for (uint32_t word = 16U; word < PAINTED_BYTES / 4U; word++) {
        here[-(int32_t)word] = PAINT;
    }
}

__attribute__((noinline)) uint32_t stack_used(void)
{
    const volatile uint32_t *lowest = painted_to - PAINTED_BYTES / 4U + 1;
    while (lowest < painted_to && *lowest == PAINT) {
        lowest++;
    }
    return (uint32_t)((uintptr_t)painted_to - (uintptr_t)lowest);
}
