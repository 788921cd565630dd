/* Static equilibrium of the elastic coordinates, and the compliance there. */
#ifndef ER_STATICS_H
#define ER_STATICS_H

#include "chain.h"
#include "gear.h"
#include "hysteresis.h"
#include "load.h"

/* Elastic coordinates at rest, S(x) + H = J^T w + J_p^T (K (a - p) + k max(0, d) n) - g, by the rules of
 * docs/model.md: only the torque H of elements of hysteresis has a memory. */
bool er_equilibrium(const er_robot *robot, const er_gears *gears, const er_history *history,
                    const double gravity[3], const double *q, const er_load *load, double *x,
                    er_failure *failure);

/* Translational compliance of the TCP at x, on its spring and contact: xx, xy, xz, yy, yz, zz [m/N].
 *
 * A gear inside its backlash counts with the stiffness of its flank, elements of hysteresis while they stick. */
bool er_compliance(const er_robot *robot, const er_gears *gears, const er_stops *stops,
                   const double gravity[3], const double *q, const double *x, const er_load *load,
                   double compliance[6], er_failure *failure);

/* Rest by the way downhill in energy, which a contact spring, a contact and elements of hysteresis ask for; false
 * if there is none. */
bool er_anchored_equilibrium(const er_robot *robot, const er_gears *gears, const er_history *history,
                             const double gravity[3], const double *q, const er_load *load, double *x);

#endif
