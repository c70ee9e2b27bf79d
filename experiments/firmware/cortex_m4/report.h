/* A line with a number: through the C library, or of a Cortex-M4 through the debugger. */
#ifndef REPORT_H
#define REPORT_H
#include <stdint.h>
void report(const char *what, uint32_t number);
#endif
