/* The kernel with four states in the lanes of AVX2 registers.
 *
 * Built everywhere; used where the compiler has vector types and the processor has AVX2 (processor.h).
 */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "../chain/processor.h"
#include "kernel.h"

#if defined(ER_VECTORS)

#include <immintrin.h>

ER_BEGIN_AVX2

typedef double er_real __attribute__((vector_size(8 * ER_LANES), may_alias));
#define ER_WIDTH ER_LANES
#define ER_NAME(name) avx2_##name

/* A pair of complex numbers, and the same with real and imaginary parts exchanged. */
typedef struct {
    er_real straight, exchanged;
} pair;

static inline er_real exchange(er_real value)
{
    return (er_real)_mm256_permute2f128_pd((__m256d)value, (__m256d)value, 1);
}

static inline pair read_pair(const er_complex_pair *c)
{
    er_real value = *(const er_real *)c;
    return (pair){value, exchange(value)};
}

static inline void as_factor(const er_complex_pair *c, er_factor *factor)
{
    const __m256d value = (__m256d) * (const er_real *)c;
    const er_real conjugate = {1.0, 1.0, -1.0, -1.0};
    *(er_real *)factor->re = (er_real)_mm256_permute2f128_pd(value, value, 0x00);
    *(er_real *)factor->im = conjugate * (er_real)_mm256_permute2f128_pd(value, value, 0x11);
}

/* Overwrites c with 1 / c; false where that is not finite. */
static inline bool take_reciprocal(er_complex_pair *c)
{
    const pair value = read_pair(c);
    const er_real conjugate = {1.0, 1.0, -1.0, -1.0};
    er_real size = value.straight * value.straight + value.exchanged * value.exchanged;
    *(er_real *)c = conjugate * value.straight / size;
    return _mm256_movemask_pd(_mm256_and_pd((__m256d)(size > 0.0), (__m256d)(size < INFINITY))) == 15;
}

static inline void set_real(er_complex_pair *c, double value)
{
    *(er_real *)c = (er_real){value, value, 0.0, 0.0};
}

/* result = b c */
static inline void multiply(const pair *b, const er_factor *c, er_complex_pair *result)
{
    *(er_real *)result = b->straight * *(const er_real *)c->re +
                         b->exchanged * exchange(*(const er_real *)c->im);
}

/* Takes b c off a. */
static inline void take_off(er_complex_pair *a, const er_factor *c, const pair *b)
{
    *(er_real *)a = *(er_real *)a - b->straight * *(const er_real *)c->re -
                    b->exchanged * exchange(*(const er_real *)c->im);
}

/* A sum of products: `crossed` is exchanged once, at its end. */
typedef struct {
    er_real straight, crossed;
} product;

static inline product as_product(const er_complex_pair *b)
{
    return (product){*(const er_real *)b, (er_real){0.0, 0.0, 0.0, 0.0}};
}

static inline product product_of(const er_factor *c, const er_complex_pair *b)
{
    const er_real value = *(const er_real *)b;
    return (product){value * *(const er_real *)c->re, value * *(const er_real *)c->im};
}

static inline void add_product(product *sum, const er_factor *c, const er_complex_pair *b)
{
    const er_real value = *(const er_real *)b;
    sum->straight += value * *(const er_real *)c->re;
    sum->crossed += value * *(const er_real *)c->im;
}

static inline void write_product(const product *sum, er_complex_pair *result)
{
    *(er_real *)result = sum->straight + exchange(sum->crossed);
}

#include "kernel_vector.h"
#include "kernel_body.h"
#include "kernel_newton.h"
#include "kernel_tangent.h"

ER_END_AVX2

er_kernel er_best_kernel(void)
{
    return er_has_avx2()
               ? (er_kernel){avx2_drive, avx2_move, avx2_reach, avx2_loads, avx2_carry, avx2_stages,
                             avx2_finish, avx2_spread, avx2_invert, avx2_improve, avx2_filter,
                             avx2_link, avx2_direct, avx2_shift, avx2_tangent, avx2_motor_stages, avx2_motor_wind_up,
                             avx2_motor_residual, avx2_motor_before, avx2_motor_after}
               : er_plain_kernel();
}

#else

er_kernel er_best_kernel(void)
{
    return er_plain_kernel();
}

#endif
