#include "processor.h"

#if defined(__GNUC__) && defined(__x86_64__)

#include <cpuid.h>

bool er_has_avx2(void)
{
    const unsigned fma = 1u << 12, osxsave = 1u << 27, avx2 = 1u << 5, saved_registers = 6u;
    unsigned a, b, c, d, low, high;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & (fma | osxsave)) != (fma | osxsave))
        return false;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    (void)high;
    if ((low & saved_registers) != saved_registers)
        return false;
    return __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & avx2) != 0;
}

#else

bool er_has_avx2(void)
{
    return false;
}

#endif
