#include "drive_outputs.h"

#include <math.h>
#include <string.h>

#include "chain_motion.h"

/* The way that a motor turns by its command: its friction has slipped that way. */
static double side_of(double rate)
{
    return rate > 0.0 ? 1.0 : rate < 0.0 ? -1.0
                                         : 0.0;
}

double er_model_rate_error(const er_model *model, int d)
{
    const er_held *held = &model->memory.held;
    const er_motors *motors = &model->memory.state.motors;
    const er_motor *motor = &model->robot.motor[d];
    return er_servo_rate_error(motor, motors->angle[d] - held->q[motor->joint], motors->rate[d] - held->qd[motor->joint],
                           held->qd[motor->joint]);
}

double er_rate_error_along(const er_model *model, const er_change *change, int d)
{
    const er_motor *motor = &model->robot.motor[d];
    const er_held *held_change = &change->held;
    return er_servo_rate_error(motor, change->motors.angle[d] - held_change->q[motor->joint],
                           change->motors.rate[d] - held_change->qd[motor->joint], held_change->qd[motor->joint]);
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
            motor, er_servo_demand(motor, er_model_rate_error(model, d), memory->state.motors.integral[d]));
    rate = held->qd[motor->joint];
    torque = er_model_gear_torque(model, k);
    return er_model_felt_torque(model, k) +
           (motor->inertia * held->qdd[motor->joint] +
            er_motor_friction(motor, memory->parameters.friction[d], torque, side_of(rate), rate, &slope));
}

double er_motor_torque_along(const er_model *model, const er_change *change, int k)
{
    const er_memory *memory = &model->memory;
    const er_held *held_change = &change->held;
    const er_motors *motors = &memory->state.motors;
    int d = model->robot.motor_of[k], joint;
    const er_motor *motor = &model->robot.motor[d < 0 ? 0 : d];
    double rate, slope, torque, side;
    if (d < 0 || memory->options.quasistatic)
        return er_felt_torque_along(model, change, k);
    if (memory->options.drive == ER_TORQUE)
        return held_change->torque[d];
    joint = motor->joint;
    if (memory->options.drive == ER_SERVO) {
        double demand = er_servo_demand(motor, er_model_rate_error(model, d), motors->integral[d]);
        if (fabs(demand) > motor->torque_limit)
            return 0.0;
        return er_servo_demand(motor, er_rate_error_along(model, change, d), change->motors.integral[d]);
    }
    rate = memory->held.qd[joint];
    side = side_of(rate);
    torque = er_model_gear_torque(model, k);
    er_motor_friction(motor, memory->parameters.friction[d], torque, side, rate, &slope);
    return er_felt_torque_along(model, change, k) +
           side * copysign(motor->load_friction, torque) * er_gear_torque_along(model, change, k) +
           motor->inertia * held_change->qdd[joint] + slope * held_change->qd[joint] +
           side * er_stribeck_part(motor, rate) * change->parameters.friction[d];
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
                              motor->rate_gain * er_servo_rate_error(motor, 0.0, 0.0, change->held.qd[joint]);
    }
}
