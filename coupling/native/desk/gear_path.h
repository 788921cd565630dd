/* One gear along its whole path: from piece to piece of its law, a polyline, in closed form.
 *
 * docs/inverse.md has the equation.  With the torque T straight between samples and S a line of slope k,
 * l = k / d and v = e',
 *
 *     e = e_0 + v_0 psi_1 + T' psi_2 / d,   psi_1 = (1 - exp(-l t)) / l,   psi_2 = (t - psi_1) / l.
 */
#ifndef ER_GEAR_PATH_H
#define ER_GEAR_PATH_H

#include <stdbool.h>
#include <stdint.h>

#include "export.h"

/* A polyline: rising angles of its corners [rad], torque there [N m], slope of each piece, one more [N m/rad]. */
typedef struct {
    int64_t corners; /* at least one */
    const double *angle, *torque, *slope;
} er_gear_law;

/* Elements of a hysteresis. */
typedef struct {
    int64_t count;
    const double *slip_torque, *slip_angle; /* [N m], [rad] */
} er_gear_elements;

/* The law of a spring beside elements from a wind-up on, where these have elongations [rad], until one that slips
 * turns back.  Fills in its corners, at most spring->corners + 2 elements->count, and returns their number. */
ER_EXPORT int64_t er_gear_law_with_elements(const er_gear_law *spring, const er_gear_elements *elements, double start,
                                            const double *elongation, double *angle, double *torque, double *slope);

/* Wind-up [rad] and its rate [rad/s] at `count` samples, at least one, of the torque, `spacing` apart; the elements came
 * to the start from unloaded.  False if it does not fit into memory. */
ER_EXPORT bool er_gear_path(const er_gear_law *spring, const er_gear_elements *elements, double damping, double spacing,
                            int64_t count, const double *torque, double start, double *angle, double *rate);

/* How often each of `series` gears, whose torques stand beside each other in the rows of `count` samples, comes from one
 * flank of its backlash to the other; in between d e' = T, from its middle on. */
ER_EXPORT void er_backlash_reversals(int64_t count, int64_t series, double spacing, const double *torque,
                                     const double *backlash, const double *damping, int64_t *changes);

#endif
