/* Impulses of a torque that is known at even times: a cubic spline through its samples, whose outermost two pieces are
 * one cubic each at both ends, integrated. */
#ifndef ER_IMPULSE_H
#define ER_IMPULSE_H

#include <stdint.h>

#include "export.h"

/* `count` samples, at least four, `spacing` apart from time 0 on [s], and room for as many numbers. */
typedef struct {
    int64_t count;
    double spacing;
    const double *torque;
    double *work;
} er_sampled_torque;

/* Impulses [N m s] over `steps` steps of a length from time 0 on [s]; behind its last sample the torque stays. */
ER_EXPORT void er_impulses(const er_sampled_torque *sampled, int64_t steps, double length, double *impulse);

#endif
