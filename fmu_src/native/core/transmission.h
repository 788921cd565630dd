/* Kinematic error of gears: the chain is not driven by a drive's angle q, but by u = q + eps(q),
 *
 *     u' = (1 + eps') q',    u'' = (1 + eps') q'' + eps'' q'^2.
 *
 * A motor that moves by itself feels (1 + eps') times its gear's torque.  The mapping is made where drives become
 * angles of the chain; robots without an error are not asked. */
#ifndef ER_TRANSMISSION_H
#define ER_TRANSMISSION_H

#include "robot_data.h"

/* eps and its derivatives by the angle of a drive. */
typedef struct {
    double value, slope, bend, third; /* [rad], 1, [1/rad], [1/rad^2] */
} er_gear_error;

static inline bool er_has_gear_error(const er_robot *robot, int joint)
{
    return robot->first_error[joint] < robot->first_error[joint + 1];
}

/* The sum of a joint's sines at an angle of its drive [rad]. */
er_gear_error er_gear_error_sum(const er_robot *robot, int joint, double angle);

/* That, or zeros without an error: asked for in every pass of Newton's method. */
static inline er_gear_error er_gear_error_at(const er_robot *robot, int joint, double angle)
{
    if (!er_has_gear_error(robot, joint))
        return (er_gear_error){0.0, 0.0, 0.0, 0.0};
    return er_gear_error_sum(robot, joint, angle);
}

/* What changes of u, u', u'' follow from: eps at a drive's q, with its q' and q''. */
typedef struct {
    er_gear_error error;
    double rate, acceleration; /* [rad/s, rad/s^2] */
} er_transmission;

er_transmission er_transmission_at(const er_robot *robot, int joint, double q, double qd, double qdd);

/* u, u', u'' of a drive's motion; and changes of that along changes of q, q', q''. */
void er_transmit(const er_robot *robot, int joint, double *q, double *qd, double *qdd);
void er_transmit_along(const er_transmission *at, double *q, double *qd, double *qdd);

#endif
