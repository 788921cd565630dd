/* Motors with rotor, friction and servo, which the drives are where they do not follow their command exactly.
 *
 * A motor's angle is its command plus p, that of its joint behind the gear the command plus y: the wind-up is
 * y - p - eps(q) with the gear's kinematic error eps, and the chain moves with y as it does with x under ideal
 * drives.  The motor obeys
 *
 *     J q'' = tau + (1 + eps') (S(e) + H + d e') - f,    tau = sat(Kp w + z),    z' = Ki w,
 *     w = Kv (q_cmd - q) + kff q_cmd' - q',
 *
 * f its friction: a stop element times 1 - s (1 - exp(-(q'/v)^2)), after Stribeck, and what its gear's torque adds,
 * and a viscous part.  In Newton's method a motor is eliminated: with G = l d + l^2 k of its gear and A = J +
 * l (Kp + b) + l^2 (Kp Kv + Ki + k_f) + l^3 Ki Kv of itself, l an eigenvalue of the step, the gear's G becomes
 * G A / (c G + A), c close to 1: the motor winds the gear up by 1 + eps', and feels about as much of its torque.
 */
#ifndef ER_MOTORS_H
#define ER_MOTORS_H

#include <math.h>

#include "../chain/gauss.h"
#include "gear_parts.h"

/* How drives follow their commands. */
typedef enum { ER_IDEAL,
               ER_SERVO,
               ER_TORQUE,
               ER_DRIVES } er_drive_kind;

/* What stands for a motor in Newton's matrix: A = inertia + l damping + l^2 stiffness + l^3 jerk; how much it winds
 * its gear up by a change of its angle, and how much of the gear's torque it feels. */
typedef struct {
    double damping, stiffness, jerk;
    double winds, feels;
} er_motor_slopes;

/* What the integral of a servo does: it grows by Ki w, waits, or keeps the torque that is asked for at its limit. */
typedef enum { ER_GROWS,
               ER_WAITS,
               ER_KEEPS } er_integral_law;

/* The law that a servo obeys: at which of its torque limits it is, -1 or 1, or 0, and its integral. */
typedef struct {
    int side;
    er_integral_law integral;
} er_servo_law;

/* The motors' state. */
typedef struct {
    double angle[ER_MAX_JOINTS], rate[ER_MAX_JOINTS]; /* [rad, rad/s] */
    double integral[ER_MAX_JOINTS];                   /* z [N m] */
    er_servo_law law[ER_MAX_JOINTS];
    er_lanes predictor[ER_MAX_JOINTS];                /* p'' at the last step's stages [rad/s^2] */
    er_motor_slopes slopes[ER_MAX_JOINTS];            /* of the last step's matrices */
} er_motors;

/* A change of the motors: of angles, rates and integrals. */
typedef struct {
    double angle[ER_MAX_JOINTS], rate[ER_MAX_JOINTS], integral[ER_MAX_JOINTS];
} er_motor_change;

/* The motors at a step's end: p and its derivatives, q and its derivatives, z. */
typedef struct {
    double p[ER_MAX_JOINTS], pv[ER_MAX_JOINTS], pa[ER_MAX_JOINTS];                    /* [rad, rad/s, rad/s^2] */
    double angle[ER_MAX_JOINTS], rate[ER_MAX_JOINTS], acceleration[ER_MAX_JOINTS]; /* [rad, rad/s, rad/s^2] */
    double integral[ER_MAX_JOINTS];                                                /* [N m] */
} er_motor_end;

/* What a servo does at the start, the stages and the end of a step: Kp w + z [N m], w [rad/s], w' [rad/s^2]. */
typedef struct {
    double demand[ER_CONTROL], rate_error[ER_CONTROL], turning[ER_CONTROL];
} er_servo_course;

/* A complex number for each pair of stages' eigenvalues. */
typedef double er_pairs[2 * ER_PAIRS];

