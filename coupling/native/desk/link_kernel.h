/* Loads of the whole chain in four states at once, and their derivatives.
 *
 * Like the kernel of a step it is written once, in link_body.h, and compiled for plain C and for AVX2; so are the
 * products of the normal equations (front_body.h).
 */
#ifndef ER_LINK_KERNEL_H
#define ER_LINK_KERNEL_H

#include "core/chain/gauss.h"
#include "core/step/kernel.h"

/* Angles of the chain whose loads are wanted. */
typedef struct {
    int count;
    int angle[ER_MAX_ANGLES];
    int row[ER_MAX_ANGLES]; /* of each angle among them; -1: it is none */
} er_wanted;

/* What all angles need and where the tool is, in each state; base axes. */
typedef struct {
    ER_ALIGNED er_lanes load[ER_MAX_ANGLES]; /* M theta'' + h - J^T w [N m] */
    ER_ALIGNED er_lanes position[3];         /* of the TCP [m] */
    ER_ALIGNED er_lanes rotation[9];         /* base_from_tool, by rows */
} er_link_state;

/* Derivatives of that. */
typedef struct {
    ER_ALIGNED er_lanes jacobian[6][ER_MAX_ANGLES]; /* of the TCP, velocity and angular velocity */
    /* Of the wanted loads by theta, theta', theta''. */
    ER_ALIGNED er_lanes load[3][ER_MAX_ANGLES][ER_MAX_ANGLES];
} er_link_derivatives;

/* A motion in each state, with the wrench on the robot at the TCP. */
typedef void er_link_loads_function(const er_robot *robot, const er_motion *motion, const er_lanes *wrench,
                                    er_link_state *state);
typedef void er_linearise_function(const er_robot *robot, const er_motion *motion, const er_lanes *wrench,
                                   const er_wanted *wanted, er_link_state *state, er_link_derivatives *by);

/* C += A^T B and C -= A^T B for n x n matrices C and `count` rows of A and B, `stride` apart; n is a multiple of
 * ER_LANES, everything is aligned. */
typedef void er_products_function(int n, int count, int stride, const double *A, const double *B, double *C);

/* Overwrites the upper triangle of a positive definite n x n matrix with U, U^T U; false if it is not.  The
 * reciprocals of its diagonal are told. */
typedef bool er_root_function(int n, double *matrix, double *reciprocal);

/* Overwrites the rows of an n x n matrix with U^-T times them. */
typedef void er_forward_function(int n, const double *U, const double *reciprocal, double *rows);

/* C += factor M of `count` numbers, a multiple of ER_LANES. */
typedef void er_add_multiple_function(int count, double factor, const double *M, double *C);

/* y -= B x for an n x n matrix B. */
typedef void er_take_product_function(int n, const double *B, const double *x, double *y);

/* Eliminates the first unknown of a band, whose rows of a matrix's upper half begin on the diagonal, `room` numbers
 * apart with at least ER_LANES blanks behind the `width` that count: the first row becomes that of U, U^T U.  False if
 * the matrix is not positive definite. */
typedef bool er_eliminate_row_function(int width, int room, double *rows, double *right);

typedef struct {
    er_link_loads_function *loads;
    er_linearise_function *linearise;
    er_products_function *add_products, *take_products;
    er_root_function *find_root;
    er_forward_function *forward;
    er_add_multiple_function *add_multiple;
    er_take_product_function *take_product;
    er_eliminate_row_function *eliminate_row;
} er_link_kernel;

/* The fastest of this processor. */
er_link_kernel er_best_link_kernel(void);

/* Plain C. */
er_link_kernel er_plain_link_kernel(void);

#endif
