/* Which of the two unit quaternions of its orientation a tool has.
 *
 * The product of the turns along the chain, each by the half of its angle, is continuous in the angles: the
 * quaternion that is taken after it does not jump to its opposite where the tool has turned by 180 degrees,
 * and follows from the angles alone, not from the way there.  elastic_robot/turns.py is the same in Python.
 */
#ifndef ER_TURNS_H
#define ER_TURNS_H

#include "chain.h"

/* A product that serves all angles nearby. */
typedef struct {
    bool set; /* there is one */
    double theta[ER_MAX_ANGLES];
    double quaternion[4]; /* x, y, z, w */
} er_turns;

/* 1 where a tool's quaternion is that of the turns by these angles, -1 where it is the opposite. */
double er_turns_sign(er_turns *turns, const er_robot *robot, const double *theta,
                     const double quaternion[4]);

#endif
