#include "placement_tangent.h"

#include <string.h>

#include "vector.h"

/* out += a x b */
static void add_cross(const double a[3], const double b[3], double out[3])
{
    double product[3];
    er_cross(a, b, product);
    for (int c = 0; c < 3; c++)
        out[c] += product[c];
}

/* First moment about o_i of the bodies beyond rotation i [kg m]. */
static void moment_about_joint(const er_placement *p, int i, double moment[3])
{
    const er_body *body = &p->beyond[i];
    for (int c = 0; c < 3; c++)
        moment[c] = body->moment[c] + body->mass * p->arm[i][c];
}

/* An arm from o_i turns with all rotations up to i and is shifted by those beyond, as the bodies'
 * moment is:
 *
 *     d arm_i = sum_(j<=i) z_j dtheta_j x arm_i + sum_(j>i) z_j dtheta_j x arm_j. */
void er_placement_along(const er_robot *robot, const er_placement *p, const double *theta,
                        bool bodies, er_placement_tangent *t)
{
    int n = robot->angles;
    double turned[ER_MAX_ANGLES][3], turn[3] = {0, 0, 0}, shift[3] = {0, 0, 0}, swing[3] = {0, 0, 0};
    for (int i = 0; i < n; i++) {
        for (int c = 0; c < 3; c++)
            turned[i][c] = turn[c] += p->axis[i][c] * theta[i];
        er_cross(turn, p->axis[i], t->axis[i]);
    }
    memcpy(t->turn, turn, sizeof turn);
    for (int i = n - 1; i >= 0; i--) {
        double arm[3], moment[3], about[3];
        memcpy(arm, shift, sizeof arm);
        add_cross(turned[i], p->arm[i], arm);
        er_cross(p->axis[i], arm, t->lever[i]);
        add_cross(t->axis[i], p->arm[i], t->lever[i]);
        for (int c = 0; c < 3; c++)
            shift[c] += p->lever[i][c] * theta[i];
        if (!bodies)
            continue;
        moment_about_joint(p, i, about);
        memcpy(moment, swing, sizeof moment);
        add_cross(turned[i], about, moment);
        er_cross(p->axis[i], moment, t->weight[i]);
        add_cross(t->axis[i], about, t->weight[i]);
        er_cross(p->axis[i], about, moment);
        for (int c = 0; c < 3; c++)
            swing[c] += moment[c] * theta[i];
    }
    memcpy(t->tool_position, shift, sizeof shift);
}

void er_static_torque_along(const er_robot *robot, const er_placement *p,
                            const er_placement_tangent *along, const double gravity[3],
                            const double wrench[6], const double wrench_change[6], double *torque)
{
    for (int k = 0; k < robot->elastics; k++) {
        int i = robot->elastic_angle[k];
        torque[k] = er_dot(along->lever[i], wrench) + er_dot(p->lever[i], wrench_change) +
                    er_dot(along->axis[i], wrench + 3) + er_dot(p->axis[i], wrench_change + 3) +
                    er_dot(along->weight[i], gravity);
    }
}

/* Entry i, j with j at or before i is z_j . (lever_i x F + weight_i x g), as is entry j, i; with j
 * before i entry i, j has z_j . (z_i x M) as well: er_static_torque_gradient by the product rule. */
void er_static_torque_gradient_along(const er_robot *robot, const er_placement *p,
                                     const er_placement_tangent *along, const double gravity[3],
                                     const double wrench[6], const double wrench_change[6],
                                     double *gradient)
{
    int m = robot->elastics;
    for (int k = 0; k < m; k++) {
        int i = robot->elastic_angle[k];
        double moment[3], weight[3], load[3] = {0, 0, 0}, change[3] = {0, 0, 0};
        double turned[3] = {0, 0, 0}, turned_change[3] = {0, 0, 0};
        moment_about_joint(p, i, moment);
        er_cross(p->axis[i], moment, weight);
        add_cross(p->lever[i], wrench, load);
        add_cross(weight, gravity, load);
        add_cross(along->lever[i], wrench, change);
        add_cross(p->lever[i], wrench_change, change);
        add_cross(along->weight[i], gravity, change);
        add_cross(p->axis[i], wrench + 3, turned);
        add_cross(along->axis[i], wrench + 3, turned_change);
        add_cross(p->axis[i], wrench_change + 3, turned_change);
        for (int l = 0; l <= k; l++) {
            int j = robot->elastic_angle[l];
            double both = er_dot(along->axis[j], load) + er_dot(p->axis[j], change);
            gradient[k * m + l] = gradient[l * m + k] = both;
            if (l < k)
                gradient[k * m + l] +=
                    er_dot(along->axis[j], turned) + er_dot(p->axis[j], turned_change);
        }
    }
}
