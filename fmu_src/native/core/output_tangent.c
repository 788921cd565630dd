#include "output_tangent.h"

#include <math.h>
#include <string.h>

#include "anchored_statics.h"
#include "linear.h"
#include "vector.h"

/* Below this angle [rad] a series is exact to rounding where the closed form cancels. */
#define SMALL_ANGLE 0.1

enum { MOST = ER_MAX_ANGLES };

/* Placements of the elastic or the rigid robot and how they move. */
typedef struct {
    er_placement at;
    er_placement_tangent along;
} motion;

static void move(const er_model *model, const er_change *change, bool rigid, bool bodies, motion *out)
{
    const er_robot *robot = &model->robot;
    const er_memory *memory = &model->memory;
    double theta[MOST];
    er_angles(robot, memory->held.q, rigid ? NULL : memory->state.x, theta);
    if (bodies)
        er_place_bodies(robot, theta, &out->at);
    else
        er_place(robot, theta, &out->at);
    er_angles(robot, change->held.q, rigid ? NULL : change->x, theta);
    er_placement_along(robot, &out->at, theta, bodies, &out->along);
}

/* Wrench on the tool at rest, of spring and contact too, and how it changes along with load and TCP. */
static void wrench_along(const er_model *model, const er_change *change, const motion *p,
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

bool er_equilibrium_along(const er_model *model, const er_change *acting, double *x)
{
    const er_robot *robot = &model->robot;
    const er_memory *memory = &model->memory;
    const er_gears *gears = &model->gears;
    static const double no_wrench[6] = {0.0};
    er_change change = {acting->held, {0.0}, {0.0}, acting->parameters};
    double stiffness[MOST * MOST], support[MOST * MOST] = {0.0}, yielding[ER_SYMMETRIC];
    double of_gravity[MOST], wrench[6], wrench_change[6];
    int m = robot->elastics, pivot[MOST];
    motion p;
    move(model, &change, false, true, &p);
    wrench_along(model, &change, &p, wrench, wrench_change);
    er_static_torque_along(robot, &p.at, &p.along, memory->parameters.gravity, wrench, wrench_change,
                           x);
    er_static_torque(robot, &p.at, change.parameters.gravity, no_wrench, of_gravity);
    er_static_torque_gradient(robot, &p.at, memory->parameters.gravity, wrench, stiffness);
    er_load_support(&memory->held.load, p.at.tool_position, yielding);
    er_add_support(robot, &p.at, yielding, support);
    for (int k = 0; k < m; k++) {
        double at = memory->state.x[k];
        /* A gear without load rests in the middle of its play, whatever the others do. */
        bool neutral = er_gear_switches(gears, k) && at == 0.0;
        for (int j = 0; j < m; j++)
            stiffness[k * m + j] = neutral ? 0.0 : support[k * m + j] - stiffness[k * m + j];
        stiffness[k * m + k] +=
            neutral ? 1.0 : er_gear_slope(gears, k, er_gear_region(gears, k, at), at);
        x[k] = neutral ? 0.0
                       : x[k] + of_gravity[k] -
                             er_gear_along(gears, k, er_gear_region(gears, k, at), at,
                                            change.parameters.stiffness[k],
                                            change.parameters.backlash[k]);
    }
    if (!er_lu_factor(m, stiffness, pivot))
        return false;
    er_lu_solve(m, stiffness, pivot, x);
    return true;
}

/* dq = (turn, 0) q / 2 for a quaternion q and a small rotation in base axes. */
static void pose_along(er_model *model, const er_change *change, bool rigid, double pose[7])
{
    const er_robot *robot = &model->robot;
    const er_posture *posture = er_model_posture(model, rigid);
    const double *at = posture->pose;
    double theta[MOST], turn[3] = {0.0, 0.0, 0.0}, crossed[3];
    er_angles(robot, change->held.q, rigid ? NULL : change->x, theta);
    pose[0] = pose[1] = pose[2] = 0.0;
    for (int i = 0; i < robot->angles; i++)
        for (int c = 0; c < 3; c++) {
            pose[c] += posture->at.lever[i][c] * theta[i];
            turn[c] += posture->at.axis[i][c] * theta[i];
        }
    er_cross(turn, at + 3, crossed);
    for (int c = 0; c < 3; c++) {
        pose[3 + c] = 0.5 * (at[6] * turn[c] + crossed[c]);
    }
    pose[6] = -0.5 * er_dot(turn, at + 3);
}

void er_tcp_along(er_model *model, const er_change *change, double pose[7])
{
    pose_along(model, change, false, pose);
}

void er_rigid_along(er_model *model, const er_change *change, double pose[7])
{
    pose_along(model, change, true, pose);
}

void er_velocity_along(const er_model *model, const er_change *change, double velocity[3])
{
    const er_memory *memory = &model->memory;
    bool rigid = memory->options.quasistatic;
    double rate[MOST], rate_change[MOST];
    motion p;
    move(model, change, rigid, false, &p);
    er_angles(&model->robot, memory->held.qd, rigid ? NULL : memory->state.v, rate);
    er_angles(&model->robot, change->held.qd, rigid ? NULL : change->v, rate_change);
    for (int c = 0; c < 3; c++) {
        velocity[c] = 0.0;
        for (int i = 0; i < model->robot.angles; i++)
            velocity[c] += p.along.lever[i][c] * rate[i] + p.at.lever[i][c] * rate_change[i];
    }
}

/* Derivative of a rotation vector r along a small rotation t in base axes: t - r x t / 2 +
 * c r x (r x t) with c = (1 - cot(|r| / 2) |r| / 2) / |r|^2 (docs/references.md, Sola2018). */
static void rotation_vector_along(const double r[3], const double turn[3], double vector[3])
{
    double a2 = er_dot(r, r), angle = sqrt(a2), half = 0.5 * angle, c, once[3], twice[3];
    if (angle < SMALL_ANGLE)
        c = 1.0 / 12.0 + a2 * (1.0 / 720.0 + a2 * (1.0 / 30240.0 + a2 / 1209600.0));
    else
        c = (1.0 - half * cos(half) / sin(half)) / a2;
    er_cross(r, turn, once);
    er_cross(r, once, twice);
    for (int k = 0; k < 3; k++)
        vector[k] = turn[k] - 0.5 * once[k] + c * twice[k];
}

/* The rotation between both turns by turn - R_between turn_rigid. */
void er_deviation_along(const er_model *model, const er_change *change, double deviation[6])
{
    motion elastic, rigid;
    double at[6], turn[3], back[3], of_rigid[3];
    move(model, change, false, false, &elastic);
    move(model, change, true, false, &rigid);
    er_model_deviation(model, at);
    for (int i = 0; i < 3; i++) {
        back[i] = 0.0;
        for (int j = 0; j < 3; j++)
            back[i] += rigid.at.tool_rotation[3 * j + i] * rigid.along.turn[j];
    }
    er_rotate(elastic.at.tool_rotation, back, of_rigid);
    for (int c = 0; c < 3; c++) {
        deviation[c] = elastic.along.tool_position[c] - rigid.along.tool_position[c];
        turn[c] = elastic.along.turn[c] - of_rigid[c];
    }
    rotation_vector_along(at + 3, turn, deviation + 3);
}

/* Adds the change of J_p^T K J_p, spring's and contact's part of the stiffness, times -1. */
static void take_off_support(const er_model *model, const er_change *change, const motion *p,
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
    static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
    const er_robot *robot = &model->robot;
    const er_memory *memory = &model->memory;
    const double *gravity = memory->parameters.gravity;
    double wrench[6], wrench_change[6];
    int m = robot->elastics, pivot[MOST];
    double stiffness[MOST * MOST], softening[MOST * MOST], of_gravity[MOST * MOST];
    double moved[3][MOST], moved_change[3][MOST], support[ER_SYMMETRIC];
    static const double no_wrench[6] = {0.0};
    motion p;
    memset(compliance, 0, 6 * sizeof *compliance);
    if (m == 0)
        return true;
    move(model, change, false, true, &p);
    wrench_along(model, change, &p, wrench, wrench_change);
    er_static_torque_gradient(robot, &p.at, gravity, wrench, stiffness);
    er_static_torque_gradient_along(robot, &p.at, &p.along, gravity, wrench, wrench_change, softening);
    er_static_torque_gradient(robot, &p.at, change->parameters.gravity, no_wrench, of_gravity);
    take_off_support(model, change, &p, softening);
    for (int i = 0; i < m * m; i++) {
        stiffness[i] = -stiffness[i];
        softening[i] += of_gravity[i];
    }
    er_load_support(&memory->held.load, p.at.tool_position, support);
    er_add_support(robot, &p.at, support, stiffness);
    for (int k = 0; k < m; k++) {
        double x = memory->state.x[k];
        stiffness[k * m + k] += er_gear_flank_slope(&model->gears, k, x);
        softening[k * m + k] -= er_gear_flank_curvature(&model->gears, k, x) * change->x[k] +
                                er_gear_flank_slope_along(&model->gears, k, x,
                                                           change->parameters.stiffness[k],
                                                           change->parameters.backlash[k]);
    }
    if (!er_lu_factor(m, stiffness, pivot))
        return false;
    for (int axis = 0; axis < 3; axis++) {
        double *y = moved[axis], *dy = moved_change[axis];
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
            compliance[c] += p.along.lever[i][row[c]] * moved[column[c]][k] +
                             p.at.lever[i][row[c]] * moved_change[column[c]][k];
        }
    return true;
}

void er_contact_of_model_along(const er_model *model, const er_change *change, double force[3], double *gap)
{
    const er_robot *robot = &model->robot;
    const er_load *load = &model->memory.held.load;
    bool still = model->memory.options.quasistatic;
    er_load along = change->held.load;
    er_contact_motion motion;
    er_touch touch;
    double theta[MOST], rate[MOST] = {0.0}, wrench[6];
    memset(force, 0, 3 * sizeof *force);
    *gap = 0.0;
    if (!er_contact_holds(&load->contact))
        return;
    er_model_contact(model, &motion, wrench);
    er_angles(robot, change->held.q, change->x, theta);
    if (still)
        memset(along.anchor.velocity, 0, sizeof along.anchor.velocity);
    else
        er_angles(robot, change->held.qd, change->v, rate);
    er_contact_place_along(robot, load, &motion, theta, rate, &along, &touch);
    *gap = -touch.depth;
    if (!(motion.touch.depth > 0.0))
        return;
    er_contact_wrench_along(robot, load, &motion, theta, rate, &along, wrench);
    memcpy(force, wrench, 3 * sizeof *force);
}
