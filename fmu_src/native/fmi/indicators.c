#include "indicators.h"

#include <math.h>

#include "../core/outputs/chain_motion.h"
#include "../core/step/events.h"
#include "../core/outputs/drive_outputs.h"

/* The bends of a torsion's curve, and how far behind them a piece ends. */
double er_indicate_torsion(const er_instance *instance, int torsion, er_bends *bends)
{
    const er_model *model = instance->model;
    int k = instance->interface.torsion[torsion];
    er_bends_find(&model->gears, k, bends);
    return er_events[ER_AT_EDGE].slack(&model->robot, &model->gears, model->means.tolerance, k, 0);
}

/* The bends of a torsion's curve, the piece that counts, and how far behind them it ends. */
static double find_piece(const er_instance *instance, int torsion, er_bends *bends, int *piece)
{
    double slack = er_indicate_torsion(instance, torsion, bends);
    double x = instance->model->memory.state.x[instance->interface.torsion[torsion]];
    *piece = instance->exchange.piece[torsion];
    if (er_exchange_runs(instance) && *piece <= bends->count)
        return slack;
    *piece = er_bends_piece(bends, 0, x, 0.0);
    return 0.0;
}

void er_indicate_bends(const er_instance *instance, double *ways)
{
    for (int t = 0; t < instance->interface.torsions; t++) {
        er_bends bends;
        int piece;
        double slack = find_piece(instance, t, &bends, &piece);
        double x = instance->model->memory.state.x[instance->interface.torsion[t]];
        er_bends_distance(&bends, piece, x, slack, ways + 2 * t);
    }
}

void er_indicate_bends_along(const er_instance *instance, const er_change *along, double *ways)
{
    const er_model *model = instance->model;
    for (int t = 0; t < instance->interface.torsions; t++) {
        er_bends bends;
        int piece, k = instance->interface.torsion[t];
        double slack = find_piece(instance, t, &bends, &piece);
        double wider = er_gear_per_backlash(&model->gears, k, along->parameters.backlash[k]);
        if (!(slack < model->robot.settings.slack * model->means.tolerance))
            slack = 0.0; /* it does not follow the backlash */
        er_bends_distance_along(&bends, piece, along->x[k], wider, slack, ways + 2 * t);
    }
}

/* Whether an element is that of a motor that does not move by itself. */
static bool is_idle_element(const er_model *model, int j)
{
    return j >= model->robot.elements + er_model_motors(model);
}

/* Rate of the coordinate of an element [rad/s]. */
static double element_rate(const er_robot *robot, const double *v, const double *motors, int j)
{
    return j < robot->elements ? v[robot->element[j].coordinate] : motors[j - robot->elements];
}

/* How far behind their slip angle, or a reversal, elements change [rad]; not before the master integrates. */
static double element_slack(const er_instance *instance, int j)
{
    const er_model *model = instance->model;
    const er_robot *robot = &model->robot;
    const int k = robot->element[j].coordinate;
    if (!er_exchange_runs(instance))
        return 0.0;
    if (model->memory.state.stops.slipping[j] == 0)
        return er_events[ER_AT_SLIP].slack(robot, &model->gears, model->means.tolerance, k, j);
    return ER_REVERSAL_TIME * er_events[ER_AT_REVERSAL].slack(robot, &model->gears, model->means.tolerance, k, j);
}

void er_indicate_slips(const er_instance *instance, double *ways)
{
    const er_state *state = &instance->model->memory.state;
    const er_robot *robot = &instance->model->robot;
    for (int j = 0; j < er_all_elements(robot); j++) {
        int direction = state->stops.slipping[j];
        if (is_idle_element(instance->model, j))
            ways[j] = 1.0;
        else if (direction == 0)
            ways[j] = element_slack(instance, j) + (robot->element[j].angle - fabs(state->stops.elongation[j]));
        else
            ways[j] = element_slack(instance, j) +
                      direction * element_rate(robot, state->v, state->motors.rate, j) * ER_REVERSAL_TIME;
    }
}

void er_indicate_slips_along(const er_instance *instance, const er_change *change, double *ways)
{
    const er_stops *stops = &instance->model->memory.state.stops;
    const er_robot *robot = &instance->model->robot;
    for (int j = 0; j < er_all_elements(robot); j++) {
        if (is_idle_element(instance->model, j))
            ways[j] = 0.0;
        else if (stops->slipping[j] == 0)
            ways[j] = -copysign(1.0, stops->elongation[j]) * change->elongation[j];
        else
            ways[j] = stops->slipping[j] * element_rate(robot, change->v, change->motors.rate, j) * ER_REVERSAL_TIME;
    }
}

/* Way of a motor's servo to its torque limit [N m]; infinite without. */
static double servo_room(const er_model *model, int d, double *torque)
{
    const er_motor *motor = &model->robot.motor[d];
    *torque = motor->rate_gain * er_model_rate_error(model, d) + model->memory.state.motors.integral[d];
    return motor->torque_limit - fabs(*torque);
}

void er_indicate_limits(const er_instance *instance, double *ways)
{
    const er_model *model = instance->model;
    for (int d = 0; d < model->robot.motors; d++) {
        double torque, way = INFINITY;
        if (model->memory.options.drive == ER_SERVO)
            way = servo_room(model, d, &torque);
        ways[d] = isfinite(way) ? way : 1.0;
    }
}

void er_indicate_limits_along(const er_instance *instance, const er_change *change, double *ways)
{
    const er_model *model = instance->model;
    for (int d = 0; d < model->robot.motors; d++) {
        double torque;
        ways[d] = 0.0;
        if (model->memory.options.drive == ER_SERVO && isfinite(servo_room(model, d, &torque)))
            ways[d] = -copysign(1.0, torque) *
                      (model->robot.motor[d].rate_gain * er_rate_error_along(model, change, d) +
                       change->motors.integral[d]);
    }
}
