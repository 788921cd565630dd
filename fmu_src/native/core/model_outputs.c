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

static void pose_at(const er_model *model, const double *x, double pose[7])
{
    double position[3], rotation[9];
    place_tool(model, x, position, rotation);
    er_pose(position, rotation, pose);
}

void er_model_tcp(const er_model *model, double pose[7])
{
    pose_at(model, model->memory.state.x, pose);
}

void er_model_rigid(const er_model *model, double pose[7])
{
    pose_at(model, NULL, pose);
}

const er_posture *er_model_posture(er_model *model, bool rigid)
{
    er_posture *posture = &model->posture[rigid];
    double theta[ER_MAX_ANGLES];
    size_t bytes = (size_t)model->robot.angles * sizeof *theta;
    er_angles(&model->robot, model->memory.held.q, rigid ? NULL : model->memory.state.x, theta);
    if (posture->pose[6] == 0.0 || memcmp(theta, posture->theta, bytes) != 0) {
        memcpy(posture->theta, theta, bytes);
        er_place(&model->robot, theta, &posture->at);
        er_pose(posture->at.tool_position, posture->at.tool_rotation, posture->pose);
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

bool er_model_compliance(const er_model *model, double compliance[6], er_failure *failure)
{
    const er_memory *memory = &model->memory;
    return er_compliance(&model->robot, &model->curve, memory->parameters.gravity, memory->held.q,
                         memory->state.x, &memory->held.load, compliance, failure);
}
