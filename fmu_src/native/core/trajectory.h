/* Joint motion of the drives: q, q', q'' over time, from samples or from commands.
 *
 * With rates and accelerations the motion is the quintic Hermite spline of the samples, else the C2
 * cubic spline through them with zero rate at both ends; elastic_robot/trajectory.py is the same.  A
 * cubic spline is kept as the quintic one that takes its rates and accelerations.
 */
#ifndef ER_TRAJECTORY_H
#define ER_TRAJECTORY_H

#include <stddef.h>
#include <stdint.h>

#include "kernel.h"

/* Motion of the drives that follow commands given at the starts of steps.  elastic_robot/commands.py is the
 * same in Python and has the formulas.
 */

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
static inline void er_command_at(const double c[ER_COMMAND_POWERS], double s, double *q, double *qd,
                                 double *qdd)
{
    *q = c[0] + (c[1] + (c[2] + (c[3] + c[4] * s) * s) * s) * s;
    *qd = c[1] + (2.0 * c[2] + (3.0 * c[3] + 4.0 * c[4] * s) * s) * s;
    *qdd = 2.0 * c[2] + (6.0 * c[3] + 12.0 * c[4] * s) * s;
}

/* Samples with rates and accelerations; between two of them is the quintic that takes all six. */
typedef struct {
    int joints;
    size_t samples;
    double start; /* time of the first sample [s] */
    double *time; /* since then, rising [s] */
    double *row;  /* its own time, q1.., qd1.., qdd1..: [sample][1 + 3 joints] */
    double *jump; /* largest jump of a third derivative at each sample [rad/s^3]; 0 at the ends */
    uint64_t fingerprint; /* hash of the samples that it was built from */
} er_trajectory;

/* Numbers of a row. */
static inline size_t er_trajectory_width(const er_trajectory *t)
{
    return 1 + 3 * (size_t)t->joints;
}

/* Reads CSV with a header line, or NPZ with arrays `columns` and `data`. */
bool er_trajectory_read(er_trajectory *trajectory, const char *path, int joints,
                        const er_settings *settings, er_failure *failure);

/* The same of a file's content, with a zero byte behind it.  `is_npz`: its name ends in .npz. */
bool er_trajectory_parse(er_trajectory *trajectory, const char *content, size_t size, bool is_npz,
                         int joints, const er_settings *settings, er_failure *failure);

void er_trajectory_free(er_trajectory *trajectory);

/* How the drives move: along a trajectory, or over a step as they are commanded at its start. */
typedef struct {
    const er_trajectory *trajectory; /* NULL: commanded */
    size_t *hint;                    /* where the last time was found */
    double start;                    /* of the step, or the trajectory [s] */
    er_command_powers powers;
    int joints;
} er_drives;

/* Refuses times outside the samples by more than a slack [s]. */
bool er_drives_cover(const er_drives *drives, double time, double slack, er_failure *failure);

/* q, q', q'' of each drive at a time [rad, rad/s, rad/s^2]; times beyond the ends are the ends. */
void er_drives_at(const er_drives *drives, double time, double *q, double *qd, double *qdd);

/* How a trajectory's q, q', q'' change with time: q', q'', q''', the last of what follows a sample; zero
 * beyond the ends, and without a trajectory. */
void er_drives_by_time(const er_drives *drives, double time, double *q, double *qd, double *qdd);

/* The first time after `time` at which a third derivative jumps by more than `jump` [rad/s^3], or
 * `end` if there is none before. */
double er_drives_next_kink(const er_drives *drives, double time, double end, double jump);

#endif
