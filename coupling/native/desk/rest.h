/* Rest of a robot under a wrench on its tool. */
#ifndef ER_REST_H
#define ER_REST_H

#include <stdbool.h>

#include "chain_rows.h"

/* Elastic coordinates at rest [rad], (m,), of gears that come from their unloaded state, by the torque curve of a
 * number; `q`: angles of the gears' outputs without wind-up [rad], (joints,), `wrench`: force and moment on the robot
 * at the TCP, base axes [N, N m].  False, and x of no use, if there is no rest. */
ER_EXPORT bool er_desk_rest(const er_desk *desk, int64_t law, const double *q, const double *wrench, double *x);

#endif
