/* The kernel with four states in the lanes of AVX2 registers.
 *
 * Built everywhere; used where the compiler has vector types and the processor, by its own word
 * (cpuid) and the system's (xgetbv), has AVX2 and fused multiply-add.
 */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "gauss.h"
#include "kernel.h"

#if defined(__GNUC__) && defined(__x86_64__)

#include <cpuid.h>
#include <immintrin.h>

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif

typedef double er_real __attribute__((vector_size(8 * ER_LANES), may_alias));
#define ER_WIDTH ER_LANES
#define ER_NAME(name) avx2_##name

/* A pair of complex factors c as c and i c, ready to be multiplied by others. */
typedef struct {
    er_real straight, crossed;
} factor_pair;

static inline factor_pair as_factor(const er_complex_pair *c)
{
    return (factor_pair){*(const er_real *)c, {-c->im[0], -c->im[1], c->re[0], c->re[1]}};
}

/* Two numbers twice. */
static inline er_real doubled(const double pair[2])
{
    return (er_real)_mm256_broadcast_pd((const __m128d *)pair);
}

/* Multiplies b by c. */
static inline void multiply(er_complex_pair *b, factor_pair c)
{
    er_real re = doubled(b->re), im = doubled(b->im);
    *(er_real *)b = re * c.straight + im * c.crossed;
}

/* Takes b c off a. */
static inline void take_off(er_complex_pair *a, const er_complex_pair *b, factor_pair c)
{
    er_real re = doubled(b->re), im = doubled(b->im);
    *(er_real *)a = *(er_real *)a - re * c.straight - im * c.crossed;
}

#include "kernel_vector.h"
#include "kernel_body.h"
#include "kernel_newton.h"
#include "kernel_tangent.h"

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

static bool has_avx2(void)
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

er_kernel er_best_kernel(void)
{
    return has_avx2() ? (er_kernel){avx2_turn, avx2_reach, avx2_loads, avx2_stages, avx2_factor,
                                   avx2_improve, avx2_filter, avx2_link, avx2_shift,
                                   avx2_tangent}
                     : er_plain_kernel();
}

#else

er_kernel er_best_kernel(void)
{
    return er_plain_kernel();
}

#endif
