/* What the drives do: the chain's angles and rates with them, their torques, and beside each its derivative along a
 * change. */
#include "model.h"

#include <math.h>
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

/* The drives of the rigid robot: as they are commanded; with torques in place of commands it goes with the motors. */
static void join_rigid(const er_model *model, const double *commands, const double *motors, double *drives)
{
    if (model->memory.options.drive == ER_TORQUE)
        join(model, commands, motors, drives);
    else
        memcpy(drives, commands, (size_t)model->robot.joints * sizeof *drives);
}

/* Turns the motion of all drives into what the gears make of it. */
static void transmit(const er_model *model, double *q, double *qd, double *qdd)
{
    for (int i = 0; i < model->robot.joints; i++)
        er_transmit(&model->robot, i, &q[i], &qd[i], &qdd[i]);
}

/* The same of a change of it, where the drives have these rates and accelerations. */
static void transmit_along(const er_model *model, const double *rate, const double *acceleration, double *q,
                           double *qd, double *qdd)
{
    double angle[ER_MAX_JOINTS];
    er_model_motor_angle(model, angle);
    for (int i = 0; i < model->robot.joints; i++) {
        er_transmission at = er_transmission_at(&model->robot, i, angle[i], rate[i], acceleration[i]);
        er_transmit_along(&at, &q[i], &qd[i], &qdd[i]);
    }
}

void er_model_driven(const er_model *model, double *angles)
{
    er_model_motor_angle(model, angles);
    for (int i = 0; model->robot.errors > 0 && i < model->robot.joints; i++)
        angles[i] += er_gear_error_at(&model->robot, i, angles[i]).value;
}

void er_model_angles(const er_model *model, bool rigid, double *theta)
{
    double q[ER_MAX_JOINTS];
    if (rigid)
        join_rigid(model, model->memory.held.q, model->memory.state.motors.angle, q);
    else
        er_model_driven(model, q);
    er_angles(&model->robot, q, rigid ? NULL : model->memory.state.x, theta);
}

void er_model_rates(const er_model *model, bool rigid, double *rate)
{
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], none[ER_MAX_JOINTS] = {0.0};
    if (rigid) {
        join_rigid(model, model->memory.held.qd, model->memory.state.motors.rate, qd);
    } else {
        er_model_motor_rate(model, qd);
        if (model->robot.errors > 0) {
            er_model_motor_angle(model, q);
            transmit(model, q, qd, none);
        }
    }
    er_angles(&model->robot, qd, rigid ? NULL : model->memory.state.v, rate);
}

void er_model_chain_accelerations(const er_model *model, double *acceleration)
{
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS];
    er_model_accelerations(model, qdd);
    if (model->robot.errors > 0) {
        er_model_motor_angle(model, q);
        er_model_motor_rate(model, qd);
        transmit(model, q, qd, qdd);
    }
    er_angles(&model->robot, qdd, NULL, acceleration);
}

void er_angles_along(const er_model *model, const er_change *change, bool rigid, double *theta)
{
    double q[ER_MAX_JOINTS];
    if (rigid) {
        join_rigid(model, change->held.q, change->motors.angle, q);
    } else {
        er_motor_angle_along(model, change, q);
        if (model->robot.errors > 0) {
            double none[ER_MAX_JOINTS] = {0.0}, qd[ER_MAX_JOINTS] = {0.0}, qdd[ER_MAX_JOINTS] = {0.0};
            transmit_along(model, none, none, q, qd, qdd);
        }
    }
    er_angles(&model->robot, q, rigid ? NULL : change->x, theta);
}

void er_rates_along(const er_model *model, const er_change *change, bool rigid, double *rate)
{
    double qd[ER_MAX_JOINTS];
    if (rigid) {
        join_rigid(model, change->held.qd, change->motors.rate, qd);
    } else {
        er_motor_rate_along(model, change, qd);
        if (model->robot.errors > 0) {
            double now[ER_MAX_JOINTS], none[ER_MAX_JOINTS] = {0.0}, q[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS] = {0.0};
            er_model_motor_rate(model, now);
            er_motor_angle_along(model, change, q);
            transmit_along(model, now, none, q, qd, qdd);
        }
    }
    er_angles(&model->robot, qd, rigid ? NULL : change->v, rate);
}

void er_chain_accelerations_along(const er_model *model, const er_change *change, double *acceleration)
{
    double qdd[ER_MAX_JOINTS];
    er_accelerations_along(model, change, qdd);
    if (model->robot.errors > 0) {
        double rate[ER_MAX_JOINTS], bend[ER_MAX_JOINTS], q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS];
        er_model_motor_rate(model, rate);
        er_model_accelerations(model, bend);
        er_motor_angle_along(model, change, q);
        er_motor_rate_along(model, change, qd);
        transmit_along(model, rate, bend, q, qd, qdd);
    }
    er_angles(&model->robot, qdd, NULL, acceleration);
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

