/* Rest on a contact spring, a contact, or elements of hysteresis. */
#ifndef ER_ANCHORED_STATICS_H
#define ER_ANCHORED_STATICS_H

#include "../elements/gear.h"
#include "../elements/gear_parts.h"
#include "load.h"

/* Rest by the way downhill in energy, which a contact spring, a contact and elements of hysteresis ask for; false
 * if there is none. */
bool er_anchored_equilibrium(const er_robot *robot, const er_gears *gears, const er_history *history,
                             const double gravity[3], const double *q, const er_load *load, double *x);

#endif
