#include "chain_motion.h"

#include <string.h>

int er_model_motors(const er_model *model)
{
    const er_options *options = &model->memory.options;
    return options->drive == ER_IDEAL || options->quasistatic ? 0 : model->robot.motors;
}

/* What all drives do: the motors that move by themselves, the others as they are commanded. */
static void join_drives(const er_model *model, const double *commands, const double *motors, double *drives)
{
    memcpy(drives, commands, (size_t)model->robot.joints * sizeof *drives);
    for (int d = 0; d < er_model_motors(model); d++)
        drives[model->robot.motor[d].joint] = motors[d];
}

void er_model_motor_angle(const er_model *model, double *angles)
{
    join_drives(model, model->memory.held.q, model->memory.state.motors.angle, angles);
}

void er_model_motor_rate(const er_model *model, double *rates)
{
    join_drives(model, model->memory.held.qd, model->memory.state.motors.rate, rates);
}

void er_motor_angle_along(const er_model *model, const er_change *change, double *angles)
{
    join_drives(model, change->held.q, change->motors.angle, angles);
}

void er_motor_rate_along(const er_model *model, const er_change *change, double *rates)
{
    join_drives(model, change->held.qd, change->motors.rate, rates);
}

/* The drives of the rigid robot: as they are commanded; with torques in place of commands it goes with the motors. */
static void join_rigid_drives(const er_model *model, const double *commands, const double *motors, double *drives)
{
    if (model->memory.options.drive == ER_TORQUE)
        join_drives(model, commands, motors, drives);
    else
        memcpy(drives, commands, (size_t)model->robot.joints * sizeof *drives);
}

/* Turns the motion of all drives into what the gears make of it. */
static void transmit_drives(const er_model *model, double *q, double *qd, double *qdd)
{
    for (int i = 0; i < model->robot.joints; i++)
        er_transmit(&model->robot, i, &q[i], &qd[i], &qdd[i]);
}

/* The same of a change of it, where the drives have these rates and accelerations. */
static void transmit_drives_along(const er_model *model, const double *rate, const double *acceleration, double *q,
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
        join_rigid_drives(model, model->memory.held.q, model->memory.state.motors.angle, q);
    else
        er_model_driven(model, q);
    er_angles(&model->robot, q, rigid ? NULL : model->memory.state.x, theta);
}

void er_model_rates(const er_model *model, bool rigid, double *rate)
{
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], none[ER_MAX_JOINTS] = {0.0};
    if (rigid) {
        join_rigid_drives(model, model->memory.held.qd, model->memory.state.motors.rate, qd);
    } else {
        er_model_motor_rate(model, qd);
        if (model->robot.errors > 0) {
            er_model_motor_angle(model, q);
            transmit_drives(model, q, qd, none);
        }
    }
    er_angles(&model->robot, qd, rigid ? NULL : model->memory.state.v, rate);
}

void er_angles_along(const er_model *model, const er_change *change, bool rigid, double *theta)
{
    double q[ER_MAX_JOINTS];
    if (rigid) {
        join_rigid_drives(model, change->held.q, change->motors.angle, q);
    } else {
        er_motor_angle_along(model, change, q);
        if (model->robot.errors > 0) {
            double none[ER_MAX_JOINTS] = {0.0}, qd[ER_MAX_JOINTS] = {0.0}, qdd[ER_MAX_JOINTS] = {0.0};
            transmit_drives_along(model, none, none, q, qd, qdd);
        }
    }
    er_angles(&model->robot, q, rigid ? NULL : change->x, theta);
}

void er_rates_along(const er_model *model, const er_change *change, bool rigid, double *rate)
{
    double qd[ER_MAX_JOINTS];
    if (rigid) {
        join_rigid_drives(model, change->held.qd, change->motors.rate, qd);
    } else {
        er_motor_rate_along(model, change, qd);
        if (model->robot.errors > 0) {
            double now[ER_MAX_JOINTS], none[ER_MAX_JOINTS] = {0.0}, q[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS] = {0.0};
            er_model_motor_rate(model, now);
            er_motor_angle_along(model, change, q);
            transmit_drives_along(model, now, none, q, qd, qdd);
        }
    }
    er_angles(&model->robot, qd, rigid ? NULL : change->v, rate);
}

void er_chain_accelerations(const er_model *model, const double *drives, double *acceleration)
{
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS];
    memcpy(qdd, drives, (size_t)model->robot.joints * sizeof *qdd);
    if (model->robot.errors > 0) {
        er_model_motor_angle(model, q);
        er_model_motor_rate(model, qd);
        transmit_drives(model, q, qd, qdd);
    }
    er_angles(&model->robot, qdd, NULL, acceleration);
}

void er_chain_accelerations_along(const er_model *model, const er_change *change, const double *drives,
                                  const double *drives_along, double *acceleration)
{
    double qdd[ER_MAX_JOINTS];
    memcpy(qdd, drives_along, (size_t)model->robot.joints * sizeof *qdd);
    if (model->robot.errors > 0) {
        double rate[ER_MAX_JOINTS], q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS];
        er_model_motor_rate(model, rate);
        er_motor_angle_along(model, change, q);
        er_motor_rate_along(model, change, qd);
        transmit_drives_along(model, rate, drives, q, qd, qdd);
    }
    er_angles(&model->robot, qdd, NULL, acceleration);
}
