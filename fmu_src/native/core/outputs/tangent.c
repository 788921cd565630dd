#include "tangent.h"

#include <math.h>
#include <string.h>

#include "chain_motion.h"

/* First moment about o_i of the bodies beyond rotation i [kg m]. */
static void moment_about_joint(const er_placement *p, int i, double moment[3])
{
    const er_body *body = &p->outer[i];
    for (int c = 0; c < 3; c++)
        moment[c] = body->moment[c] + body->mass * p->arm[i][c];
}

/* How a placement moves along a change of theta; `weight` only where it has bodies and `bodies` asks for it.
 *
 * An arm from o_i turns with all rotations up to i and is shifted by those beyond, as the bodies' moment is:
 *
 *     d arm_i = sum_(j<=i) z_j dtheta_j x arm_i + sum_(j>i) z_j dtheta_j x arm_j. */
static void placement_along(const er_robot *robot, const er_placement *p, const double *theta,
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
        er_add_cross(turned[i], p->arm[i], arm);
        er_cross(p->axis[i], arm, t->lever[i]);
        er_add_cross(t->axis[i], p->arm[i], t->lever[i]);
        for (int c = 0; c < 3; c++)
            shift[c] += p->lever[i][c] * theta[i];
        if (!bodies)
            continue;
        moment_about_joint(p, i, about);
        memcpy(moment, swing, sizeof moment);
        er_add_cross(turned[i], about, moment);
        er_cross(p->axis[i], moment, t->weight[i]);
        er_add_cross(t->axis[i], about, t->weight[i]);
        er_cross(p->axis[i], about, moment);
        for (int c = 0; c < 3; c++)
            swing[c] += moment[c] * theta[i];
    }
    memcpy(t->tool_position, shift, sizeof shift);
}

