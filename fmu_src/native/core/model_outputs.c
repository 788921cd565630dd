#include "model.h"

#include <string.h>

static void place(const er_model *model, const double *x, er_placement *placement)
{
    double theta[ER_MAX_ANGLES];
    er_angles(&model->robot, model->memory.held.q, x, theta);
    er_place(&model->robot, theta, placement);
}

static void place_tool(const er_model *model, const double *x, double position[3], double rotation[9])
{
    double theta[ER_MAX_ANGLES];
    er_angles(&model->robot, model->memory.held.q, x, theta);
    er_place_tool(&model->robot, theta, position, rotation);
}

/* Takes the one of both quaternions that the turns lead to. */
static void orient(er_model *model, bool rigid, const double *theta, double pose[7])
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
    er_angles(&model->robot, model->memory.held.q, rigid ? NULL : model->memory.state.x, theta);
    er_place_tool(&model->robot, theta, position, rotation);
    er_pose(position, rotation, pose);
    orient(model, rigid, theta, pose);
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

const er_posture *er_model_posture(er_model *model, bool rigid)
{
    er_posture *posture = &model->posture[rigid];
    double theta[ER_MAX_ANGLES];
    size_t bytes = (size_t)model->robot.angles * sizeof *theta;
    er_angles(&model->robot, model->memory.held.q, rigid ? NULL : model->memory.state.x, theta);
    if (posture->pose[6] == 0.0 || posture->opposite != model->memory.opposite[rigid] ||
        memcmp(theta, posture->theta, bytes) != 0) {
        posture->opposite = model->memory.opposite[rigid];
        memcpy(posture->theta, theta, bytes);
        er_place(&model->robot, theta, &posture->at);
        er_pose(posture->at.tool_position, posture->at.tool_rotation, posture->pose);
        orient(model, rigid, theta, posture->pose);
    }
    return posture;
}

void er_model_velocity(const er_model *model, double velocity[3])
{
    const er_memory *memory = &model->memory;
    bool rigid = memory->options.quasistatic;
    double rate[ER_MAX_ANGLES];
    er_placement placement;
    place(model, rigid ? NULL : memory->state.x, &placement);
    er_angles(&model->robot, memory->held.qd, rigid ? NULL : memory->state.v, rate);
    for (int c = 0; c < 3; c++) {
        velocity[c] = 0.0;
        for (int i = 0; i < model->robot.angles; i++)
            velocity[c] += placement.lever[i][c] * rate[i];
    }
}

void er_model_deviation(const er_model *model, double deviation[6])
{
    double elastic[3], rigid[3], elastic_rotation[9], rigid_rotation[9];
    place_tool(model, model->memory.state.x, elastic, elastic_rotation);
    place_tool(model, NULL, rigid, rigid_rotation);
    for (int c = 0; c < 3; c++)
        deviation[c] = elastic[c] - rigid[c];
    er_rotation_between(elastic_rotation, rigid_rotation, deviation + 3);
}

void er_model_contact(const er_model *model, er_contact_motion *motion, double wrench[6])
{
    const er_memory *memory = &model->memory;
    static const double rest[ER_MAX_ANGLES];
    bool still = memory->options.quasistatic;
    double theta[ER_MAX_ANGLES], rate[ER_MAX_ANGLES];
    er_load load = memory->held.load;
    memset(wrench, 0, 6 * sizeof *wrench);
    if (!er_contact_holds(&load.contact))
        return;
    if (still)
        memset(load.anchor.velocity, 0, sizeof load.anchor.velocity);
    er_angles(&model->robot, memory->held.q, memory->state.x, theta);
    er_angles(&model->robot, still ? rest : memory->held.qd, still ? NULL : memory->state.v, rate);
    er_contact_move(&model->robot, &load, 0.0, theta, rate, motion);
    er_contact_wrench(motion, wrench);
}

bool er_model_compliance(const er_model *model, double compliance[6], er_failure *failure)
{
    const er_memory *memory = &model->memory;
    return er_compliance(&model->robot, &model->gears, memory->parameters.gravity, memory->held.q,
                         memory->state.x, &memory->held.load, compliance, failure);
}
