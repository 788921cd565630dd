/* How x and x' follow the inputs of a communication step: forward sensitivities, carried from step
 * to step of the integration, whose lengths are held.
 *
 * An input is named by its column, which is its value reference: the wrench, q, q' and q'' of the held
 * command, the anchor's position and velocity and the stiffness of its spring, the rate of the wrench, the
 * contact; behind them gravity, and stiffness, damping and backlash of each entry of x, by which
 * elastic_robot/path_sensitivity.py does the same.
 */
#ifndef ER_SENSITIVITY_H
#define ER_SENSITIVITY_H

#include "collocation.h"

enum { ER_WRENCH_COLUMNS = 6, ER_ANCHOR_COLUMNS = 6, ER_CONTACT_COLUMNS = 8 };
enum {
    ER_MAX_DIRECTIONS =
        2 * ER_WRENCH_COLUMNS + 3 * ER_MAX_JOINTS + ER_ANCHOR_COLUMNS + ER_SYMMETRIC +
        ER_CONTACT_COLUMNS + 3 +
        3 * ER_MAX_ANGLES
};

/* The first of the anchor's columns, of the stiffness of its spring, of the rate of the wrench and of the
 * contact: stiffness, dissipation, radius, friction, slip speed and normal. */
static inline int er_anchor_column(const er_robot *robot)
{
    return ER_WRENCH_COLUMNS + 3 * robot->joints;
}

static inline int er_stiffness_column(const er_robot *robot)
{
    return er_anchor_column(robot) + ER_ANCHOR_COLUMNS;
}

static inline int er_rate_column(const er_robot *robot)
{
    return er_stiffness_column(robot) + ER_SYMMETRIC;
}

static inline int er_contact_column(const er_robot *robot)
{
    return er_rate_column(robot) + ER_WRENCH_COLUMNS;
}

/* The first of gravity, stiffness, damping and backlash. */
static inline int er_gravity_column(const er_robot *robot)
{
    return er_contact_column(robot) + ER_CONTACT_COLUMNS;
}

static inline int er_elastic_column(const er_robot *robot, int which)
{
    return er_gravity_column(robot) + 3 + which * robot->elastics;
}

/* The entry of a contact by its place among these columns. */
double *er_contact_entry(er_contact *contact, int place);

/* A unit change of a column's parameter, times a factor, is added; nothing of other columns. */
void er_parameter_along(const er_robot *robot, int column, double factor, er_parameters *change);

/* Columns `first` to `first + count - 1`; of each, the derivatives of x and x'. */
typedef struct er_sensitivity {
    int first, count;
    double start;       /* of the command [s] */
    bool still;         /* x and x' do not depend on the inputs yet */
    er_command_slopes commanded; /* how the drives follow the command; for its columns only */
    bool touching;      /* the contact presses in the step that is followed */
    const char *reason; /* why there are none; NULL: all is well */
    double accuracy;    /* part of a column's stage accelerations that its solution may leave */
    int passes;         /* most that a column took */
    double x[ER_MAX_DIRECTIONS][ER_MAX_ANGLES], v[ER_MAX_DIRECTIONS][ER_MAX_ANGLES];
    /* Of the present step. */
    er_links links;
    double response; /* of the accelerations to torques of 1 N m [rad/s^2]; 0: not asked for yet */
    ER_ALIGNED er_lanes slope[ER_MAX_ANGLES]; /* of the torque curve at the stages [N m/rad] */
} er_sensitivity;

/* An input's share in the motion of its drive and in the load, a time after they began. */
typedef struct {
    int joint; /* -1: the input is part of the load */
    double q, qd, qdd;
    er_load load; /* its anchor is where it is then */
} er_share;

er_share er_share_of(const er_sensitivity *sensitivity, const er_robot *robot, int column,
                     double elapsed);

/* Begins with x and x' that do not depend on the inputs. */
void er_sensitivity_start(er_sensitivity *sensitivity, int first, int count, double start);

/* Carries the columns over a step that was just solved from `state`; the workspace is as it left it. */
void er_sensitivity_follow(er_sensitivity *sensitivity, const er_run *r, const er_state *state,
                           const er_step *step);

/* Corrects the columns where a coordinate has changed its law at the end of a step. */
void er_sensitivity_cross(er_sensitivity *sensitivity, const er_run *r, const er_state *state,
                          const er_step *step, const er_crossing *crossing);

#endif
