/* Static equilibrium of the elastic coordinates on a contact spring or a contact. */
#ifndef ER_ANCHORED_STATICS_H
#define ER_ANCHORED_STATICS_H

#include "chain.h"
#include "gear.h"
#include "load.h"

/* Elastic coordinates at rest, S(x) = J^T w + J_p^T (K (a - p) + k max(0, d) n) - g; false if there are
 * none. */
bool er_anchored_equilibrium(const er_robot *robot, const er_gears *gears, const double gravity[3],
                             const double *q, const er_load *load, double *x);

/* Adds J_p^T K J_p of a stiffness K [N/m] at the TCP to a matrix of the elastic coordinates. */
void er_add_support(const er_robot *robot, const er_placement *placement,
                    const double stiffness[ER_SYMMETRIC], double *matrix);

#endif
