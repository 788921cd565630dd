/* What gears have beside their curve: stop elements, kinematic errors, balancers. */
#ifndef ER_GEAR_PARTS_H
#define ER_GEAR_PARTS_H

#include "../chain/robot_data.h"

/* Hysteresis of gears and friction of motors: stop elements, springs that slip (Maxwell slip).
 *
 * An element's elongation s follows its coordinate, s = clip(s + dx, +-a), and its torque is F share s / a,
 * with the torque F at which all elements of the gear slip.  While it sticks it is a spring, while it slips a
 * constant: it slips from |s| = a on until the coordinate's rate reverses.  elastic_robot/hysteresis.py is
 * the same in Python.
 */

/* The elements' state. */
typedef struct {
    double elongation[ER_MAX_ELEMENTS]; /* [rad] */
    int slipping[ER_MAX_ELEMENTS];      /* 0: it sticks; else the direction in which it slips */
} er_stops;

/* Torque of an element over its elongation [N m/rad], where all of its coordinate slip at a torque. */
static inline double er_element_stiffness(const er_robot *robot, const double *slip_torque, int j)
{
    const er_element *element = &robot->element[j];
    return slip_torque[element->coordinate] * element->share / element->angle;
}

/* Torque of the elements of a coordinate that all slip at a torque, of elongations [N m]. */
double er_elements_torque(const er_robot *robot, int k, double slip_torque, const double *elongation);

/* Adds the stiffness of those that stick [N m/rad], with the torques at which all of a coordinate slip; it is
 * linear in these. */
void er_stops_stiffness(const er_robot *robot, const double *slip_torque, const er_stops *stops, double *stiffness);

/* Lets the elongations of elements that stick, or changes of them, follow x, or the motors. */
void er_stops_follow(const er_robot *robot, const er_stops *stops, const double *before, const double *after,
                     double *elongation);
void er_stops_follow_motors(const er_robot *robot, const er_stops *stops, const double *before,
                            const double *after, double *elongation);

/* Lets an element slip in a direction, or all that slip on a coordinate stick again. */
void er_stops_slip(const er_robot *robot, er_stops *stops, int j, int direction);
void er_stops_stick(const er_robot *robot, er_stops *stops, int coordinate);

/* Whether another element of the same coordinate slips as one begins to: at the end of a loop all of them return
 * to their slip angles at once. */
bool er_stops_slips_too(const er_robot *robot, const er_stops *stops, int j, int first, int direction);

/* How far beyond its slip angle an element sticks [rad], so that rounding does not undo it; and the rate of a
 * coordinate by which a reversal is passed [rad/s]. */
double er_stop_slack(const er_robot *robot, int j, double tolerance);
double er_reversal_slack(const er_robot *robot, int coordinate, double tolerance);

/* Whether elements of a coordinate exert nothing, and are not watched. */
bool er_stops_idle(const er_robot *robot, const double *slip_torque, int coordinate);

/* Lets elements slip that are beyond their slip angles: those of no torque are not watched. */
void er_stops_limit(const er_robot *robot, er_stops *stops);

/* From where the elements come to rest: coordinates go from there to their rest in one direction each. */
typedef struct {
    double x[ER_MAX_ANGLES];            /* [rad] */
    double elongation[ER_MAX_ELEMENTS]; /* there [rad]; infinite: they slip */
} er_history;

/* Torque of the elements of a coordinate at rest at x [N m], and its slope [N m/rad]. */
double er_rest_torque(const er_robot *robot, const double *slip_torque, const er_history *history, int k,
                      double x, double *slope);

/* The elements at rest there. */
void er_stops_rest(const er_robot *robot, const er_history *history, const double *x, er_stops *stops);

/* Kinematic error of gears: the chain is not driven by a drive's angle q, but by u = q + eps(q),
 *
 *     u' = (1 + eps') q',    u'' = (1 + eps') q'' + eps'' q'^2.
 *
 * A motor that moves by itself feels (1 + eps') times its gear's torque.  The mapping is made where drives become
 * angles of the chain; robots without an error are not asked. */

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

/* Balancers: torques on links over the angles of their joints, cubics between points, straight beyond them. */

/* Torque of a balancer at an angle of its joint, and its derivatives by that. */
typedef struct {
    double torque, slope, bend; /* [N m, N m/rad, N m/rad^2] */
} er_balance;

er_balance er_balance_at(const er_balancer *balancer, double angle);

/* Adds the torques of a robot at rest to those that its gears must carry [N m], and their slopes to the gradient of
 * these [N m/rad], m x m by rows; q of the chain, x may be NULL. */
void er_balance_torque(const er_robot *robot, const double *q, const double *x, double *torque);
void er_balance_gradient(const er_robot *robot, const double *q, const double *x, double *gradient);

#endif
