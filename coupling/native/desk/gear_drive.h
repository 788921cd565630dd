/* The scalar robot of one gear, by how much its link misses its motion under a command.
 *
 * docs/inverse.md has the equations.  In interval i between two rows of the command there are `parts` steps; the
 * wind-up x = phi - u(q) + delta is known at the quarters of a step, and what acts on the link is integrated over its
 * halves: by Simpson's rule, or where the slope of the torque curve changes by many points of the polynomial through
 * the quarters.
 */
#ifndef ER_GEAR_DRIVE_H
#define ER_GEAR_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "export.h"

#define ER_QUARTERS 5
#define ER_FINE 16      /* points of a half where the slope changes */
#define ER_MOST_COEFFICIENTS 6 /* that act in an interval */

typedef struct {
    int64_t count, parts, degree; /* intervals between rows, steps in one, degree of the command */
    int64_t first;                /* whether the path begins here */
    int64_t pieces;               /* of the torque curve, cubics from their origins; one more than knots */
    int64_t sines;                /* of the kinematic error */
    double step, damping;         /* [s], [N m s/rad] */
    double link_rate;             /* phi' at the first time [rad/s] */
    const double *knots, *origins, *cubics; /* [rad], [rad], (pieces, 4) [N m] */
    const double *amplitude, *order, *phase;
    const double *value;          /* weights of an interval's coefficients at the quarters, (parts, 5, degree + 1) */
    const double *start_row;      /* and of the first rate, (degree + 1) */
    const double *fine;           /* weights of the quarters at the fine points of both halves, (2, 16, 5) */
    const double *link;           /* phi at the quarters [rad], (4 count parts + 1) */
    const double *impulse;        /* of T over the halves [N m s], (2 count parts) */
    const double *inertia, *scale; /* [kg m^2], [rad/(N m s)] of each step, (count parts) */
    /* What elements of a hysteresis do about a motion, (count, parts, ..), or NULL. */
    const double *held_wind_up, *held_impulse, *held_slope; /* 5, 2, (2, 5) */
} er_gear_drive;

/* The drive along the intervals begin to end - 1. */
er_gear_drive er_gear_part(const er_gear_drive *drive, int64_t begin, int64_t end);

/* A step about a motion. */
typedef struct {
    double impulse[2];              /* of d x' + S(x) - T over its halves [N m s] */
    double by_wind_up[2][ER_QUARTERS]; /* its derivatives by x at the quarters */
    double rise[ER_QUARTERS];       /* du/dq there */
} er_gear_step;

/* Step j of interval i. */
void er_gear_step_at(const er_gear_drive *drive, const double *coefficients, const double *misses, int64_t i, int64_t j,
                     er_gear_step *step);

/* By how much the equation of the node at the start of a step is missed [rad], from that step and the one before. */
double er_gear_defect(const er_gear_drive *drive, const double *coefficients, const double *misses, int64_t node,
                      const er_gear_step *before, const er_gear_step *now);

/* Derivatives of that: by coefficients i - 1 to i + degree, and by the misses of the node before, at it and behind. */
typedef struct {
    double by_coefficient[ER_MOST_COEFFICIENTS + 1], by_miss[3];
} er_gear_row;

void er_gear_find_row(const er_gear_drive *drive, const double *coefficients, int64_t i, int64_t j,
                      const er_gear_step *before, const er_gear_step *now, er_gear_row *row);

/* x at the quarters [rad], (count, parts, 5). */
ER_EXPORT void er_gear_wind_ups(const er_gear_drive *drive, const double *coefficients, const double *misses,
                                double *wind_up);

/* Defects of all nodes but the last [rad], (count, parts); and their rows, (count, parts, degree + 2 + 3). */
ER_EXPORT void er_gear_defects(const er_gear_drive *drive, const double *coefficients, const double *misses,
                               double *defects);
ER_EXPORT void er_gear_rows(const er_gear_drive *drive, const double *coefficients, const double *misses, double *rows);

#endif
