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
    double idle, held;            /* added to the diagonal for coefficients, and for unknowns that are not free */
    const double *bend;           /* phi'' where coefficients of the acceleration stand [rad/s^2], (count + degree - 2) */
    const unsigned char *free;    /* of all unknowns in their order */
    int64_t conditions;           /* weights @ coefficients from a first one on = value */
    const int64_t *condition_first;
    const double *condition_weights, *condition_value; /* (conditions, degree + 1), [rad] */
} er_drive_fit;

/* Half the sum of squares [rad^2]. */
ER_EXPORT double er_drive_fit_value(const er_drive_fit *fit, const double *coefficients, const double *misses);

/* Numbers that a step works with. */
ER_EXPORT int64_t er_drive_fit_room(const er_drive_fit *fit);

/* Fills in the step of all unknowns [rad], (groups (parts + 1)), that solves the linearised least squares, changes of
 * the command's bends weighted by `damping`; false if the matrix is not positive definite.  `work` is overwritten. */
ER_EXPORT bool er_drive_fit_step(const er_drive_fit *fit, const double *coefficients, const double *misses,
                                 double damping, double *work, double *step);

#endif
