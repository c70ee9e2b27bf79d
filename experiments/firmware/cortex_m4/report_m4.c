/* Start of a Cortex-M4 without a C library, and semihosting: what QEMU and debuggers show. */
#include "report.h"

int main(void);
extern uint32_t stack_top;
extern uint32_t data_from;
extern uint32_t data_begin;
extern uint32_t data_end;
extern uint32_t bss_begin;
extern uint32_t bss_end;

static uint32_t semihosting(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void report(const char *what, uint32_t number)
{
    char digits[12];
    int place = 11;
    digits[place] = '\0';
    digits[--place] = '\n';
    do {
        digits[--place] = (char)('0' + number % 10U);
        number /= 10U;
    } while (number > 0U);
    (void)semihosting(0x04U, what); /* SYS_WRITE0 */
    (void)semihosting(0x04U, " ");
    (void)semihosting(0x04U, &digits[place]);
}

static void reset(void)
{
    uint32_t *to;
    const uint32_t *from = &data_from;
    volatile uint32_t *coprocessors = (volatile uint32_t *)0xE000ED88U;
    *coprocessors |= 0xFU << 20; /* the floating-point unit */
    __asm__ volatile("dsb\n isb");
    for (to = &data_begin; to < &data_end; to++, from++) {
        *to = *from;
    }
    for (to = &bss_begin; to < &bss_end; to++) {
        *to = 0U;
    }
    {
        /* SYS_EXIT_EXTENDED: an ordinary end, with main's status. */
        const uint32_t ended[2] = {0x20026U, (uint32_t)main()};
        (void)semihosting(0x20U, ended);
    }
    for (;;) {
    }
}

static void fault(void)
{
    report("fault", 0U);
    {
        const uint32_t ended[2] = {0x20026U, 3U};
        (void)semihosting(0x20U, ended);
    }
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const void *const VECTORS[16] = {
    &stack_top, (const void *)reset, (const void *)fault, (const void *)fault,
    (const void *)fault, (const void *)fault, (const void *)fault,
};
