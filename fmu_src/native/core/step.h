/* Time stepper of the robot under prescribed drives and a held wrench.
 *
 * Four-stage Gauss collocation in the accelerations, simplified Newton iteration, step length from an
 * estimate of the local error.  Each coordinate obeys one smooth law (its region) through a whole
 * step; where the collocation polynomial leaves a region, and where the drives' third derivative
 * jumps, the step is ended.  elastic_robot/motion.py solves the same equation by SciPy.
 */
#ifndef ER_STEP_H
#define ER_STEP_H

#include <stdbool.h>
#include <stddef.h>

#include "chain.h"
#include "load.h"
#include "kernel.h"
#include "trajectory.h"
#include "gear.h"
#include "motors.h"

/* What the matrices of Newton's method are made of, besides the robot and its damping.  The state keeps
 * it, so that a restored state continues with the same matrices without saving them. */
typedef struct {
    bool has_mass;                                /* q and x are there */
    double q[ER_MAX_JOINTS], x[ER_MAX_ANGLES];    /* posture of the mass matrix [rad] */
    double length;                                /* of the step [s]; 0: there are no matrices */
    double slope[ER_MAX_ANGLES];                  /* of the torque curves [N m/rad] */
    double anchor[ER_SYMMETRIC];                  /* stiffness of the contact spring [N/m] */
    double contact[ER_SYMMETRIC], damper[ER_SYMMETRIC]; /* of a contact, and its damping [N s/m] */
    double offset[3];                             /* to where that acts [m] */
} er_linearisation;

/* State of an integration, all of it: a copy of its bytes continues identically. */
typedef struct {
    double time;                         /* [s] */
    double x[ER_MAX_ANGLES];             /* elastic coordinates [rad] */
    double v[ER_MAX_ANGLES];             /* their rates [rad/s] */
    double step;                         /* length proposed for the next step [s] */
    double predictor_step;               /* length of the last step [s]; 0: there was none */
    double rate;                         /* at which Newton's method converged lately; 1: not known */
    int region[ER_MAX_ANGLES];           /* branch of each coordinate's law: -1, 0, 1 */
    int touching;                        /* whether the contact presses: 0, 1; -1: not known yet */
    er_linearisation linearisation;      /* of the last step's matrices */
    er_lanes predictor[ER_MAX_ANGLES];   /* stage accelerations of the last step [rad/s^2]; few robots have all, */
    er_stops stops;                      /* or any hysteresis or friction: copies end there (er_state_size) */
    er_motors motors;
} er_state;

/* What is integrated: M theta'' + h - J^T w - J_p^T K (a - p) - J_c^T F + S(x) + H + d x' = 0,
 * H the torque of the elements of hysteresis. */
typedef struct {
    const er_robot *robot;
    const er_gears *gears;
    const er_parameters *parameters;
    const er_drives *drives;
    er_load load;  /* its anchor is that of `start` */
    double start;  /* [s] */
    bool loaded;   /* the wrench is not zero */
    bool anchored; /* the stiffness of the contact spring is not zero */
    bool changing; /* the rate of the wrench is not zero */
    bool contacting; /* there is a contact that may press */
    er_drive_kind drive; /* ideal: the motors do not move by themselves */
    const double *torque; /* that motors without servo exert [N m] */
} er_system;

/* How accurate it shall be, and with which arithmetic. */
typedef struct {
    double tolerance; /* limit of the local error estimate [rad] */
    double iteration; /* part of the tolerance that Newton's method may leave */
    double jump;      /* jump of a drive's third derivative that may be stepped over [rad/s^3] */
    er_kernel kernel;
} er_means;

/* A solved step. */
typedef struct {
    double length;                                           /* [s] */
    ER_ALIGNED er_lanes acceleration[ER_MAX_ANGLES];         /* of the stages [rad/s^2] */
    double x[ER_MAX_ANGLES], v[ER_MAX_ANGLES];               /* at its end */
    double a[ER_MAX_ANGLES];                                 /* of the polynomial, at its end */
    ER_ALIGNED er_lanes motor_acceleration[ER_MAX_JOINTS];   /* p'' of the stages [rad/s^2] */
    er_motor_end motors;
    double error;                                            /* estimate of the local error [rad] */
    int passes;                                              /* of Newton's method */
    double rate;                                             /* at which it converges */
    double depth[ER_CONTROL];  /* of a contact at its start, its stages and its end [m] */
} er_step;

/* Memory of a stepper; all but the matrices, which follow from their linearisation, and what is carried
 * along is of one call. */
