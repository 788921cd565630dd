/* What an integration is made of: its equation, its state, a step of it, its memory.
 *
 * Each coordinate obeys one smooth law (its region) through a whole step. */
#ifndef ER_RUN_H
#define ER_RUN_H

#include <stdbool.h>
#include <stddef.h>
#include "../load/load.h"
#include "../load/contact_motion.h"
#include "kernel.h"
#include "../load/trajectory.h"
#include "../elements/gear.h"
#include "../elements/motors.h"

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
    long crossings; /* of backlashes and contacts, since then */
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
               ER_AT_RELEASE,
               ER_EVENTS } er_change_of_law;

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

/* The parts of an integration that its functions share. */
typedef struct {
    const er_system *system;
    const er_settings *settings;
    const er_means *means;
    er_workspace *work;
    int m;
    int motors; /* that move by themselves */
} er_run;

/* Wind-ups at the present nodes and their rates: x and x' of the chain, where motors move counted from them. */
static inline const er_lanes *er_wind_up(const er_run *r)
{
    return (const er_lanes *)(r->motors > 0 ? r->work->motors.wind_up : r->work->x);
}

static inline const er_lanes *er_wind_up_rate(const er_run *r)
{
    return (const er_lanes *)(r->motors > 0 ? r->work->motors.wind_up_rate : r->work->v);
}

/* What the chain starts from: x and x' of the state, under motors that move counted from the commands. */
typedef struct {
    const double *x, *v;
} er_start;

#endif