/* The motors in the step that is solved. */
typedef struct er_motor_work {
    double x[ER_MAX_ANGLES], v[ER_MAX_ANGLES]; /* y and y' at its start */
    double p[ER_MAX_JOINTS], pv[ER_MAX_JOINTS]; /* p and p' there */
    double command[ER_MAX_JOINTS], angle[ER_MAX_JOINTS]; /* q_cmd and q there [rad] */
    double command_acceleration[ER_MAX_JOINTS]; /* q_cmd'' there [rad/s^2] */
    double start_integral[ER_MAX_JOINTS];      /* z there [N m] */
    double held[ER_MAX_JOINTS], stuck[ER_MAX_JOINTS]; /* part of friction there, and over the angle [1, 1/rad] */
    ER_ALIGNED er_lanes stage_p[ER_MAX_JOINTS], stage_pv[ER_MAX_JOINTS]; /* at the present nodes */
    ER_ALIGNED er_lanes rate_error[ER_MAX_JOINTS]; /* w there [rad/s] */
    er_lanes integral[ER_MAX_JOINTS];          /* z at the present nodes [N m] */
    ER_ALIGNED er_lanes wind_up[ER_MAX_ANGLES], wind_up_rate[ER_MAX_ANGLES]; /* of all entries of x there [rad, rad/s] */
    er_lanes load[ER_MAX_JOINTS];              /* of their gears, without the gears' torque [N m] */
    er_lanes residual[ER_MAX_JOINTS];
    er_motor_slopes slopes[ER_MAX_JOINTS]; /* of the matrices */
    er_pairs gear[ER_MAX_JOINTS], share[ER_MAX_JOINTS], yields[ER_MAX_JOINTS]; /* G, G/(cG + A), 1/(cG + A) */
    er_lanes winds[ER_MAX_JOINTS], error[ER_MAX_JOINTS]; /* 1 + eps', eps [rad] at the present nodes */
    double start_error[ER_MAX_JOINTS], end_error[ER_MAX_JOINTS]; /* eps at the step's start and its end [rad] */
    er_lanes stage_error[ER_MAX_JOINTS];       /* and at its stages */
    er_servo_law law[ER_MAX_JOINTS];           /* through the step */
    er_servo_course course[ER_MAX_JOINTS];     /* of servos that have a torque limit */
    er_pairs left[ER_MAX_JOINTS];              /* the residual, by pairs */
    er_lanes before[ER_MAX_JOINTS];            /* y'' of their gears before a pass [rad/s^2] */
} er_motor_work;

/* The part of a motor's slip torque that its element has at an angle in the step [rad]; its slope is `stuck`. */
static inline double er_friction_part(const er_motor_work *work, int d, double angle)
{
    return work->held[d] + work->stuck[d] * (angle - work->angle[d]);
}

/* Whether a motor feels its gear's torque otherwise than as it is: by a kinematic error or friction by load. */
static inline bool er_motor_is_loaded(const er_robot *robot, int d)
{
    const er_motor *motor = &robot->motor[d];
    return motor->load_friction > 0.0 || robot->first_error[motor->joint] < robot->first_error[motor->joint + 1];
}

/* exp(-(q'/v)^2); not asked for where it does not count. */
static inline double er_stribeck_fall(const er_motor *motor, double rate)
{
    double u = rate / motor->stribeck_rate;
    return motor->stribeck > 0.0 ? exp(-u * u) : 1.0;
}

/* The part of a motor's friction at rest that is left at a rate [rad/s]. */
static inline double er_stribeck_part(const er_motor *motor, double rate)
{
    return 1.0 - motor->stribeck * (1.0 - er_stribeck_fall(motor, rate));
}

/* Friction of a motor [N m] at a part of what is left of its slip torque at a rate [N m, rad/s], under its gear's
 * torque [N m]. */
static inline double er_friction_at(const er_motor *motor, double slip_torque, double load, double part, double rate)
{
    return (slip_torque + motor->load_friction * fabs(load)) * part + motor->viscous * rate;
}

/* The same by its slip torque at rest [N m], and its slope by the rate. */
static inline double er_motor_friction(const er_motor *motor, double slip_torque, double load, double part, double rate,
                                       double *slope)
{
    double fall = er_stribeck_fall(motor, rate), left = 1.0 - motor->stribeck * (1.0 - fall);
    *slope = motor->viscous - slip_torque * part * motor->stribeck * fall * 2.0 * rate /
                                  (motor->stribeck_rate * motor->stribeck_rate);
    return er_friction_at(motor, slip_torque * left, load, part, rate);
}

/* Rate that a servo wants beside its motor's own, w, from p, p' and the commanded rate [rad/s]. */
static inline double er_servo_rate_error(const er_motor *motor, double p, double pv, double command_rate)
{
    return -motor->position_gain * p - pv + (motor->feed_forward - 1.0) * command_rate;
}

/* Torque that a servo asks for [N m]. */
static inline double er_servo_demand(const er_motor *motor, double rate_error, double integral)
{
    return motor->rate_gain * rate_error + integral;
}

/* What its limit leaves of that [N m]. */
static inline double er_servo_limited(const er_motor *motor, double demand)
{
    return fmax(fmin(demand, motor->torque_limit), -motor->torque_limit);
}

/* Torque of a motor whose servo asks for this, under the law that it obeys [N m]. */
static inline double er_servo_torque(const er_motor *motor, er_servo_law law, double demand)
{
    return law.side == 0 ? demand : law.side * motor->torque_limit;
}

#endif