typedef struct {
    er_nodes stages, end, start; /* the last for a contact alone */
    er_reference reference; /* the drives at the step's end */
    ER_ALIGNED er_lanes x[ER_MAX_ANGLES], v[ER_MAX_ANGLES], residual[ER_MAX_ANGLES];
    ER_ALIGNED er_vector gap; /* from the TCP to the anchor [m] */
    ER_ALIGNED er_pull pull;
    er_contact_motion contact[ER_LANES];
    er_motor_work motors;
    er_motion motion;
    er_placement placement;
    er_linearisation linearisation; /* of the matrices that follow */
    double mass[ER_MAX_ANGLES * ER_MAX_ANGLES];
    double lever[ER_MAX_ANGLES][3]; /* of the TCP about each entry of x, in the posture of the mass [m] */
    double axis[ER_MAX_ANGLES][3];  /* of each entry of x there */
    ER_ALIGNED er_complex_pair matrix[ER_MAX_ANGLES * ER_MAX_ANGLES];
    ER_ALIGNED er_factor inverse[ER_MAX_ANGLES * ER_MAX_ANGLES];
    er_step solved, landed;
    double tries; /* of a step that are left before the integration is given up */
    double price; /* of one, in tries */
    long made;    /* tries since the integration began */
    double shortest; /* step before the integration is given up [s] */
    struct er_sensitivity *sensitivity; /* carried along with the steps; NULL: none */
} er_workspace;

/* What changes its law: a coordinate in its backlash, an element of hysteresis that slips or, as its coordinate
 * reverses, sticks again, a contact, a servo whose torque reaches or leaves its limit, whose w turns, or which
 * keeps it there no longer. */
typedef enum { ER_AT_EDGE,
               ER_AT_SLIP,
               ER_AT_REVERSAL,
               ER_AT_CONTACT,
               ER_AT_LIMIT,
               ER_AT_TURN,
               ER_AT_RELEASE } er_change_of_law;

/* Where a step's polynomial first leaves what obeys one smooth law. */
typedef struct {
    er_change_of_law at;
    int coordinate;  /* of x; none of a contact */
    int element;     /* that slips */
    double boundary; /* that is passed by x [rad], at a reversal by x' [rad/s], of a contact by its depth [m], of
                      * a servo by what it asks for [N m], w [rad/s] or what that would grow by [N m/s] */
    int outward;     /* 1: rises through the boundary, -1: falls */
    int region;      /* of the backlash, beyond; whether the contact presses there */
    er_servo_law law; /* beyond, where w turns or a servo is released */
    double fraction; /* place in the step, in (0, 1] */
} er_crossing;

/* A contact begins this far behind the plane [m], so that rounding does not undo it, and ends at it: what
 * presses never pulls. */
#define ER_CONTACT_SLACK 1e-11

/* The earlier of a crossing, if one was `found`, and that of a contact's depth at the start, the nodes and
 * the end of a step. */
bool er_earlier_contact(bool touching, const double depth[ER_CONTROL], bool found, er_crossing *first);

/* The parts of an integration that its functions share. */
typedef struct {
    const er_system *system;
    const er_settings *settings;
    const er_means *means;
    er_workspace *work;
    int m;
    int motors; /* that move by themselves */
} er_run;

/* The first crossing of a coordinate in a solved step, if any. */
bool er_first_crossing(const er_run *r, const er_state *state, const er_step *step, er_crossing *first);

/* The collocation equations of one step, solved by simplified Newton iteration. */

/* Solves the collocation equations of a step from the accelerations in it; false if that fails.
 * `accuracy` is the error that the iteration may leave in x [rad]. */
bool er_solve_step(const er_run *r, const er_state *state, double h, double accuracy, er_step *step);

/* Depth of the contact at a state [m]. */
double er_contact_depth(const er_run *r, const er_state *state);

/* Rate of its depth at the end of the step solved last [m/s]; its motion there is in w->contact then. */
double er_end_approach(const er_run *r, const er_step *step);

/* What is at the nodes of a step (stage.c).
 *
 * Drives at its stages and its end, and the sines that their changes are counted from. */
void er_drive_step(const er_run *r, double time, double h);

/* The chain's motion at the nodes of a step, into w->motion, from w->x, w->v and the accelerations. */
void er_stage_motion(const er_run *r, const er_nodes *nodes, const er_lanes *acceleration);

/* From the TCP to the anchor at this motion, into w->gap. */
void er_stage_gap(const er_run *r, const er_nodes *nodes, int states);

/* How the sphere of a contact moves there, into w->contact, from w->x and w->v. */
void er_stage_contact(const er_run *r, const er_nodes *nodes, int states);

