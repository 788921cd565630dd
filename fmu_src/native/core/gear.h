/* What elastic coordinates resist with: the torque of the gears' curves (linear, backlash, spline) and damping; and
 * what gears have beside that, stop elements, kinematic errors, balancers.
 * Only gear.c knows a law; a new one is added there.
 *
 * The law of coordinate k changes at +-half_width[k].  In each region (-1 below, 0 inside, 1 above; 1
 * everywhere where the law never changes) it is one smooth branch, continued beyond the region's ends.
 * docs/model.md has the laws, elastic_robot/torque_curves.py and spline_curve.py the same in Python.
 */
#ifndef ER_GEAR_H
#define ER_GEAR_H

#include "kernel.h"
#include "robot_data.h"

/* A law is named by its place in TORQUE_CURVES; there may be so many. */
#define ER_MAX_LAWS 8
extern const int er_gear_laws;

/* Whether a law may change where a gear takes up its backlash. */
bool er_law_switches(int law);

/* Piecewise cubics through points, straight beyond the last; pieces = 0: a straight line. */
typedef struct {
    int points;
    double knot[ER_MAX_KNOTS];         /* angles [rad] */
    double value[ER_MAX_KNOTS];        /* torques there [N m] */
    double cubic[ER_MAX_KNOTS + 1][4]; /* coefficients 1, t, t^2, t^3 of each piece, ends included */
    double start[ER_MAX_KNOTS + 1];    /* angle from which t counts [rad] */
} er_spline;

typedef struct {
    int law;
    int count;                       /* m */
    double stiffness[ER_MAX_ANGLES]; /* [N m/rad] */
    double damping[ER_MAX_ANGLES];   /* [N m s/rad] */
    double backlash[ER_MAX_ANGLES];  /* [rad] */
    double half_width[ER_MAX_ANGLES]; /* [rad], infinite where the law never changes */
    double slip_torque[ER_MAX_COORDINATES]; /* at which all elements slip [N m], of the motors too */
    er_spline spline[ER_MAX_ANGLES];
} er_gears;

/* The gears of given parameters; it allocates nothing. */
void er_gears_build(er_gears *gears, int law, const er_robot *robot, const er_parameters *parameters);

/* S(x) [N m] and dS/dx [N m/rad] of coordinate k along its spline. */
double er_spline_torque(const er_gears *gears, int k, double x);
double er_spline_slope(const er_gears *gears, int k, double x);

/* The law of a coordinate in a region: slope (x - zero), or that of its spline. */
typedef struct {
    bool straight;
    double slope, zero; /* [N m/rad, rad]; 0 of a spline */
} er_branch;

static inline er_branch er_gear_branch(const er_gears *gears, int k, int region)
{
    if (region == 0)
        return (er_branch){true, 0.0, 0.0};
    if (gears->spline[k].points > 0)
        return (er_branch){false, 0.0, 0.0};
    /* Without backlash the region is 1 and the backlash zero. */
    return (er_branch){true, gears->stiffness[k], region * gears->backlash[k]};
}

/* S(x) [N m] of coordinate k on the branch of a region. */
static inline double er_gear_torque(const er_gears *gears, int k, int region, double x)
{
    er_branch branch = er_gear_branch(gears, k, region);
    return branch.straight ? branch.slope * (x - branch.zero) : er_spline_torque(gears, k, x);
}

/* dS/dx [N m/rad] of coordinate k on the branch of a region. */
static inline double er_gear_slope(const er_gears *gears, int k, int region, double x)
{
    if (region == 0)
        return 0.0;
    return gears->spline[k].points > 0 ? er_spline_slope(gears, k, x) : gears->stiffness[k];
}

/* Changes of S(x) [N m] on the branch of a region, and of the slope below [N m/rad], along changes of the
 * stiffness and the backlash of coordinate k; a table of its own takes the place of both. */
double er_gear_along(const er_gears *gears, int k, int region, double x, double stiffness,
                     double backlash);
double er_gear_flank_slope_along(const er_gears *gears, int k, double x, double stiffness,
                                 double backlash);

/* dS/dx [N m/rad], of the nearest flank where the gear is inside its backlash. */
double er_gear_flank_slope(const er_gears *gears, int k, double x);

/* Its derivative [N m/rad^2]. */
double er_gear_flank_curvature(const er_gears *gears, int k, double x);

/* Angle [rad] at which the curve carries a torque; 0 where that is not unique. */
double er_gear_deflection(const er_gears *gears, int k, double torque);

/* The region in which x lies. */
int er_gear_region(const er_gears *gears, int k, double x);

/* Whether the law of coordinate k changes anywhere. */
static inline bool er_gear_switches(const er_gears *gears, int k)
{
    return gears->half_width[k] < 1e300;
}

/* Whether the flanks of a coordinate are curved. */
static inline bool er_gear_is_bent(const er_gears *gears, int k)
{
    return gears->spline[k].points > 0;
}

/* Half width of the backlash [rad]; 0 where the law never changes. */
static inline double er_gear_half_width(const er_gears *gears, int k)
{
    return er_gear_switches(gears, k) ? gears->half_width[k] : 0.0;
}

/* A value over the backlash; 0 where the curve does not follow that. */
static inline double er_gear_per_backlash(const er_gears *gears, int k, double value)
{
    return er_gear_switches(gears, k) ? value / gears->backlash[k] : 0.0;
}

/* Boundaries are passed only this far beyond +-half_width [rad], so that rounding does not undo it. */
double er_gear_slack(const er_gears *gears, const er_settings *settings, int k, double tolerance);

/* Below and above which x leaves a region [rad], infinite where it does not: outside the backlash only the side
 * towards it is a boundary. */
void er_gear_edges(const er_gears *gears, const er_settings *settings, int k, int region, double tolerance,
                   double edge[2]);

/* Angles at which the slope or the curvature of a law jumps, rising [rad]; between two of them lies a
 * piece, number p between angle p - 1 and angle p. */
typedef struct {
    int count;
    double angle[ER_MAX_KNOTS];
} er_bends;

void er_bends_find(const er_gears *gears, int k, er_bends *bends);

/* The piece that x lies on, if it lay on `piece` before: a bend is passed `slack` [rad] behind it only, so
 * that rounding does not undo it. */
int er_bends_piece(const er_bends *bends, int piece, double x, double slack);

/* How far x is from where it would leave a piece downwards and upwards [rad]; 1 where it cannot. */
void er_bends_distance(const er_bends *bends, int piece, double x, double slack, double distance[2]);

/* How that changes with x and as the backlash gets `wider` by a part; bends lie at parts of it but for those of
 * a table. */
void er_bends_distance_along(const er_bends *bends, int piece, double x_change, double wider, double slack,
                             double distance[2]);

/* The parts of a gear beside its curve (gear_parts.c).
 *
 * Hysteresis of gears and friction of motors: stop elements, springs that slip (Maxwell slip).
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
