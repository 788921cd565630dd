/* Motion of the drives that follow commands given at the starts of steps.  elastic_robot/commands.py is the
 * same in Python and has the formulas. */
#ifndef ER_COMMANDS_H
#define ER_COMMANDS_H

#include "../chain/gauss.h"

/* Powers of the time since a step's start, from 1 on. */
enum { ER_COMMAND_POWERS = 5 };

/* Coefficients of 1 to s^4 of the angle of each drive, s after a step's start. */
typedef double er_command_powers[ER_MAX_JOINTS][ER_COMMAND_POWERS];

/* What a command says of a drive: q, q', q''. */
enum { ER_COMMAND_ORDERS = 3 };

/* What drives are commanded at a step's start. */
typedef struct {
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS]; /* [rad, rad/s, rad/s^2] */
    double jerk[ER_MAX_JOINTS]; /* of q'' over the step [rad/s^3]; NaN: not told */
    double torque[ER_MAX_JOINTS]; /* of motors without a servo [N m], by motor */
} er_command;

/* What the last step leaves to the next one. */
typedef struct {
    double length;                                                  /* [s]; 0: there was none */
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS]; /* of the drives at its end */
    double rate[ER_MAX_JOINTS], acceleration[ER_MAX_JOINTS];        /* commanded at its start */
} er_past;

/* And how they follow q, q' and q'' of their drive's command. */
typedef double er_command_slopes[ER_MAX_JOINTS][ER_COMMAND_ORDERS][ER_COMMAND_POWERS];

/* Whether a step is long enough to be taken [s]. */
bool er_command_counts(const er_robot *robot, double length);

/* The drives over a step of a length [s]. */
void er_command_follow(const er_robot *robot, const er_past *past, const er_command *command,
                       double length, er_command_powers powers);

/* Their derivatives.  At a corner of a limit they are those by one entry of the command alone. */
void er_command_along(const er_robot *robot, const er_past *past, const er_command *command,
                      double length, er_command_slopes slopes);

/* q, q', q'' from coefficients at a time after the start [s]. */
static inline void er_command_at(const double c[ER_COMMAND_POWERS], double s, double *q, double *qd, double *qdd)
{
    *q = c[0] + (c[1] + (c[2] + (c[3] + c[4] * s) * s) * s) * s;
    *qd = c[1] + (2.0 * c[2] + (3.0 * c[3] + 4.0 * c[4] * s) * s) * s;
    *qdd = 2.0 * c[2] + (6.0 * c[3] + 12.0 * c[4] * s) * s;
}

#endif
