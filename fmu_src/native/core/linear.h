/* Vectors of three, matrices of nine numbers (by rows), and small systems of equations. */
#ifndef ER_LINEAR_H
#define ER_LINEAR_H

#include <stdbool.h>

/* Entries of a stiffness: xx, xy, xz, yy, yz, zz. */
#define ER_SYMMETRIC 6

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
bool er_lu_factor(int n, double *matrix, int *pivot);

/* Overwrites a right-hand side with the solution. */
void er_lu_solve(int n, const double *factors, const int *pivot, double *b);

#endif
