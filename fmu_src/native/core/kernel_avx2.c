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

/* A pair of complex numbers, and the same with real and imaginary parts exchanged. */
typedef struct {
    er_real straight, exchanged;
} pair;

static inline pair read_pair(const er_complex_pair *c)
{
    er_real value = *(const er_real *)c;
    return (pair){value, (er_real)_mm256_permute2f128_pd((__m256d)value, (__m256d)value, 1)};
}

static inline void as_factor(const er_complex_pair *c, er_factor *factor)
{
    const __m256d value = (__m256d)read_pair(c).straight;
    const er_real signs = {-1.0, -1.0, 1.0, 1.0};
    *(er_real *)factor->re = (er_real)_mm256_permute2f128_pd(value, value, 0x00);
    *(er_real *)factor->im = signs * (er_real)_mm256_permute2f128_pd(value, value, 0x11);
}

/* Overwrites c with 1 / c; false where that is not finite. */
static inline bool invert(er_complex_pair *c)
{
    const pair value = read_pair(c);
    const er_real conjugate = {1.0, 1.0, -1.0, -1.0};
    er_real size = value.straight * value.straight + value.exchanged * value.exchanged;
    *(er_real *)c = conjugate * value.straight / size;
    return size[0] > 0.0 && size[0] < INFINITY && size[1] > 0.0 && size[1] < INFINITY;
}

static inline void set_real(er_complex_pair *c, double value)
{
    *(er_real *)c = (er_real){value, value, 0.0, 0.0};
}

/* product = b c */
static inline void multiply(const er_complex_pair *b, const er_factor *c, er_complex_pair *product)
{
    pair by = read_pair(b);
    *(er_real *)product = by.straight * *(const er_real *)c->re + by.exchanged * *(const er_real *)c->im;
}

/* Takes b c off a. */
static inline void take_off(er_complex_pair *a, const er_factor *c, const pair *b)
{
    *(er_real *)a = *(er_real *)a - b->straight * *(const er_real *)c->re -
                    b->exchanged * *(const er_real *)c->im;
}

#include "kernel_vector.h"
#include "kernel_body.h"
#include "kernel_newton.h"
#include "kernel_link.h"
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
    return has_avx2()
               ? (er_kernel){avx2_drive, avx2_move, avx2_reach, avx2_loads, avx2_carry, avx2_stages,
                             avx2_spread, avx2_factor, avx2_improve, avx2_filter, avx2_link,
                             avx2_direct, avx2_springs, avx2_shift, avx2_tangent}
               : er_plain_kernel();
}

#else

er_kernel er_best_kernel(void)
{
    return er_plain_kernel();
}

#endif