/* The spring's force across this gap, that of a contact that is touched and what the wrench has gained,
 * w->pull; NULL without all three. */
const er_lanes *er_stage_pull(const er_run *r, const er_nodes *nodes, int states, bool touching);

/* The motors in a step (motor_step.c), where there are any that move by themselves.
 *
 * What the chain starts from: x and x' of the state, under motors that move counted from the commands. */
typedef struct {
    const double *x, *v;
} er_start;

er_start er_chain_start(const er_run *r, const er_state *state);

/* Depths of the contact along a solved step that starts from there. */
void er_find_depths(const er_run *r, const er_state *state, const er_start *from, er_step *step);

/* Counts the end of a step from the motors. */
void er_motors_wind_up(const er_run *r, er_step *step);

/* p, p', w and z at the end of a step, from its accelerations. */
void er_motors_end(const er_run *r, const er_state *state, er_step *step);

/* Servos: has those that have a torque limit obey the law of where they stand, which inputs may have moved; whether one
 * obeys another than before. */
bool er_servos_settle(const er_run *r, er_state *state);

/* Has the servo of a crossing obey what is beyond it, in the state there. */
void er_servo_cross(const er_run *r, er_state *state, const er_crossing *crossing);

/* z' under a law [N m/s]. */
double er_servo_growth(const er_motor *motor, er_servo_law law, double wanted, double turning);

/* How far beyond its torque limit a servo obeys another law [N m], and by what w it turns [rad/s]: the motor goes as
 * far by it within a longest step, or a first one, as a coordinate may beyond its boundary. */
double er_servo_slack(const er_run *r, int d);
double er_servo_rate_slack(const er_run *r);

/* Torque by which a gear holds its link at a wind-up and its rate in a step from a state [N m]. */
double er_wind_up_torque(const er_run *r, const er_state *state, int k, double x, double v);

/* Takes the motors out of Newton's matrix, with the slopes that they had when it was linearised: that of each gear
 * becomes less. */
void er_motors_linearise(const er_run *r, const er_state *state);
void er_motors_eliminate(const er_run *r, er_complex_pair *matrix);

/* Adds the motors' defects at the step's end to those of their gears; returns the largest of their own errors, as an
 * acceleration. */
double er_motors_defect(const er_run *r, double *defect);

/* Steps (laws.c).
 *
 * Stage accelerations to start from: the last step's polynomial, continued, or those of a part of a step that was tried. */
void er_guess(const er_run *r, const er_state *state, double h, er_step *step);
void er_guess_part(const er_run *r, double ratio, const er_step *tried, er_step *step);

/* Solves a step as one of the tries that are left. */
bool er_try_step(const er_run *r, const er_state *state, double h, double accuracy, er_step *step);

/* Shortens a solved step until it ends on the boundary that it crosses, in w->landed. */
bool er_land(const er_run *r, const er_state *state, const er_step *step, const er_crossing *crossing);

/* Laws (laws.c).
 *
 * Has the state at the end of a step obey what is beyond its crossing. */
void er_take_crossing(const er_run *r, er_state *state, const er_step *step, const er_crossing *crossing);

/* A step that lands on what another coordinate crosses may end just behind a motor's reversal, which no later step
 * has in it. */
void er_stick_reversed(const er_run *r, er_state *state);

/* Whether the contact presses, and the laws of servos at their torque limits: inputs may have moved plane and commands
 * since. */
void er_obey_inputs(const er_run *r, er_state *state);

/* The matrices of Newton's method for a step's stages. */

/* Has the inverses of M + l h D + (l h)^2 K for the eigenvalues l of A1 in the workspace, for a step of
 * length h from a state.  The mass matrix of an earlier posture nearby is kept.  False if they are not
 * finite. */
bool er_linearise(const er_run *r, const er_state *state, double h);

/* Has the matrices of a state's linearisation in the workspace, which may hold them already. */
void er_linearise_as(const er_run *r, const er_state *state);

/* Lets the next step have matrices of its own. */
void er_relinearise(er_workspace *work);

/* Bytes of a state that a robot makes use of, and a copy of them. */
size_t er_state_size(const er_robot *robot);
void er_state_copy(const er_robot *robot, er_state *to, const er_state *from);

/* Begins an integration at the x and v that are in the state, and its elements of hysteresis. */
void er_state_start(er_state *state, const er_robot *robot, const er_gears *gears, double time);

/* Integrates to a time.  If that fails, the state is somewhere in between. */
bool er_advance(er_state *state, const er_system *system, const er_means *means, double end,
                er_workspace *work, er_failure *failure);

#endif
