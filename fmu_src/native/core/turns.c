#include "turns.h"

#include <math.h>
#include <string.h>

#include "vector.h"

/* Angles that differ by less in sum turn a tool by less than half a turn [rad]: the scalar product of its
 * quaternions is positive then. */
#define NEARBY 2.0

/* q p into q. */
static void multiply(double q[4], const double p[4])
{
    double crossed[3], w = q[3] * p[3] - er_dot(q, p);
    er_cross(q, p, crossed);
    for (int c = 0; c < 3; c++)
        q[c] = q[3] * p[c] + p[3] * q[c] + crossed[c];
    q[3] = w;
}

static void multiply_all(er_turns *turns, const er_robot *robot, const double *theta)
{
    static const double origin[3] = {0.0, 0.0, 0.0};
    double pose[7], *q = turns->quaternion;
    q[0] = q[1] = q[2] = 0.0;
    q[3] = 1.0;
    for (int i = 0; i < robot->angles; i++) {
        const double *axis = robot->rotation[i].axis;
        double sine = sin(0.5 * theta[i]);
        const double turn[4] = {axis[0] * sine, axis[1] * sine, axis[2] * sine, cos(0.5 * theta[i])};
        multiply(q, turn);
    }
    er_pose(origin, robot->tool_rotation, pose);
    multiply(q, pose + 3);
    memcpy(turns->theta, theta, (size_t)robot->angles * sizeof *theta);
    turns->set = true;
}

double er_turns_sign(er_turns *turns, const er_robot *robot, const double *theta,
                     const double quaternion[4])
{
    const double *near = turns->theta, *q = turns->quaternion;
    double apart[2] = {0.0, 0.0}; /* two sums at a time */
    int i = 0, n = robot->angles;
    for (; i + 1 < n; i += 2) {
        apart[0] += fabs(theta[i] - near[i]);
        apart[1] += fabs(theta[i + 1] - near[i + 1]);
    }
    if (i < n)
        apart[0] += fabs(theta[i] - near[i]);
    if (!turns->set || !(apart[0] + apart[1] < NEARBY))
        multiply_all(turns, robot, theta);
    return (quaternion[0] * q[0] + quaternion[1] * q[1]) +
                       (quaternion[2] * q[2] + quaternion[3] * q[3]) < 0.0
               ? -1.0 : 1.0;
}
