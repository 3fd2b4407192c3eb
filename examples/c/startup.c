/* From reset to main: the vector table, the initialisation of C memory, the floating-point unit. */
#include "board.h"

#define CPACR 0xe000ed88U

extern uint32_t stack_top[];
extern uint32_t data_load[];
extern uint32_t data_start[];
extern uint32_t data_end[];
extern uint32_t bss_start[];
extern uint32_t bss_end[];

int main(void);
void reset(void);

struct vectors {
    uint32_t *stack;
    void (*handlers[15])(void);
};

void reset(void)
{
    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; to++) {
        *to = *from;
        from++;
    }
    for (uint32_t *to = bss_start; to < bss_end; to++) {
        *to = 0U;
    }
#if defined(__ARM_FP)
    *(volatile uint32_t *)(uintptr_t)CPACR |= 0xfUL << 20;
    __asm__ volatile("dsb\n\tisb" : : : "memory");
#endif
    (void)main();
    on_fault();
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const struct vectors VECTORS = {
    stack_top,
    {
        reset,
        on_fault, on_fault, on_fault, on_fault, on_fault,
        NULL, NULL, NULL, NULL,
        on_fault, on_fault,
        NULL,
        on_fault, on_fault,
    },
};
