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

#include "commands.h"

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
