/* Elements of one gear's hysteresis along a path of its wind-up. */
#ifndef ER_ELEMENTS_H
#define ER_ELEMENTS_H

#include "gear_drive.h"
#include "gear_path.h"

/* Elongations along `count` wind-ups, between which each moves one way [rad], (count, elements->count), from those at
 * the first. */
ER_EXPORT void er_elements_along(const er_gear_elements *elements, int64_t count, const double *wind_up,
                                 const double *start, double *elongation);

/* What elements do about a motion of a drive, as its held_impulse and held_slope, with the elongations at the start of
 * each step [rad], (count parts, elements->count).
 *
 * wind_up: at the quarters [rad], (count parts, 5); start: elongations at the first; room: 2 elements->count numbers. */
ER_EXPORT void er_elements_hold(const er_gear_drive *drive, const er_gear_elements *elements, const double *wind_up,
                                const double *start, double *impulse, double *slope, double *elongation, double *room);

#endif
