/* What the drives do: angles and rates of the chain with them, their torques, and beside each its derivative along a
 * change. */
#include "tangent.h"

#include <math.h>

int er_model_motors(const er_model *model)
{
    const er_options *options = &model->memory.options;
    return options->drive == ER_IDEAL || options->quasistatic ? 0 : model->robot.motors;
}

void er_model_angles(const er_model *model, bool rigid, double *theta)
{
    const er_memory *memory = &model->memory;
    er_angles(&model->robot, memory->held.q, rigid ? NULL : memory->state.x, theta);
    for (int d = 0; !rigid && d < er_model_motors(model); d++) {
        int joint = model->robot.motor[d].joint;
        theta[model->robot.drive_angle[joint]] += memory->state.motors.angle[d] - memory->held.q[joint];
    }
}

void er_model_rates(const er_model *model, bool rigid, double *rate)
{
    const er_memory *memory = &model->memory;
    er_angles(&model->robot, memory->held.qd, rigid ? NULL : memory->state.v, rate);
    for (int d = 0; !rigid && d < er_model_motors(model); d++) {
        int joint = model->robot.motor[d].joint;
        rate[model->robot.drive_angle[joint]] += memory->state.motors.rate[d] - memory->held.qd[joint];
    }
}

/* The torque that gives a motor the motion of its command, with the friction of one that has slipped. */
static double ideal_torque(const er_model *model, const er_motor *motor, double slip_torque)
{
    const er_held *held = &model->memory.held;
    double rate = held->qd[motor->joint], slope;
    if (model->memory.options.quasistatic)
        return 0.0;
    return motor->inertia * held->qdd[motor->joint] +
           er_motor_friction(motor, slip_torque, rate > 0.0 ? 1.0 : rate < 0.0 ? -1.0
                                                                               : 0.0,
                             rate, &slope);
}

er_drive_state er_model_drive(const er_model *model, int joint)
{
    const er_memory *memory = &model->memory;
    const er_motors *motors = &memory->state.motors;
    er_drive_state drive = {memory->held.q[joint], memory->held.qd[joint], 0.0};
    for (int k = 0; k < model->robot.elastics; k++)
        if (model->robot.elastic_joint[k] == joint && model->robot.elastic_tilt[k] == 0)
            drive.torque = er_model_gear_torque(model, k);
    for (int d = 0; d < model->robot.motors; d++) {
        const er_motor *motor = &model->robot.motor[d];
        double p = motors->angle[d] - drive.angle, pv = motors->rate[d] - drive.rate;
        if (motor->joint != joint)
            continue;
        if (er_model_motors(model) == 0)
            drive.torque += ideal_torque(model, motor, memory->parameters.friction[d]);
        else if (memory->options.drive == ER_TORQUE)
            drive = (er_drive_state){motors->angle[d], motors->rate[d], memory->held.torque[d]};
        else
            drive = (er_drive_state){motors->angle[d], motors->rate[d],
                                     er_servo_torque(motor, er_servo_wanted(motor, p, pv, drive.rate),
                                                     motors->integral[d])};
    }
    return drive;
}

static double ideal_torque_along(const er_model *model, const er_change *change, int joint)
{
    double slope, rate = model->memory.held.qd[joint], along = 0.0;
    for (int d = 0; d < model->robot.motors; d++) {
        const er_motor *motor = &model->robot.motor[d];
        double side = rate > 0.0 ? 1.0 : rate < 0.0 ? -1.0
                                                    : 0.0,
               at;
        if (motor->joint != joint || model->memory.options.quasistatic)
            continue;
        er_motor_friction(motor, model->memory.parameters.friction[d], side, rate, &slope);
        at = er_motor_friction(motor, 1.0, side, rate, &(double){0.0}) - motor->viscous * rate;
        along += motor->inertia * change->held.qdd[joint] + slope * change->held.qd[joint] +
                 at * change->parameters.friction[d];
    }
    return along;
}

void er_angles_along(const er_model *model, const er_change *change, bool rigid, double *theta)
{
    er_angles(&model->robot, change->held.q, rigid ? NULL : change->x, theta);
    for (int d = 0; !rigid && d < er_model_motors(model); d++) {
        int joint = model->robot.motor[d].joint;
        theta[model->robot.drive_angle[joint]] += change->motors.angle[d] - change->held.q[joint];
    }
}

void er_rates_along(const er_model *model, const er_change *change, bool rigid, double *rate)
{
    er_angles(&model->robot, change->held.qd, rigid ? NULL : change->v, rate);
    for (int d = 0; !rigid && d < er_model_motors(model); d++) {
        int joint = model->robot.motor[d].joint;
        rate[model->robot.drive_angle[joint]] += change->motors.rate[d] - change->held.qd[joint];
    }
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

er_drive_state er_drive_along(const er_model *model, const er_change *change, int joint)
{
    const er_memory *memory = &model->memory;
    const er_motors *motors = &memory->state.motors;
    er_drive_state drive = {change->held.q[joint], change->held.qd[joint], 0.0};
    for (int k = 0; k < model->robot.elastics; k++)
        if (model->robot.elastic_joint[k] == joint && model->robot.elastic_tilt[k] == 0)
            drive.torque = er_gear_torque_along(model, change, k);
    drive.torque += ideal_torque_along(model, change, joint);
    for (int d = 0; d < er_model_motors(model); d++) {
        const er_motor *motor = &model->robot.motor[d];
        double wanted = er_servo_wanted(motor, motors->angle[d] - memory->held.q[joint],
                                        motors->rate[d] - memory->held.qd[joint], memory->held.qd[joint]);
        double change_wanted = er_servo_wanted(motor, change->motors.angle[d] - drive.angle,
                                               change->motors.rate[d] - drive.rate, drive.rate);
        bool limited = fabs(motor->rate_gain * wanted + motors->integral[d]) > motor->torque_limit;
        if (motor->joint != joint)
            continue;
        drive = (er_drive_state){change->motors.angle[d], change->motors.rate[d], change->held.torque[d]};
        if (memory->options.drive == ER_SERVO)
            drive.torque = limited ? 0.0 : motor->rate_gain * change_wanted + change->motors.integral[d];
    }
    return drive;
}
