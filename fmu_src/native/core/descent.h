/* One step downhill in search of the least energy of flanks, weight, contact spring and contact. */
#ifndef ER_DESCENT_H
#define ER_DESCENT_H

#include <math.h>

#include "chain.h"
#include "gear.h"
#include "load.h"

/* An equilibrium in the making; one entry per elastic coordinate. */
typedef struct {
    const er_robot *robot;
    const er_gears *gears;
    const double *gravity, *q;
    const er_load *load;
    int m;
    double negligible;                              /* residual [N m] */
    bool neutral[ER_MAX_ANGLES];                    /* hardly held: in the middle of its play */
    double x[ER_MAX_ANGLES];                        /* [rad] */
    double torque[ER_MAX_ANGLES];                   /* that must be carried [N m] */
    double residual[ER_MAX_ANGLES];                 /* that minus the curve's [N m] */
    double gradient[ER_MAX_ANGLES * ER_MAX_ANGLES]; /* of the torque [N m/rad] */
    er_placement placement;
} er_descent;

static inline int er_descent_region(const er_descent *s, int k)
{
    return er_gear_region(s->gears, k, s->x[k]);
}

/* Largest absolute value; NaN where there is one. */
static inline double er_largest(int count, const double *values)
{
    double largest = 0.0;
    for (int k = 0; k < count; k++)
        largest = fabs(values[k]) <= largest ? largest : fabs(values[k]);
    return largest;
}

/* Torque and residual at x. */
void er_descent_place(er_descent *s, const double *x);

/* Gradient of the torque there. */
void er_descent_gradient(er_descent *s);

/* Newton's step towards less energy [rad]; false if the energy has no floor. */
bool er_descent_step(er_descent *s, double *step);

/* The part of a step that leads to the valley's floor; the residual there is left. */
double er_descent_part(er_descent *s, const double *step);

#endif
