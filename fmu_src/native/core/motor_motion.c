/* The motors' equation solved for their accelerations, and how these follow all that they depend on. */
#include "tangent.h"

#include <math.h>
#include <string.h>

/* Elongation of a motor's friction over its slip angle. */
static double part_of(const er_model *model, int d)
{
    int j = model->robot.elements + d;
    return model->memory.state.stops.elongation[j] / model->robot.element[j].angle;
}

double er_model_motor_acceleration(const er_model *model, int d)
{
    const er_motor *motor = &model->robot.motor[d];
    double slope, friction;
    if (er_model_motors(model) == 0)
        return 0.0;
    friction = er_motor_friction(motor, model->memory.parameters.friction[d],
                                 er_model_gear_torque(model, motor->coordinate), part_of(model, d),
                                 model->memory.state.motors.rate[d], &slope);
    return (er_model_motor_torque(model, motor->coordinate) - er_model_felt_torque(model, motor->coordinate) -
            friction) /
           motor->inertia;
}

double er_motor_acceleration_along(const er_model *model, const er_change *change, int d)
{
    const er_motor *motor = &model->robot.motor[d];
    double rate = model->memory.state.motors.rate[d], torque = model->memory.parameters.friction[d];
    double part = part_of(model, d), left = er_stribeck_left(motor, rate), by_rate, friction;
    double gear, by_load = motor->load_friction;
    int j = model->robot.elements + d;
    if (er_model_motors(model) == 0)
        return 0.0;
    gear = er_model_gear_torque(model, motor->coordinate);
    er_motor_friction(motor, torque, gear, part, rate, &by_rate);
    friction = by_rate * change->motors.rate[d] + left * change->parameters.friction[d] * part +
               (left * torque + by_load * fabs(gear)) * change->elongation[j] / model->robot.element[j].angle +
               copysign(by_load, gear) * part * er_gear_torque_along(model, change, motor->coordinate);
    return (er_motor_torque_along(model, change, motor->coordinate) -
            er_felt_torque_along(model, change, motor->coordinate) - friction) /
           motor->inertia;
}

/* The integral comes to wait over this part of the torque limit behind it.  An integral that the limit stops and the
 * falling torque lets go at once would have its solver find one event after the other. */
#define WAITING 1e-4

/* The part of its growth that an integral has, and the slope of that by the torque that is asked for. */
static double growing(const er_model *model, int d, double *slope)
{
    const er_motor *motor = &model->robot.motor[d];
    double wanted = er_model_wanted(model, d), width = WAITING * motor->torque_limit;
    double torque = er_servo_asked(motor, wanted, model->memory.state.motors.integral[d]);
    double beyond = fabs(torque) - motor->torque_limit, left = 1.0 - beyond / width;
    *slope = 0.0;
    if (!(beyond > 0.0 && torque * wanted > 0.0))
        return 1.0;
    if (left <= 0.0)
        return 0.0;
    *slope = -copysign(1.0, torque) / width;
    return left;
}

double er_model_integral_growth(const er_model *model, int d)
{
    double slope;
    if (model->memory.options.drive != ER_SERVO)
        return 0.0;
    return model->robot.motor[d].integral_gain * er_model_wanted(model, d) * growing(model, d, &slope);
}

double er_integral_growth_along(const er_model *model, const er_change *change, int d)
{
    const er_motor *motor = &model->robot.motor[d];
    double slope, part, wanted;
    if (model->memory.options.drive != ER_SERVO)
        return 0.0;
    part = growing(model, d, &slope);
    wanted = er_wanted_along(model, change, d);
    return motor->integral_gain *
           (part * wanted + er_model_wanted(model, d) * slope *
                                (motor->rate_gain * wanted + change->motors.integral[d]));
}

void er_model_accelerations(const er_model *model, double *drives)
{
    memcpy(drives, model->memory.held.qdd, (size_t)model->robot.joints * sizeof *drives);
    for (int d = 0; d < er_model_motors(model); d++)
        drives[model->robot.motor[d].joint] = er_model_motor_acceleration(model, d);
}

void er_accelerations_along(const er_model *model, const er_change *change, double *drives)
{
    memcpy(drives, change->held.qdd, (size_t)model->robot.joints * sizeof *drives);
    for (int d = 0; d < er_model_motors(model); d++)
        drives[model->robot.motor[d].joint] = er_motor_acceleration_along(model, change, d);
}
