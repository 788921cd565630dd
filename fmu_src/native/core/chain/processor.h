/* What the processor can do. */
#ifndef ER_PROCESSOR_H
#define ER_PROCESSOR_H

#include <stdbool.h>

/* Whether it, by its own word (cpuid) and the system's (xgetbv), has AVX2 and fused multiply-add. */
bool er_has_avx2(void);

#endif
