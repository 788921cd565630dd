/* Hysteresis of gears and friction of motors: stop elements, springs that slip (Maxwell slip).
 *
 * An element's elongation s follows its coordinate, s = clip(s + dx, +-a), and its torque is F share s / a,
 * with the torque F at which all elements of the gear slip.  While it sticks it is a spring, while it slips a
 * constant: it slips from |s| = a on until the coordinate's rate reverses.  elastic_robot/hysteresis.py is
 * the same in Python.
 */
#ifndef ER_HYSTERESIS_H
#define ER_HYSTERESIS_H

#include "robot_data.h"

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
void er_stops_stiffness(const er_robot *robot, const double *slip_torque, const er_stops *stops,
                        double *stiffness);

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

#endif
