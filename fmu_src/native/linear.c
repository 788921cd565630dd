#include "linear.h"

#include <math.h>

bool er_lu_factor(int n, double *a, int *pivot)
{
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[i * n + k]) > fabs(a[best * n + k]))
                best = i;
        pivot[k] = best;
        if (!(fabs(a[best * n + k]) > 0.0))
            return false;
        for (int j = 0; best != k && j < n; j++) {
            double swapped = a[k * n + j];
            a[k * n + j] = a[best * n + j];
            a[best * n + j] = swapped;
        }
        for (int i = k + 1; i < n; i++) {
            double factor = a[i * n + k] /= a[k * n + k];
            for (int j = k + 1; j < n; j++)
                a[i * n + j] -= factor * a[k * n + j];
        }
    }
    return true;
}

void er_lu_solve(int n, const double *a, const int *pivot, double *b)
{
    for (int k = 0; k < n; k++) {
        double swapped = b[pivot[k]];
        b[pivot[k]] = b[k];
        b[k] = swapped;
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            b[i] -= a[i * n + j] * b[j];
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++)
            b[i] -= a[i * n + j] * b[j];
        b[i] /= a[i * n + i];
    }
}

bool er_ldl_factor(int n, double *a)
{
    for (int j = 0; j < n; j++) {
        if (!(a[j * n + j] > 0.0))
            return false;
        a[j * n + j] = 1.0 / a[j * n + j];
        for (int i = j + 1; i < n; i++) {
            double factor = a[i * n + j] * a[j * n + j];
            for (int k = j + 1; k <= i; k++)
                a[i * n + k] -= factor * a[k * n + j];
        }
        for (int i = j + 1; i < n; i++)
            a[i * n + j] *= a[j * n + j];
    }
    return true;
}

void er_ldl_solve(int n, const double *a, double *b)
{
    for (int j = 0; j < n; j++)
        for (int i = j + 1; i < n; i++)
            b[i] -= a[i * n + j] * b[j];
    for (int j = n - 1; j >= 0; j--) {
        b[j] *= a[j * n + j];
        for (int i = j + 1; i < n; i++)
            b[j] -= a[i * n + j] * b[i];
    }
}

/* a -= b c, in both systems. */
static inline void subtract_product(er_complex_pair *a, const er_complex_pair *b,
                                    const er_complex_pair *c)
{
    for (int p = 0; p < 2; p++) {
        a->re[p] -= b->re[p] * c->re[p] - b->im[p] * c->im[p];
        a->im[p] -= b->re[p] * c->im[p] + b->im[p] * c->re[p];
    }
}

static inline er_complex_pair product(const er_complex_pair *b, const er_complex_pair *c)
{
    er_complex_pair out;
    for (int p = 0; p < 2; p++) {
        out.re[p] = b->re[p] * c->re[p] - b->im[p] * c->im[p];
        out.im[p] = b->re[p] * c->im[p] + b->im[p] * c->re[p];
    }
    return out;
}

/* Overwrites d with 1 / d; false where that is not finite. */
static inline bool invert(er_complex_pair *d)
{
    for (int p = 0; p < 2; p++) {
        double size = d->re[p] * d->re[p] + d->im[p] * d->im[p];
        if (!(size > 0.0 && size < INFINITY))
            return false;
        d->re[p] /= size;
        d->im[p] /= -size;
    }
    return true;
}

bool er_pair_factor(int n, er_complex_pair *a)
{
    for (int j = 0; j < n; j++) {
        if (!invert(&a[j * n + j]))
            return false;
        for (int i = j + 1; i < n; i++) {
            er_complex_pair factor = product(&a[i * n + j], &a[j * n + j]);
            for (int k = j + 1; k <= i; k++)
                subtract_product(&a[i * n + k], &factor, &a[k * n + j]);
        }
        for (int i = j + 1; i < n; i++)
            a[i * n + j] = product(&a[i * n + j], &a[j * n + j]);
    }
    return true;
}

void er_pair_solve(int n, const er_complex_pair *a, er_complex_pair *b)
{
    for (int j = 0; j < n; j++)
        for (int i = j + 1; i < n; i++)
            subtract_product(&b[i], &a[i * n + j], &b[j]);
    for (int j = n - 1; j >= 0; j--) {
        b[j] = product(&b[j], &a[j * n + j]);
        for (int i = j + 1; i < n; i++)
            subtract_product(&b[j], &a[i * n + j], &b[i]);
    }
}