/* The error of the gear of entry k of x where its drive is. */
static er_gear_error error_of(const er_model *model, int k)
{
    double angles[ER_MAX_JOINTS];
    int joint = model->robot.elastic_joint[k];
    er_model_motor_angle(model, angles);
    return er_gear_error_at(&model->robot, joint, angles[joint]);
}

double er_model_felt_torque(const er_model *model, int k)
{
    return (1.0 + error_of(model, k).slope) * er_model_gear_torque(model, k);
}

double er_felt_torque_along(const er_model *model, const er_change *change, int k)
{
    er_gear_error error = error_of(model, k);
    double angles[ER_MAX_JOINTS];
    er_motor_angle_along(model, change, angles);
    return (1.0 + error.slope) * er_gear_torque_along(model, change, k) +
           error.bend * er_model_gear_torque(model, k) * angles[model->robot.elastic_joint[k]];
}

double er_model_motor_torque(const er_model *model, int k)
{
    const er_memory *memory = &model->memory;
    const er_held *held = &memory->held;
    int d = model->robot.motor_of[k];
    const er_motor *motor = &model->robot.motor[d < 0 ? 0 : d];
    double rate, slope, torque;
    if (d < 0 || memory->options.quasistatic)
        return er_model_felt_torque(model, k);
    if (memory->options.drive == ER_TORQUE)
        return held->torque[d];
    if (memory->options.drive == ER_SERVO)
        return er_servo_limited(
            motor, er_servo_asked(motor, er_model_wanted(model, d), memory->state.motors.integral[d]));
    rate = held->qd[motor->joint];
    torque = er_model_gear_torque(model, k);
    return er_model_felt_torque(model, k) +
           (motor->inertia * held->qdd[motor->joint] +
            er_motor_friction(motor, memory->parameters.friction[d], torque, side_of(rate), rate, &slope));
}

double er_motor_torque_along(const er_model *model, const er_change *change, int k)
{
    const er_memory *memory = &model->memory;
    const er_held *moved = &change->held;
    const er_motors *motors = &memory->state.motors;
    int d = model->robot.motor_of[k], joint;
    const er_motor *motor = &model->robot.motor[d < 0 ? 0 : d];
    double rate, slope, torque, side;
    if (d < 0 || memory->options.quasistatic)
        return er_felt_torque_along(model, change, k);
    if (memory->options.drive == ER_TORQUE)
        return moved->torque[d];
    joint = motor->joint;
    if (memory->options.drive == ER_SERVO) {
        double asked = er_servo_asked(motor, er_model_wanted(model, d), motors->integral[d]);
        if (fabs(asked) > motor->torque_limit)
            return 0.0;
        return er_servo_asked(motor, er_wanted_along(model, change, d), change->motors.integral[d]);
    }
    rate = memory->held.qd[joint];
    side = side_of(rate);
    torque = er_model_gear_torque(model, k);
    er_motor_friction(motor, memory->parameters.friction[d], torque, side, rate, &slope);
    return er_felt_torque_along(model, change, k) +
           side * copysign(motor->load_friction, torque) * er_gear_torque_along(model, change, k) +
           motor->inertia * moved->qdd[joint] + slope * moved->qd[joint] +
           side * er_stribeck_left(motor, rate) * change->parameters.friction[d];
}

void er_start_motors_along(const er_model *model, const er_change *change, er_motor_change *motors)
{
    const er_held *held = &model->memory.held;
    for (int d = 0; d < er_model_motors(model); d++) {
        const er_motor *motor = &model->robot.motor[d];
        er_gear_error error = er_gear_error_at(&model->robot, motor->joint, held->q[motor->joint]);
        double slope;
        int joint = motor->joint;
        er_motor_friction(motor, model->memory.parameters.friction[d], 0.0, 0.0, held->qd[joint], &slope);
        motors->angle[d] = change->held.q[joint];
        motors->rate[d] = change->held.qd[joint];
        motors->integral[d] = motor->inertia * change->held.qdd[joint] +
                              (1.0 + error.slope) * er_gear_torque_along(model, change, motor->coordinate) +
                              error.bend * er_model_gear_torque(model, motor->coordinate) * change->held.q[joint] +
                              slope * change->held.qd[joint] -
                              motor->rate_gain * er_servo_wanted(motor, 0.0, 0.0, change->held.qd[joint]);
    }
}
