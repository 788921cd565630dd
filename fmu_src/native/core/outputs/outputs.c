#include "outputs.h"

#include <math.h>
#include <string.h>

#include "chain_motion.h"

/* Below this angle [rad] a series is exact to rounding where the closed form cancels. */
#define SMALL_ANGLE 0.1

static void place_model(const er_model *model, bool rigid, er_placement *placement)
{
    double theta[ER_MAX_ANGLES];
    er_model_angles(model, rigid, theta);
    er_place(&model->robot, theta, placement);
}

static void place_tool(const er_model *model, bool rigid, double position[3], double rotation[9])
{
    double theta[ER_MAX_ANGLES];
    er_model_angles(model, rigid, theta);
    er_place_tool(&model->robot, theta, position, rotation);
}

/* Takes the one of both quaternions that the turns lead to. */
static void orient_pose(er_model *model, bool rigid, const double *theta, double pose[7])
{
    double sign = er_turns_sign(&model->turns, &model->robot, theta, pose + 3);
    if ((sign < 0.0) == model->memory.opposite[rigid])
        return;
    for (int c = 3; c < 7; c++)
        pose[c] = -pose[c];
}

static void pose_at(er_model *model, bool rigid, double pose[7])
{
    double theta[ER_MAX_ANGLES], position[3], rotation[9];
    er_model_angles(model, rigid, theta);
    er_place_tool(&model->robot, theta, position, rotation);
    er_pose(position, rotation, pose);
    orient_pose(model, rigid, theta, pose);
}

void er_model_tcp(er_model *model, double pose[7])
{
    pose_at(model, false, pose);
}

void er_model_rigid(er_model *model, double pose[7])
{
    pose_at(model, true, pose);
}

void er_model_orient(er_model *model)
{
    bool *opposite = model->memory.opposite;
    opposite[false] = opposite[true] = false;
    for (int rigid = 0; rigid < 2; rigid++) {
        double pose[7];
        pose_at(model, rigid, pose);
        opposite[rigid] = pose[6] < 0.0;
    }
}

static const er_posture *posture_of(er_model *model, bool rigid)
{
    er_posture *posture = &model->posture[rigid];
    double theta[ER_MAX_ANGLES];
    size_t bytes = (size_t)model->robot.angles * sizeof *theta;
    er_model_angles(model, rigid, theta);
    if (posture->pose[6] == 0.0 || posture->opposite != model->memory.opposite[rigid] ||
        memcmp(theta, posture->theta, bytes) != 0) {
        posture->opposite = model->memory.opposite[rigid];
        memcpy(posture->theta, theta, bytes);
        er_place(&model->robot, theta, &posture->at);
        er_pose(posture->at.tool_position, posture->at.tool_rotation, posture->pose);
        orient_pose(model, rigid, theta, posture->pose);
    }
    return posture;
}

