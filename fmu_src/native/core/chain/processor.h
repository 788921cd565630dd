/* What the processor can do. */
#ifndef ER_PROCESSOR_H
#define ER_PROCESSOR_H

#include <stdbool.h>

/* Whether it, by its own word (cpuid) and the system's (xgetbv), has AVX2 and fused multiply-add. */
bool er_has_avx2(void);

/* Between them functions are compiled for such a processor, where the compiler has vector types (ER_VECTORS). */
#if defined(__GNUC__) && defined(__x86_64__)
#define ER_VECTORS
#if defined(__clang__)
#define ER_BEGIN_AVX2 _Pragma("clang attribute push(__attribute__((target(\"avx2,fma\"))), apply_to = function)")
#define ER_END_AVX2 _Pragma("clang attribute pop")
#else
#define ER_BEGIN_AVX2 _Pragma("GCC push_options") _Pragma("GCC target(\"avx2,fma\")")
#define ER_END_AVX2 _Pragma("GCC pop_options")
#endif
#endif

#endif
