/* The four stages of a step: numbers side by side, and the coefficients of their method. */
#ifndef ER_GAUSS_H
#define ER_GAUSS_H

#include "robot_data.h"

/* Coefficients of the four-stage Gauss collocation method for second-order equations.
 *
 * The accelerations a_i at the nodes c_i give, for a step of length h from x_0, v_0,
 *
 *     x_i = x_0 + c_i h v_0 + h^2 sum_j A2_ij a_j,      v_i = v_0 + h sum_j A1_ij a_j,
 *
 * with A2 = A1 A1 (Hairer and Wanner 1996, IV.5).  tests/native/test_core.py computes every number anew.
 */

#define ER_STAGES 4
#if defined(__GNUC__)
#define ER_ALIGNED __attribute__((aligned(32)))
#else
#define ER_ALIGNED
#endif
#define ER_PAIRS 2           /* conjugate pairs of eigenvalues of A1 */
#define ER_DEGREE 5          /* of the position polynomial of a step */
#define ER_CONTROL (ER_DEGREE + 1)

/* Nodes, and A1 and A2 by columns: [j][i]. */
extern ER_ALIGNED const double er_gauss_node[ER_STAGES];
extern ER_ALIGNED const double er_gauss_once[ER_STAGES][ER_STAGES];
extern ER_ALIGNED const double er_gauss_twice[ER_STAGES][ER_STAGES];

/* Weights of the accelerations for rate, position and acceleration at the step's end. */
extern const double er_gauss_end_rate[ER_STAGES];
extern const double er_gauss_end_position[ER_STAGES];
extern const double er_gauss_end_acceleration[ER_STAGES];

/* Eigenvalues of A1 with a positive imaginary part, that next to the real axis first; the others are their
 * conjugates. */
extern const double er_gauss_eigen_re[ER_PAIRS], er_gauss_eigen_im[ER_PAIRS];

/* A1 = T diag(..) T^-1.  A stage's column of T^-1, by eigenvalue: real parts, then imaginary ones.  And what
 * these make of the stages, with their conjugates: twice the real part of T times them. */
extern ER_ALIGNED const double er_gauss_to_pairs[ER_STAGES][2 * ER_PAIRS];
extern ER_ALIGNED const double er_gauss_from_pairs[2 * ER_PAIRS][ER_STAGES];

/* Bernstein coefficients of x(s) on [0, 1] from x_0, h v_0, h^2 a_1 .. h^2 a_4. */
extern const double er_gauss_bernstein[ER_CONTROL][ER_CONTROL];

/* The same from the values of x at 0, at the nodes and at 1. */
extern const double er_gauss_bernstein_from_value[ER_CONTROL][ER_CONTROL];

/* Power coefficients in s of the acceleration from its values at the nodes. */
extern const double er_gauss_power_from_stage[ER_STAGES][ER_STAGES];

/* Weights of a step's accelerations for those at the nodes of another step, which starts at `start`
 * lengths of the first and is `ratio` times as long. */
void er_gauss_interpolation(double start, double ratio, double weights[ER_STAGES][ER_STAGES]);

/* States that one call takes. */
#define ER_LANES ER_STAGES

/* Quantities of several states: [angle][state]. */
typedef double er_lanes[ER_LANES];

#endif
