/* Static equilibrium of the elastic coordinates on a contact spring. */
#ifndef ER_ANCHORED_STATICS_H
#define ER_ANCHORED_STATICS_H

#include "anchor.h"
#include "chain.h"
#include "curves.h"

/* Elastic coordinates at rest, S(x) = J^T w + J_p^T K (a - p) - g, of a spring that holds; false if
 * there are none. */
bool er_anchored_equilibrium(const er_robot *robot, const er_curve *curve, const double gravity[3],
                             const double *q, const er_load *load, double *x);

/* Adds J_p^T K J_p of a contact spring in a placement to a matrix of the elastic coordinates. */
void er_add_anchor(const er_robot *robot, const er_placement *placement, const er_anchor *anchor,
                   double *matrix);

#endif
