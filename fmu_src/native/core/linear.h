/* Small systems of linear equations, factorised in place. */
#ifndef ER_LINEAR_H
#define ER_LINEAR_H

#include <stdbool.h>

#include "robot_data.h"

/* LU factors of an n x n matrix by rows, with partial pivoting; false if it is singular. */
bool er_lu_factor(int n, double *matrix, int *pivot);

/* Overwrites a right-hand side with the solution. */
void er_lu_solve(int n, const double *factors, const int *pivot, double *b);

#endif
