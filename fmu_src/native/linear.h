/* Small systems of linear equations, factorised in place. */
#ifndef ER_LINEAR_H
#define ER_LINEAR_H

#include <stdbool.h>

#include "robot_data.h"

/* LU factors of an n x n matrix by rows, with partial pivoting; false if it is singular. */
bool er_lu_factor(int n, double *matrix, int *pivot);

/* Overwrites a right-hand side with the solution. */
void er_lu_solve(int n, const double *factors, const int *pivot, double *b);

/* L D L^T of a symmetric positive definite matrix; D is stored inverted.  False if it is not. */
bool er_ldl_factor(int n, double *matrix);
void er_ldl_solve(int n, const double *factors, double *b);

/* An entry of two complex systems that are solved side by side. */
typedef struct {
    double re[2], im[2];
} er_complex_pair;

/* The same factors of two complex symmetric matrices, for matrices M + l D + l^2 K of positive definite M, D, K
 * with |arg l| < pi/2: turned by -arg l their numerical range lies in the right half plane. */
bool er_pair_factor(int n, er_complex_pair *matrix);
void er_pair_solve(int n, const er_complex_pair *factors, er_complex_pair *b);

#endif
