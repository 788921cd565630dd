/* Motion of the links with the tool on its path: an iteration of Gauss and Newton's method over the whole path.
 *
 * docs/inverse.md has the sum of squares.  The nodes are gone along once: evaluated, four at a time, added to the
 * front of the normal equations and eliminated; what is kept does not grow with the path.
 */
#ifndef ER_LINK_PATH_H
#define ER_LINK_PATH_H

#include "chain_rows.h"

/* A path of `intervals` between nodes, at each of which it is desired; also in the middles of the outermost `edge`
 * intervals, first those at the start. */
typedef struct {
    int64_t intervals, edge;
    const double *weights; /* of coefficients for theta, theta', theta'' at a node, then in a middle, (2, 3, 6) */
    const double *position, *quaternion, *wrench;                      /* at the nodes [m; x, y, z, w; N, N m] */
    const double *middle_position, *middle_quaternion, *middle_wrench; /* in the middles */
    const double *rigid;   /* coefficients of the rigid robot's joints [rad], (intervals + 5, joints) */
    const double *balance; /* weight of a missing torque of each tilt [1/(N m)] */
    double position_weight, rotation_weight;     /* [1/m], [1/rad] */
    double acceleration_weight, tether;          /* of joints less the rigid robot's [s^2/rad], [1/rad] */
    int64_t conditions;        /* at the ends: weights @ coefficients of one angle from a first one on = target */
    const int64_t *condition_first, *condition_angle;
    const double *condition_weights, *condition_target; /* (conditions, 5), [rad] */
} er_link_task;

/* Largest errors before an iteration, largest change of an angle in it. */
typedef struct {
    double position, rotation, torque, step; /* [m], [rad], [N m], [rad] */
    double cut; /* largest difference of changes that were solved for twice [rad] */
} er_link_report;

/* What iterations of a robot's links work with. */
typedef struct er_link_iterations er_link_iterations;

/* NULL if it does not fit into memory.  A store of factors keeps its last `lag` nodes. */
ER_EXPORT er_link_iterations *er_link_iterations_create(const er_desk *desk, int64_t lag);
ER_EXPORT void er_link_iterations_free(er_link_iterations *links);

/* Fills in the changes of all coefficients [rad], (intervals + 5, angles); false if the normal equations, with their
 * diagonal enlarged by a part `damping` of it, are not positive definite. */
ER_EXPORT bool er_link_iterations_improve(er_link_iterations *links, const er_link_task *task, const double *coefficients, double damping,
                                double *step, er_link_report *report);

#endif
