/* Inverse kinematics: angles of the drives under which the TCP is at poses. */
#ifndef ER_REACH_H
#define ER_REACH_H

#include "chain_rows.h"

/* How poses are approached: damped least squares, position [m] and rotation vector [rad]. */
typedef struct {
    double tolerance;  /* a step is the last one if the error before it was smaller */
    int64_t iterations;
    double damping, least; /* of the squared error, and always */
    double largest_step;   /* of a joint in an iteration [rad] */
} er_reach_rules;

/* Changes the angles of the joints, in rows of all angles of the chain, until the TCP is at positions [m], (count, 3),
 * with quaternions x, y, z, w, (count, 4), from what `theta` holds.  `error`: norm of position and rotation before the
 * last step, (count); `away`: the smallest distance from the position [m]. */
ER_EXPORT void er_desk_reach(const er_desk *desk, const er_reach_rules *rules, int64_t count, const double *position,
                             const double *quaternion, double *theta, double *error, double *away);

#endif
