/* What the drives do: the chain's angles and rates with them, their torques, and beside each its derivative along a
 * change. */
#include "tangent.h"

#include <string.h>

int er_model_motors(const er_model *model)
{
    const er_options *options = &model->memory.options;
    return options->drive == ER_IDEAL || options->quasistatic ? 0 : model->robot.motors;
}

/* What all drives do: the motors that move by themselves, the others as they are commanded. */
static void join(const er_model *model, const double *commands, const double *motors, double *drives)
{
    memcpy(drives, commands, (size_t)model->robot.joints * sizeof *drives);
    for (int d = 0; d < er_model_motors(model); d++)
        drives[model->robot.motor[d].joint] = motors[d];
}

void er_model_motor_angle(const er_model *model, double *angles)
{
    join(model, model->memory.held.q, model->memory.state.motors.angle, angles);
}

void er_model_motor_rate(const er_model *model, double *rates)
{
    join(model, model->memory.held.qd, model->memory.state.motors.rate, rates);
}

void er_motor_angle_along(const er_model *model, const er_change *change, double *angles)
{
    join(model, change->held.q, change->motors.angle, angles);
}

void er_motor_rate_along(const er_model *model, const er_change *change, double *rates)
{
    join(model, change->held.qd, change->motors.rate, rates);
}

/* Whether the rigid robot follows its commands: with torques in their place it goes with the motors. */
static bool is_commanded(const er_model *model)
{
    return model->memory.options.drive != ER_TORQUE;
}

void er_model_angles(const er_model *model, bool rigid, double *theta)
{
    double q[ER_MAX_JOINTS];
    er_model_motor_angle(model, q);
    er_angles(&model->robot, rigid && is_commanded(model) ? model->memory.held.q : q,
              rigid ? NULL : model->memory.state.x, theta);
}

void er_model_rates(const er_model *model, bool rigid, double *rate)
{
    double qd[ER_MAX_JOINTS];
    er_model_motor_rate(model, qd);
    er_angles(&model->robot, rigid && is_commanded(model) ? model->memory.held.qd : qd,
              rigid ? NULL : model->memory.state.v, rate);
}

void er_angles_along(const er_model *model, const er_change *change, bool rigid, double *theta)
{
    double q[ER_MAX_JOINTS];
    er_motor_angle_along(model, change, q);
    er_angles(&model->robot, rigid && is_commanded(model) ? change->held.q : q, rigid ? NULL : change->x, theta);
}

void er_rates_along(const er_model *model, const er_change *change, bool rigid, double *rate)
{
    double qd[ER_MAX_JOINTS];
    er_motor_rate_along(model, change, qd);
    er_angles(&model->robot, rigid && is_commanded(model) ? change->held.qd : qd, rigid ? NULL : change->v, rate);
}

/* The motor that moves the gear of entry k of x, or -1. */
static int motor_of(const er_model *model, int k)
{
    for (int d = 0; d < model->robot.motors; d++)
        if (model->robot.motor[d].coordinate == k)
            return d;
    return -1;
}

/* The way that a motor turns by its command: its friction has slipped that way. */
static double side_of(double rate)
{
    return rate > 0.0 ? 1.0 : rate < 0.0 ? -1.0
                                         : 0.0;
}

double er_model_wanted(const er_model *model, int d)
{
    const er_held *held = &model->memory.held;
    const er_motors *motors = &model->memory.state.motors;
    const er_motor *motor = &model->robot.motor[d];
    return er_servo_wanted(motor, motors->angle[d] - held->q[motor->joint], motors->rate[d] - held->qd[motor->joint],
                           held->qd[motor->joint]);
}

double er_wanted_along(const er_model *model, const er_change *change, int d)
{
    const er_motor *motor = &model->robot.motor[d];
    const er_held *moved = &change->held;
    return er_servo_wanted(motor, change->motors.angle[d] - moved->q[motor->joint],
                           change->motors.rate[d] - moved->qd[motor->joint], moved->qd[motor->joint]);
}

double er_model_motor_torque(const er_model *model, int k)
{
    const er_memory *memory = &model->memory;
    const er_held *held = &memory->held;
    int d = motor_of(model, k);
    const er_motor *motor = &model->robot.motor[d < 0 ? 0 : d];
    double rate, slope;
    if (d < 0 || memory->options.quasistatic)
        return er_model_gear_torque(model, k);
    if (memory->options.drive == ER_TORQUE)
        return held->torque[d];
    if (memory->options.drive == ER_SERVO)
        return er_servo_torque(motor, er_model_wanted(model, d), memory->state.motors.integral[d]);
    rate = held->qd[motor->joint];
    return er_model_gear_torque(model, k) +
           (motor->inertia * held->qdd[motor->joint] +
            er_motor_friction(motor, memory->parameters.friction[d], side_of(rate), rate, &slope));
}

double er_motor_torque_along(const er_model *model, const er_change *change, int k)
{
    const er_memory *memory = &model->memory;
    const er_held *moved = &change->held;
    const er_motors *motors = &memory->state.motors;
    int d = motor_of(model, k), joint;
    const er_motor *motor = &model->robot.motor[d < 0 ? 0 : d];
    double rate, slope;
    if (d < 0 || memory->options.quasistatic)
        return er_gear_torque_along(model, change, k);
    if (memory->options.drive == ER_TORQUE)
        return moved->torque[d];
    joint = motor->joint;
    if (memory->options.drive == ER_SERVO) {
        double wanted = er_wanted_along(model, change, d);
        if (er_servo_saturates(motor, er_model_wanted(model, d), motors->integral[d]))
            return 0.0;
        return motor->rate_gain * wanted + change->motors.integral[d];
    }
    rate = memory->held.qd[joint];
    er_motor_friction(motor, memory->parameters.friction[d], side_of(rate), rate, &slope);
    return er_gear_torque_along(model, change, k) + motor->inertia * moved->qdd[joint] + slope * moved->qd[joint] +
           side_of(rate) * er_stribeck_left(motor, rate) * change->parameters.friction[d];
}

void er_start_motors_along(const er_model *model, const er_change *change, er_motor_change *motors)
{
    const er_held *held = &model->memory.held;
    for (int d = 0; d < er_model_motors(model); d++) {
        const er_motor *motor = &model->robot.motor[d];
        double slope;
        int joint = motor->joint;
        er_motor_friction(motor, model->memory.parameters.friction[d], 0.0, held->qd[joint], &slope);
        motors->angle[d] = change->held.q[joint];
        motors->rate[d] = change->held.qd[joint];
        motors->integral[d] = motor->inertia * change->held.qdd[joint] +
                              er_gear_torque_along(model, change, motor->coordinate) + slope * change->held.qd[joint] -
                              motor->rate_gain * er_servo_wanted(motor, 0.0, 0.0, change->held.qd[joint]);
    }
}
