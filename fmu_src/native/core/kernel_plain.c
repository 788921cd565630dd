/* The kernel in plain C: one state after another. */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "gauss.h"
#include "kernel.h"

typedef double er_real;
#define ER_WIDTH 1
#define ER_NAME(name) plain_##name

/* A pair of complex factors, ready to be multiplied by others. */
typedef er_complex_pair factor_pair;

static inline factor_pair as_factor(const er_complex_pair *c)
{
    return *c;
}

/* Multiplies b by c. */
static inline void multiply(er_complex_pair *b, factor_pair c)
{
    for (int p = 0; p < ER_PAIRS; p++) {
        double re = b->re[p], im = b->im[p];
        b->re[p] = re * c.re[p] - im * c.im[p];
        b->im[p] = re * c.im[p] + im * c.re[p];
    }
}

/* Takes b c off a. */
static inline void take_off(er_complex_pair *a, const er_complex_pair *b, factor_pair c)
{
    for (int p = 0; p < ER_PAIRS; p++) {
        a->re[p] = a->re[p] - b->re[p] * c.re[p] + b->im[p] * c.im[p];
        a->im[p] = a->im[p] - b->re[p] * c.im[p] - b->im[p] * c.re[p];
    }
}

#include "kernel_vector.h"
#include "kernel_body.h"
#include "kernel_newton.h"
#include "kernel_tangent.h"

er_kernel er_plain_kernel(void)
{
    return (er_kernel){plain_turn,    plain_reach,  plain_loads, plain_stages, plain_factor,
                       plain_improve, plain_filter, plain_link,  plain_shift,  plain_tangent};
}