/* dq = (turn, 0) q / 2 for a quaternion q and a small rotation in base axes. */
static void pose_along(er_model *model, const er_change *change, bool rigid, double pose[7])
{
    const er_robot *robot = &model->robot;
    const er_posture *posture = posture_of(model, rigid);
    const double *at = posture->pose;
    double theta[ER_MAX_ANGLES], turn[3] = {0.0, 0.0, 0.0}, crossed[3];
    er_angles_along(model, change, rigid, theta);
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

void er_model_velocity(const er_model *model, double velocity[6])
{
    const er_memory *memory = &model->memory;
    bool rigid = memory->options.quasistatic;
    double rate[ER_MAX_ANGLES];
    er_placement placement;
    place_model(model, rigid, &placement);
    er_model_rates(model, rigid, rate);
    memset(velocity, 0, 6 * sizeof *velocity);
    for (int i = 0; i < model->robot.angles; i++)
        for (int c = 0; c < 3; c++) {
            velocity[c] += placement.lever[i][c] * rate[i];
            velocity[3 + c] += placement.axis[i][c] * rate[i];
        }
}

void er_velocity_along(const er_model *model, const er_change *change, double velocity[6])
{
    const er_memory *memory = &model->memory;
    bool rigid = memory->options.quasistatic;
    double rate[ER_MAX_ANGLES], rate_change[ER_MAX_ANGLES];
    er_placement_change p;
    er_placement_change_at(model, change, rigid, false, &p);
    er_model_rates(model, rigid, rate);
    er_rates_along(model, change, rigid, rate_change);
    memset(velocity, 0, 6 * sizeof *velocity);
    for (int i = 0; i < model->robot.angles; i++)
        for (int c = 0; c < 3; c++) {
            velocity[c] += p.along.lever[i][c] * rate[i] + p.at.lever[i][c] * rate_change[i];
            velocity[3 + c] += p.along.axis[i][c] * rate[i] + p.at.axis[i][c] * rate_change[i];
        }
}

static double coordinate_rate(const er_model *model, int k)
{
    return model->memory.options.quasistatic ? 0.0 : model->memory.state.v[k];
}

double er_model_gear_torque(const er_model *model, int k)
{
    const er_gears *gears = &model->gears;
    double x = model->memory.state.x[k];
    return -(er_gear_torque(gears, k, er_gear_region(gears, k, x), x) + gears->damping[k] * coordinate_rate(model, k) +
             er_elements_torque(&model->robot, k, gears->slip_torque[k], model->memory.state.stops.elongation));
}

double er_gear_torque_along(const er_model *model, const er_change *change, int k)
{
    const er_gears *gears = &model->gears;
    const er_parameters *parameters = &change->parameters;
    double x = model->memory.state.x[k];
    int region = er_gear_region(gears, k, x);
    double along = er_gear_slope(gears, k, region, x) * change->x[k] +
                   er_gear_along(gears, k, region, x, parameters->stiffness[k], parameters->backlash[k]) +
                   er_elements_torque(&model->robot, k, gears->slip_torque[k], change->elongation) +
                   er_elements_torque(&model->robot, k, parameters->hysteresis[k],
                                      model->memory.state.stops.elongation);
    if (!model->memory.options.quasistatic)
        along += gears->damping[k] * change->v[k] + parameters->damping[k] * coordinate_rate(model, k);
    return -along;
}

void er_model_deviation(const er_model *model, double deviation[6])
{
    double elastic[3], rigid[3], elastic_rotation[9], rigid_rotation[9];
    place_tool(model, false, elastic, elastic_rotation);
    place_tool(model, true, rigid, rigid_rotation);
    for (int c = 0; c < 3; c++)
        deviation[c] = elastic[c] - rigid[c];
    er_rotation_between(elastic_rotation, rigid_rotation, deviation + 3);
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
    er_placement_change elastic, rigid;
    double at[6], turn[3], back[3], of_rigid[3];
    er_placement_change_at(model, change, false, false, &elastic);
    er_placement_change_at(model, change, true, false, &rigid);
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

void er_model_contact(const er_model *model, er_contact_motion *motion, double wrench[6])
{
    const er_memory *memory = &model->memory;
    bool still = memory->options.quasistatic;
    double theta[ER_MAX_ANGLES], rate[ER_MAX_ANGLES] = {0.0};
    er_load load = memory->held.load;
    memset(wrench, 0, 6 * sizeof *wrench);
    if (!er_contact_holds(&load.contact))
        return;
    if (still)
        memset(load.anchor.velocity, 0, sizeof load.anchor.velocity);
    er_model_angles(model, false, theta);
    if (!still)
        er_model_rates(model, false, rate);
    er_contact_motion_at(&model->robot, &load, 0.0, theta, rate, motion);
    er_contact_wrench(motion, wrench);
}

void er_contact_of_model_along(const er_model *model, const er_change *change, double force[3], double *gap)
{
    const er_robot *robot = &model->robot;
    const er_load *load = &model->memory.held.load;
    bool still = model->memory.options.quasistatic;
    er_load along = change->held.load;
    er_contact_motion motion;
    er_touch touch;
    double theta[ER_MAX_ANGLES], rate[ER_MAX_ANGLES] = {0.0}, wrench[6];
    memset(force, 0, 3 * sizeof *force);
    *gap = 0.0;
    if (!er_contact_holds(&load->contact))
        return;
    er_model_contact(model, &motion, wrench);
    er_angles_along(model, change, false, theta);
    if (still)
        memset(along.anchor.velocity, 0, sizeof along.anchor.velocity);
    else
        er_rates_along(model, change, false, rate);
    er_contact_place_along(robot, load, &motion, theta, rate, &along, &touch);
    *gap = -touch.depth;
    if (!(motion.touch.depth > 0.0))
        return;
    er_contact_wrench_along(robot, load, &motion, theta, rate, &along, wrench);
    memcpy(force, wrench, 3 * sizeof *force);
}
