#include "growth.h"

#include <math.h>
#include <string.h>

#include "step/sensitivity.h"

/* Crossings are forgotten within this time [s]; from so many on the shift is carried. */
#define MEMORY 0.1
#define OFTEN 5.0
/* Part of a column's stage accelerations that its solution may leave: the growth alone counts. */
#define ROUGH 1e-3

static int shift_column(const er_model *model)
{
    return er_first_column(&model->robot, ER_BY_START);
}

/* How far the shift takes the TCP within a longest step, all joints beyond an entry of x in a line. */
static double size_of_shift(const er_model *model)
{
    const er_robot *robot = &model->robot;
    const er_sensitivity *s = &model->sensitivity;
    const int column = shift_column(model);
    double time = robot->settings.longest_step, sum = 0.0;
    for (int k = 0; k < robot->elastics; k++) {
        double size = robot->reach[k] * (fabs(s->x[column][k]) + time * fabs(s->v[column][k]));
        sum += size * size;
    }
    for (int d = 0; d < robot->motors; d++) {
        const er_motor_change *motors = &s->motors[column];
        double size = robot->reach[robot->motor[d].coordinate] * (fabs(motors->angle[d]) + time * fabs(motors->rate[d]));
        sum += size * size;
    }
    return sqrt(sum);
}

static void scale_shift(er_model *model, double factor)
{
    er_sensitivity *s = &model->sensitivity;
    const int column = shift_column(model);
    for (int k = 0; k < model->robot.elastics; k++) {
        s->x[column][k] *= factor;
        s->v[column][k] *= factor;
    }
    for (int j = 0; j < er_all_elements(&model->robot); j++)
        s->elongation[column][j] *= factor;
    for (int d = 0; d < model->robot.motors; d++) {
        s->motors[column].angle[d] *= factor;
        s->motors[column].rate[d] *= factor;
        s->motors[column].integral[d] *= factor;
    }
}

bool er_growth_begin(er_model *model)
{
    er_growth *growth = &model->growth;
    const double time = model->memory.state.time;
    const bool is_carried = model->watches_growth && !growth->has_grown && growth->recent > OFTEN;
    if (is_carried && !growth->is_carried) {
        er_sensitivity_start(&model->sensitivity, &model->robot, ER_BY_START, ER_BY_START, time);
        for (int k = 0; k < model->robot.elastics; k++)
            model->sensitivity.x[shift_column(model)][k] = 1.0;
        growth->since = time;
    }
    growth->is_carried = is_carried;
    if (!is_carried)
        return false;
    model->sensitivity.first = shift_column(model);
    model->sensitivity.count = 1;
    model->sensitivity.start = time;
    model->sensitivity.still = false;
    model->sensitivity.reason = NULL;
    model->sensitivity.accuracy = ROUGH;
    model->sensitivity.drive = model->memory.options.drive;
    return true;
}

void er_growth_end(er_model *model, double length, long crossings)
{
    er_growth *growth = &model->growth;
    if (!model->watches_growth)
        return;
    growth->recent = growth->recent / (1.0 + length / MEMORY) + (double)crossings;
    if (growth->is_carried) {
        double size = size_of_shift(model);
        if (model->sensitivity.reason != NULL || !(size > 0.0 && size < INFINITY)) {
            growth->is_carried = false; /* it begins anew */
        } else if (size < 1.0) {
            scale_shift(model, 1.0 / size); /* what counts is how it has grown since it was smallest */
            growth->since = model->memory.state.time;
        }
        growth->has_grown = growth->is_carried && size > ER_MOST_GROWTH;
    }
}
