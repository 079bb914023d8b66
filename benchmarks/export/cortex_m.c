/* SPDX-License-Identifier: MIT */
/* Start of a bare Cortex-M4F: vectors, floating point unit, C library for output by semihosting. */

#include <stdint.h>
#include <stdlib.h>

extern uint32_t stack_top;
extern void initialise_monitor_handles(void);
extern int main(void);

/* What start files of the C library would bring. */
void _init(void) {}
void _fini(void) {}

static void reset(void) {
    volatile uint32_t *const coprocessors = (volatile uint32_t *)0xE000ED88;
    *coprocessors |= 0xFu << 20;
    __asm volatile("dsb\n isb");
    initialise_monitor_handles();
    exit(main());
}

__attribute__((section(".vectors"), used)) static void *const vectors[] = {&stack_top,
                                                                          (void *)reset};
