/* Vectors of three, matrices of nine numbers (by rows), and small systems of equations. */
#ifndef ER_LINEAR_H
#define ER_LINEAR_H

#include <math.h>
#include <stdbool.h>

#include "robot_data.h"

/* Entries of a stiffness, xx, xy, xz, yy, yz, zz, and their rows and columns. */
#define ER_SYMMETRIC 6
static const int er_row[ER_SYMMETRIC] = {0, 0, 0, 1, 1, 2}, er_column[ER_SYMMETRIC] = {0, 1, 2, 1, 2, 2};

static inline double er_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void er_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* sum += a x b */
static inline void er_add_cross(const double a[3], const double b[3], double sum[3])
{
    double product[3];
    er_cross(a, b, product);
    for (int c = 0; c < 3; c++)
        sum[c] += product[c];
}

/* out = R v */
static inline void er_rotate(const double R[9], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2];
}

/* out = A B */
static inline void er_compose(const double A[9], const double B[9], double out[9])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[3 * i + j] =
                A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

/* out = S v for a symmetric S = xx, yy, zz, xy, xz, yz */
static inline void er_symmetric_times(const double S[6], const double v[3], double out[3])
{
    out[0] = S[0] * v[0] + S[3] * v[1] + S[4] * v[2];
    out[1] = S[3] * v[0] + S[1] * v[1] + S[5] * v[2];
    out[2] = S[4] * v[0] + S[5] * v[1] + S[2] * v[2];
}

/* LU factors of an n x n matrix by rows, with partial pivoting; false if it is singular. */
static inline bool er_lu_factor(int n, double *a, int *pivot)
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

/* Overwrites a right-hand side with the solution. */
static inline void er_lu_solve(int n, const double *a, const int *pivot, double *b)
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

/* Whether the symmetric part of a matrix is positive definite: Cholesky's method. */
static inline bool er_is_positive(int n, const double *matrix)
{
    double root[ER_MAX_ANGLES * ER_MAX_ANGLES];
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = 0.5 * (matrix[i * n + j] + matrix[j * n + i]);
            for (int k = 0; k < j; k++)
                sum -= root[i * n + k] * root[j * n + k];
            if (i == j && !(sum > 0.0))
                return false;
            root[i * n + j] = i == j ? sqrt(sum) : sum / root[j * n + j];
        }
    return true;
}

#endif
