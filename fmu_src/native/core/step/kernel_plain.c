/* The kernel in plain C: one state after another. */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "kernel.h"


typedef double er_real;
#define ER_WIDTH 1
#define ER_NAME(name) plain_##name

typedef er_complex_pair pair;

static inline pair read_pair(const er_complex_pair *c)
{
    return *c;
}

static inline void as_factor(const er_complex_pair *c, er_factor *factor)
{
    for (int p = 0; p < ER_PAIRS; p++) {
        factor->re[p] = factor->re[ER_PAIRS + p] = c->re[p];
        factor->im[p] = c->im[p];
        factor->im[ER_PAIRS + p] = -c->im[p];
    }
}

/* Overwrites c with 1 / c; false where that is not finite. */
static inline bool take_reciprocal(er_complex_pair *c)
{
    for (int p = 0; p < ER_PAIRS; p++) {
        double size = c->re[p] * c->re[p] + c->im[p] * c->im[p];
        if (!(size > 0.0 && size < INFINITY))
            return false;
        c->re[p] /= size;
        c->im[p] /= -size;
    }
    return true;
}

static inline void set_real(er_complex_pair *c, double value)
{
    *c = (er_complex_pair){{value, value}, {0.0, 0.0}};
}

/* result = b c */
static inline void multiply(const pair *b, const er_factor *c, er_complex_pair *result)
{
    for (int p = 0; p < ER_PAIRS; p++) {
        double re = b->re[p], im = b->im[p];
        result->re[p] = re * c->re[p] - im * c->im[p];
        result->im[p] = re * c->im[p] + im * c->re[p];
    }
}

/* Takes b c off a. */
static inline void take_off(er_complex_pair *a, const er_factor *c, const pair *b)
{
    for (int p = 0; p < ER_PAIRS; p++) {
        a->re[p] = a->re[p] - b->re[p] * c->re[p] + b->im[p] * c->im[p];
        a->im[p] = a->im[p] - b->re[p] * c->im[p] - b->im[p] * c->re[p];
    }
}

/* A sum of products. */
typedef er_complex_pair product;

static inline product as_product(const er_complex_pair *b)
{
    return *b;
}

static inline product product_of(const er_factor *c, const er_complex_pair *b)
{
    product first;
    multiply(b, c, &first);
    return first;
}

static inline void add_product(product *sum, const er_factor *c, const er_complex_pair *b)
{
    for (int p = 0; p < ER_PAIRS; p++) {
        sum->re[p] += b->re[p] * c->re[p] - b->im[p] * c->im[p];
        sum->im[p] += b->re[p] * c->im[p] + b->im[p] * c->re[p];
    }
}

static inline void write_product(const product *sum, er_complex_pair *result)
{
    *result = *sum;
}

#include "kernel_vector.h"
#include "kernel_body.h"
#include "kernel_newton.h"
#include "kernel_tangent.h"

er_kernel er_plain_kernel(void)
{
    return (er_kernel){plain_drive, plain_move, plain_reach, plain_loads, plain_carry, plain_stages,
                       plain_finish, plain_spread, plain_invert, plain_improve, plain_filter,
                       plain_link, plain_direct, plain_shift, plain_tangent, plain_motor_stages, plain_motor_wind_up,
                       plain_motor_residual, plain_motor_before, plain_motor_after};
}
