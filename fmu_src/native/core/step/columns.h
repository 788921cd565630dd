/* The columns of sensitivities: what each follows, cause by cause, and the motors in it. */
#ifndef ER_COLUMNS_H
#define ER_COLUMNS_H

#include "run.h"

/* What a motion follows: the wrench, q, q' and q'' of the held command, the anchor's position and velocity, the
 * stiffness of its spring, the rate of the wrench, the contact and its normal; gravity, and stiffness, damping,
 * backlash and hysteresis of each entry of x; friction and torque of each motor, which move nothing under ideal
 * drives; and a shift of the state that is none of these. */
typedef enum {
    ER_BY_WRENCH,
    ER_BY_Q,
    ER_BY_QD,
    ER_BY_QDD,
    ER_BY_ANCHOR,
    ER_BY_ANCHOR_VELOCITY,
    ER_BY_SPRING,
    ER_BY_RATE,
    ER_BY_CONTACT,
    ER_BY_NORMAL,
    ER_BY_GRAVITY,
    ER_BY_STIFFNESS,
    ER_BY_DAMPING,
    ER_BY_BACKLASH,
    ER_BY_HYSTERESIS,
    ER_BY_FRICTION,
    ER_BY_TORQUE,
    ER_BY_START,
    ER_CAUSES
} er_cause;

enum { ER_CONTACT_ENTRIES = 8 }; /* normal included */
enum {
    ER_MAX_DIRECTIONS = 2 * 6 + 3 * ER_MAX_JOINTS + 2 * 3 + ER_SYMMETRIC + ER_CONTACT_ENTRIES + 3 +
    4 * ER_MAX_ANGLES + 2 * ER_MAX_JOINTS + 1
};

/* The first column of a cause; of ER_CAUSES the number of columns. */
int er_first_column(const er_robot *robot, er_cause cause);

/* The cause that a column belongs to, and its entry of that. */
er_cause er_cause_of(const er_robot *robot, int column, int *entry);

/* The entry of a contact by its place among its causes. */
double *er_contact_entry(er_contact *contact, int place);

/* A unit change of a column's parameter, times a factor, is added; nothing of other columns. */
void er_parameter_along(const er_robot *robot, int column, double factor, er_parameters *change);

/* Columns `first` to `first + count - 1`; of each, the derivatives of x, x' and the elements' elongations. */
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
    double elongation[ER_MAX_DIRECTIONS][ER_MAX_ELEMENTS];
    er_drive_kind drive; /* under a torque commands of angles do not count */
    er_motor_change motors[ER_MAX_DIRECTIONS];
    /* Of the present step. */
    er_links links;
    double response; /* of the accelerations to torques of 1 N m [rad/s^2]; 0: not asked for yet */
    ER_ALIGNED er_lanes slope[ER_MAX_ANGLES]; /* of curve and elements at the stages [N m/rad] */
    double stuck[ER_MAX_ANGLES];              /* of the elements alone */
    double balance[ER_MAX_JOINTS][ER_STAGES]; /* slopes of the balancers at the stages [N m/rad] */
    er_transmission transmission[ER_MAX_JOINTS][ER_STAGES]; /* of drives that follow their commands */
} er_sensitivity;

/* Of a column in a step: where y and p start, p at the stages, the gears' torques [N m] without loads. */
typedef struct {
    double x[ER_MAX_ANGLES], v[ER_MAX_ANGLES], p[ER_MAX_JOINTS], pv[ER_MAX_JOINTS];
    ER_ALIGNED er_lanes stage_p[ER_MAX_JOINTS], stage_pv[ER_MAX_JOINTS], acceleration[ER_MAX_JOINTS];
    er_lanes gear[ER_MAX_JOINTS];
} er_motor_column;

/* An input's share in the motion of its drive and in the load, a time after they began. */
typedef struct {
    int joint; /* -1: the input is part of the load */
    double q, qd, qdd;
    er_load load; /* its anchor is where it is then */
} er_share;

er_share er_share_of(const er_sensitivity *sensitivity, const er_robot *robot, int column, double elapsed);

/* How the command of a motor's drive follows a column: q, q' and q''. */
typedef struct {
    double q, qd, qdd;
} er_drive_change;

er_drive_change er_column_command(const er_sensitivity *sensitivity, const er_run *r, int motor, int column,
                                  double time);

/* Where a column starts in a step from a state. */
void er_motor_column_begin(const er_sensitivity *sensitivity, const er_run *r, const er_state *state, int column,
                           er_motor_column *column_motors);

/* Takes the motors off what a column's gears carry, and keeps that. */
void er_motor_column_gears(const er_sensitivity *sensitivity, const er_run *r, const er_state *state, double h,
                           int column, er_motor_column *column_motors, er_lanes *load);

/* Residuals of the motors along a column, into w->motors.residual; `gear` is what it changes in the gears beside. */
void er_motor_column_residual(const er_sensitivity *sensitivity, const er_run *r, const er_state *state, double h,
                              int column, const er_motor_column *column_motors, const er_lanes *gear);

/* Takes a column's motors to the step's end, and x and x' of the chain to wind-ups. */
void er_motor_column_end(er_sensitivity *sensitivity, const er_run *r, const er_state *state, const er_step *step,
                         int column, const er_motor_column *column_motors);

#endif