/* Derivative of er_static_torque along that and a change of the wrench [N m]. */
static void static_torque_along(const er_robot *robot, const er_placement *p,
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
static void static_torque_gradient_along(const er_robot *robot, const er_placement *p,
                                         const er_placement_tangent *along, const double gravity[3],
                                         const double wrench[6], const double wrench_change[6], double *gradient)
{
    int m = robot->elastics;
    for (int k = 0; k < m; k++) {
        int i = robot->elastic_angle[k];
        double moment[3], weight[3], load[3] = {0, 0, 0}, change[3] = {0, 0, 0};
        double turned[3] = {0, 0, 0}, turned_change[3] = {0, 0, 0};
        moment_about_joint(p, i, moment);
        er_cross(p->axis[i], moment, weight);
        er_add_cross(p->lever[i], wrench, load);
        er_add_cross(weight, gravity, load);
        er_add_cross(along->lever[i], wrench, change);
        er_add_cross(p->lever[i], wrench_change, change);
        er_add_cross(along->weight[i], gravity, change);
        er_add_cross(p->axis[i], wrench + 3, turned);
        er_add_cross(along->axis[i], wrench + 3, turned_change);
        er_add_cross(p->axis[i], wrench_change + 3, turned_change);
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

enum { MOST = ER_MAX_ANGLES };

void er_placement_change_at(const er_model *model, const er_change *change, bool rigid, bool bodies, er_placement_change *out)
{
    const er_robot *robot = &model->robot;
    double theta[MOST];
    er_model_angles(model, rigid, theta);
    if (bodies)
        er_place_bodies(robot, theta, &out->at);
    else
        er_place(robot, theta, &out->at);
    er_angles_along(model, change, rigid, theta);
    placement_along(robot, &out->at, theta, bodies, &out->along);
}

/* Wrench on the tool at rest, of spring and contact too, and how it changes along with load and TCP. */
static void wrench_along(const er_model *model, const er_change *change, const er_placement_change *p,
                         double wrench[6], double wrench_change[6])
{
    const er_load *load = &model->memory.held.load;
    double pull[3];
    er_load_wrench(load, p->at.tool_position, wrench);
    er_load_force_along(load, p->at.tool_position, &change->held.load, p->along.tool_position, pull);
    memcpy(wrench_change, change->held.load.wrench, 6 * sizeof *wrench_change);
    for (int c = 0; c < 3; c++)
        wrench_change[c] += pull[c];
}

/* Adds what balancers lose of their torque along a change to what a posture takes off gears, times -1, or to what it
 * takes off their stiffness. */
static void balance_along(const er_model *model, const er_change *change, bool stiffness, double *sum)
{
    const er_robot *robot = &model->robot;
    double theta[MOST], along[MOST];
    if (robot->balancers == 0)
        return;
    er_model_angles(model, false, theta);
    er_angles_along(model, change, false, along);
    for (int b = 0; b < robot->balancers; b++) {
        int k = robot->balancer[b].coordinate, i = robot->elastic_angle[k];
        er_balance at = er_balance_at(&robot->balancer[b], theta[i]);
        if (stiffness)
            sum[k * robot->elastics + k] += at.bend * along[i];
        else
            sum[k] += at.slope * along[i];
    }
}

bool er_equilibrium_along(const er_model *model, const er_change *acting, double *x)
{
    const er_robot *robot = &model->robot;
    const er_memory *memory = &model->memory;
    const er_gears *gears = &model->gears;
    static const double no_wrench[6] = {0.0};
    const er_stops *stops = &memory->state.stops;
    er_change change = {acting->held, {0.0}, {0.0}, acting->parameters, {0.0}, {{0.0}, {0.0}, {0.0}}};
    double stuck[MOST] = {0.0};
    double stiffness[MOST * MOST], support[MOST * MOST] = {0.0};
    double of_gravity[MOST], wrench[6], wrench_change[6], driven[ER_MAX_JOINTS];
    int m = robot->elastics, pivot[MOST];
    er_placement_change p;
    for (int d = 0; d < er_model_motors(model); d++) /* at rest they are where their commands are */
        change.motors.angle[d] = acting->held.q[robot->motor[d].joint];
    er_placement_change_at(model, &change, false, true, &p);
    wrench_along(model, &change, &p, wrench, wrench_change);
    static_torque_along(robot, &p.at, &p.along, memory->parameters.gravity, wrench, wrench_change, x);
    er_static_torque(robot, &p.at, change.parameters.gravity, no_wrench, of_gravity);
    er_static_torque_gradient(robot, &p.at, memory->parameters.gravity, wrench, stiffness);
    balance_along(model, &change, false, x);
    er_model_driven(model, driven);
    er_balance_gradient(robot, driven, memory->state.x, stiffness);
    er_load_support_chain(&memory->held.load, robot, &p.at, support);
    er_stops_stiffness(robot, gears->slip_torque, stops, stuck);
    for (int k = 0; k < m; k++) {
        double at = memory->state.x[k];
        /* A gear without load rests in the middle of its backlash, whatever the others do. */
        bool neutral = er_gear_switches(gears, k) && !(gears->slip_torque[k] > 0.0) && at == 0.0;
        for (int j = 0; j < m; j++)
            stiffness[k * m + j] = neutral ? 0.0 : support[k * m + j] - stiffness[k * m + j];
        stiffness[k * m + k] +=
            neutral ? 1.0 : er_gear_slope(gears, k, er_gear_region(gears, k, at), at) + stuck[k];
        x[k] = neutral ? 0.0
                       : x[k] + of_gravity[k] -
                             er_gear_along(gears, k, er_gear_region(gears, k, at), at, change.parameters.stiffness[k],
                                           change.parameters.backlash[k]) -
                             er_elements_torque(robot, k, change.parameters.hysteresis[k], stops->elongation);
    }
    if (!er_lu_factor(m, stiffness, pivot))
        return false;
    er_lu_solve(m, stiffness, pivot, x);
    return true;
}

/* Factors of the stiffness of the robot, its gears on their flanks, with spring and contact; false if it is singular. */
static bool factor_stiffness(const er_model *model, const er_placement *placement, const double wrench[6],
                             double *stiffness, int *pivot)
{
    const er_robot *robot = &model->robot;
    const er_memory *memory = &model->memory;
    double driven[ER_MAX_JOINTS], stuck[MOST] = {0.0};
    int m = robot->elastics;
    er_model_driven(model, driven);
    er_static_torque_gradient(robot, placement, memory->parameters.gravity, wrench, stiffness);
    er_balance_gradient(robot, driven, memory->state.x, stiffness);
    for (int i = 0; i < m * m; i++)
        stiffness[i] = -stiffness[i];
    er_stops_stiffness(robot, model->gears.slip_torque, &memory->state.stops, stuck);
    for (int k = 0; k < m; k++)
        stiffness[k * m + k] += er_gear_flank_slope(&model->gears, k, memory->state.x[k]) + stuck[k];
    if (er_load_yields(&memory->held.load))
        er_load_support_chain(&memory->held.load, robot, placement, stiffness);
    return er_lu_factor(m, stiffness, pivot);
}

bool er_model_compliance(const er_model *model, double compliance[6], er_failure *failure)
{
    const er_robot *robot = &model->robot;
    int m = robot->elastics, pivot[MOST];
    double theta[MOST], stiffness[MOST * MOST], response[3][MOST], wrench[6];
    er_placement placement;
    memset(compliance, 0, 6 * sizeof *compliance);
    if (m == 0)
        return true;
    er_model_angles(model, false, theta);
    er_place_bodies(robot, theta, &placement);
    er_load_wrench(&model->memory.held.load, placement.tool_position, wrench);
    if (!factor_stiffness(model, &placement, wrench, stiffness, pivot))
        return er_fail(failure, "the robot has no compliance here; its stiffness is singular");
    for (int axis = 0; axis < 3; axis++) {
        for (int k = 0; k < m; k++)
            response[axis][k] = placement.lever[robot->elastic_angle[k]][axis];
        er_lu_solve(m, stiffness, pivot, response[axis]);
    }
    for (int c = 0; c < 6; c++)
        for (int k = 0; k < m; k++)
            compliance[c] += placement.lever[robot->elastic_angle[k]][er_row[c]] * response[er_column[c]][k];
    return true;
}

/* Adds the change of J_p^T K J_p, spring's and contact's part of the stiffness, times -1. */
static void take_off_support(const er_model *model, const er_change *change, const er_placement_change *p,
                             double *matrix)
{
    const er_robot *robot = &model->robot;
    const er_load *load = &model->memory.held.load;
    double support[ER_SYMMETRIC], along[ER_SYMMETRIC];
    int m = robot->elastics;
    er_load_support(load, p->at.tool_position, support);
    er_load_support_along(load, p->at.tool_position, &change->held.load, along);
    for (int k = 0; k < m; k++) {
        int i = robot->elastic_angle[k];
        double pull[3], of_lever[3], of_stiffness[3];
        er_anchor_times(support, p->at.lever[i], pull);
        er_anchor_times(support, p->along.lever[i], of_lever);
        er_anchor_times(along, p->at.lever[i], of_stiffness);
        for (int c = 0; c < 3; c++)
            of_stiffness[c] += of_lever[c];
        for (int l = 0; l < m; l++) {
            int j = robot->elastic_angle[l];
            matrix[k * m + l] -= er_dot(of_stiffness, p->at.lever[j]) + er_dot(pull, p->along.lever[j]);
        }
    }
}

/* C = L^T K^-1 L with the levers L: dC = dL^T Y + L^T K^-1 (dL - dK Y), Y = K^-1 L. */
bool er_compliance_along(const er_model *model, const er_change *change, double compliance[6])
{
    const er_robot *robot = &model->robot;
    const er_memory *memory = &model->memory;
    const double *gravity = memory->parameters.gravity;
    double wrench[6], wrench_change[6];
    int m = robot->elastics, pivot[MOST];
    double stiffness[MOST * MOST], softening[MOST * MOST], of_gravity[MOST * MOST];
    double response[3][MOST], response_change[3][MOST];
    double of_hysteresis[MOST] = {0.0};
    static const double no_wrench[6] = {0.0};
    er_placement_change p;
    memset(compliance, 0, 6 * sizeof *compliance);
    if (m == 0)
        return true;
    er_placement_change_at(model, change, false, true, &p);
    wrench_along(model, change, &p, wrench, wrench_change);
    static_torque_gradient_along(robot, &p.at, &p.along, gravity, wrench, wrench_change, softening);
    er_static_torque_gradient(robot, &p.at, change->parameters.gravity, no_wrench, of_gravity);
    balance_along(model, change, true, softening);
    take_off_support(model, change, &p, softening);
    for (int i = 0; i < m * m; i++)
        softening[i] += of_gravity[i];
    er_stops_stiffness(robot, change->parameters.hysteresis, &memory->state.stops, of_hysteresis);
    for (int k = 0; k < m; k++) {
        double x = memory->state.x[k];
        softening[k * m + k] -= of_hysteresis[k];
        softening[k * m + k] -= er_gear_flank_curvature(&model->gears, k, x) * change->x[k] +
                                er_gear_flank_slope_along(&model->gears, k, x, change->parameters.stiffness[k],
                                                          change->parameters.backlash[k]);
    }
    if (!factor_stiffness(model, &p.at, wrench, stiffness, pivot))
        return false;
    for (int axis = 0; axis < 3; axis++) {
        double *y = response[axis], *dy = response_change[axis];
        for (int k = 0; k < m; k++) {
            y[k] = p.at.lever[robot->elastic_angle[k]][axis];
            dy[k] = p.along.lever[robot->elastic_angle[k]][axis];
        }
        er_lu_solve(m, stiffness, pivot, y);
        for (int k = 0; k < m; k++)
            for (int j = 0; j < m; j++)
                dy[k] += softening[k * m + j] * y[j];
        er_lu_solve(m, stiffness, pivot, dy);
    }
    for (int c = 0; c < 6; c++)
        for (int k = 0; k < m; k++) {
            int i = robot->elastic_angle[k];
            compliance[c] += p.along.lever[i][er_row[c]] * response[er_column[c]][k] +
                             p.at.lever[i][er_row[c]] * response_change[er_column[c]][k];
        }
    return true;
}
