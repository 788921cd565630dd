#include "motors.h"

#include <math.h>

/* exp(-(q'/v)^2); not asked for where it does not count. */
static double find_fall(const er_motor *motor, double rate)
{
    double u = rate / motor->stribeck_rate;
    return motor->stribeck > 0.0 ? exp(-u * u) : 1.0;
}

double er_stribeck_left(const er_motor *motor, double rate)
{
    return 1.0 - motor->stribeck * (1.0 - find_fall(motor, rate));
}

double er_motor_friction(const er_motor *motor, double slip_torque, double load, double part, double rate,
                         double *slope)
{
    double u = rate / motor->stribeck_rate, fall = find_fall(motor, rate);
    double left = 1.0 - motor->stribeck * (1.0 - fall);
    *slope = motor->viscous - slip_torque * part * motor->stribeck * fall * 2.0 * u / motor->stribeck_rate;
    return (slip_torque * left + motor->load_friction * fabs(load)) * part + motor->viscous * rate;
}

bool er_motor_is_loaded(const er_robot *robot, int d)
{
    const er_motor *motor = &robot->motor[d];
    return motor->load_friction > 0.0 || robot->first_error[motor->joint] < robot->first_error[motor->joint + 1];
}

double er_servo_torque(const er_motor *motor, double wanted, double integral)
{
    double torque = motor->rate_gain * wanted + integral;
    return fmax(fmin(torque, motor->torque_limit), -motor->torque_limit);
}

bool er_servo_saturates(const er_motor *motor, double wanted, double integral)
{
    return fabs(motor->rate_gain * wanted + integral) > motor->torque_limit;
}

bool er_servo_waits(const er_motor *motor, double wanted, double integral)
{
    return er_servo_saturates(motor, wanted, integral) && (motor->rate_gain * wanted + integral) * wanted > 0.0;
}

double er_servo_wanted(const er_motor *motor, double p, double pv, double command_rate)
{
    return -motor->position_gain * p - pv + (motor->feed_forward - 1.0) * command_rate;
}
