/* Least squares over a command's coefficients and the misses of its link: values and steps.
 *
 * Half the sum of squares of the misses, of what the command's acceleration has beyond that of its link, and, heavy,
 * of the drive's equations and the conditions at the ends.  The unknowns stand in groups: group g has coefficient
 * g - 1 and `parts` misses near its middle, so that those of an interval stand in degree + 2 groups and the matrix is
 * a band.
 */
#ifndef ER_DRIVE_FIT_H
#define ER_DRIVE_FIT_H

#include "gear_drive.h"
#include "link_kernel.h"

typedef struct {
    er_gear_drive drive;
    double cycle, smoothing;      /* [s]; [s^2], weight of the acceleration */
    double heavy, counted;        /* weights of equations in a step, and in the value */
    double idle;                  /* added to the diagonal for coefficients */
    const double *bend;           /* phi'' where coefficients of the acceleration stand [rad/s^2], (count + degree - 2) */
    int64_t conditions;           /* weights @ coefficients from a first one on = value */
    const int64_t *condition_first;
    const double *condition_weights, *condition_value; /* (conditions, degree + 1), [rad] */
} er_drive_fit;

/* Intervals begin to end - 1 of the rows; what meets others does not change. */
typedef struct {
    int64_t begin, end;
} er_stretch;

/* Half the sum of squares of what is in stretches [rad^2]. */
ER_EXPORT double er_drive_fit_value(const er_drive_fit *fit, int64_t count, const er_stretch *stretches,
                                    const double *coefficients, const double *misses);

typedef enum { ER_SOLVED, ER_NOT_POSITIVE, ER_NO_MEMORY } er_solved;

/* Fills in the step of all unknowns [rad], (groups (parts + 1)), that solves the linearised least squares in stretches,
 * zero outside, with changes of the command's bends weighted by `damping`.  Changes die out within `lag` intervals, or
 * twice as many if that is not so. */
ER_EXPORT er_solved er_drive_fit_step(const er_drive_fit *fit, int64_t count, const er_stretch *stretches,
                                      const double *coefficients, const double *misses, double damping, int64_t lag,
                                      double *step);

#endif
