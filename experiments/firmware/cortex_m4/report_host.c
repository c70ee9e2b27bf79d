#include "report.h"
#include <stdio.h>

void report(const char *what, uint32_t number)
{
    (void)printf("%s %lu\n", what, (unsigned long)number);
}
