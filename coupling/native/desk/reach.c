#include "reach.h"

#include <math.h>

#include "core/chain/chain.h"

enum { POSE = 6 };

typedef struct {
    double jacobian[POSE][ER_MAX_ANGLES]; /* by the joints */
    double error[POSE];                   /* from the pose to its target */
} approach;

static void find_approach(const er_robot *robot, const double *theta, const double position[3], const double target[9],
                          approach *found)
{
    er_placement placement;
    er_place(robot, theta, &placement);
    for (int k = 0; k < 3; k++)
        found->error[k] = position[k] - placement.tool_position[k];
    er_rotation_between(target, placement.tool_rotation, found->error + 3);
    for (int j = 0; j < robot->joints; j++)
        for (int k = 0; k < 3; k++) {
            found->jacobian[k][j] = placement.lever[robot->drive_angle[j]][k];
            found->jacobian[3 + k][j] = placement.axis[robot->drive_angle[j]][k];
        }
}

/* The step J^T (J J^T + damping)^-1 error, or (J^T J + damping)^-1 J^T error for fewer joints than six; false if its
 * matrix is singular. */
static bool find_step(const approach *at, int joints, double damping, double *step)
{
    bool tall = joints < POSE;
    int size = tall ? joints : POSE, other = tall ? POSE : joints, pivot[POSE];
    double matrix[POSE * POSE], right[POSE];
    for (int i = 0; i < size; i++) {
        right[i] = tall ? 0.0 : at->error[i];
        for (int k = 0; tall && k < POSE; k++)
            right[i] += at->jacobian[k][i] * at->error[k];
        for (int j = 0; j < size; j++) {
            double sum = i == j ? damping : 0.0;
            for (int k = 0; k < other; k++)
                sum += tall ? at->jacobian[k][i] * at->jacobian[k][j] : at->jacobian[i][k] * at->jacobian[j][k];
            matrix[i * size + j] = sum;
        }
    }
    if (!er_lu_factor(size, matrix, pivot))
        return false;
    er_lu_solve(size, matrix, pivot, right);
    for (int j = 0; j < joints; j++) {
        step[j] = tall ? right[j] : 0.0;
        for (int k = 0; !tall && k < POSE; k++)
            step[j] += at->jacobian[k][j] * right[k];
    }
    return true;
}

static void reach_pose(const er_robot *robot, const er_reach_rules *rules, const double position[3],
                       const double quaternion[4], double *theta, double *error, double *away)
{
    double target[9];
    er_desk_rotation(quaternion, target);
    *error = *away = INFINITY;
    for (int64_t k = 0; k < rules->iterations; k++) {
        approach at;
        double size = 0.0, largest = 0.0, step[ER_MAX_ANGLES];
        find_approach(robot, theta, position, target, &at);
        for (int c = 0; c < POSE; c++)
            size += at.error[c] * at.error[c];
        *error = sqrt(size);
        *away = fmin(*away, sqrt(er_dot(at.error, at.error)));
        if (!find_step(&at, robot->joints, rules->damping * size + rules->least, step))
            return;
        for (int j = 0; j < robot->joints; j++)
            largest = fmax(largest, fabs(step[j]));
        for (int j = 0; j < robot->joints; j++)
            theta[robot->drive_angle[j]] += step[j] * fmin(1.0, rules->largest_step / largest);
        if (*error < rules->tolerance)
            return;
    }
}

void er_desk_reach(const er_desk *desk, const er_reach_rules *rules, int64_t count, const double *position,
                   const double *quaternion, double *theta, double *error, double *away)
{
    for (int64_t k = 0; k < count; k++)
        reach_pose(&desk->robot, rules, position + 3 * k, quaternion + 4 * k, theta + k * desk->robot.angles, error + k,
                   away + k);
}
