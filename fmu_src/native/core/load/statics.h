/* Rest of a robot under its load. */
#ifndef ER_STATICS_H
#define ER_STATICS_H

#include "../elements/gear.h"
#include "../elements/gear_parts.h"
#include "load.h"

/* Elastic coordinates at rest, S(x) + H = J^T w + J_p^T (K (a - p) + k max(0, d) n) - g, by the rules of
 * docs/model.md: only the torque H of elements of hysteresis has a memory. */
bool er_equilibrium(const er_robot *robot, const er_gears *gears, const er_history *history,
                    const double gravity[3], const double *q, const er_load *load, double *x, er_failure *failure);

#endif
