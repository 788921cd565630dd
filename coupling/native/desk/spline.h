/* Splines on evenly spaced knots, of several quantities at once. */
#ifndef ER_SPLINE_H
#define ER_SPLINE_H

#include <stdint.h>

#include "export.h"

#define ER_MOST_DEGREE 5

typedef struct {
    int64_t degree, intervals, quantities;
    double start, spacing; /* [s] */
    const double *coefficients; /* (intervals + degree, quantities) */
} er_spline;

/* Values, or derivatives, at times [s], (count, quantities).  `powers`: weights of an interval's coefficients in the
 * powers of the part of it that lies before, from 0 on, (terms, degree + 1). */
ER_EXPORT void er_spline_at(const er_spline *spline, int64_t terms, const double *powers, int64_t count,
                            const double *times, double *values);

#endif
