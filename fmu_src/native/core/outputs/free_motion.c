#include "free_motion.h"

#include <math.h>
#include <string.h>

#include "chain_motion.h"

/* The same value in each state that the kernel takes. */
static void fill_lanes(int count, const double *values, er_lanes *lanes)
{
    for (int i = 0; i < count; i++)
        for (int l = 0; l < ER_LANES; l++)
            lanes[i][l] = values[i];
}

/* Elongation of a motor's friction over its slip angle. */
static double friction_part(const er_model *model, int d)
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
                                 er_model_gear_torque(model, motor->coordinate), friction_part(model, d),
                                 model->memory.state.motors.rate[d], &slope);
    return (er_model_motor_torque(model, motor->coordinate) - er_model_felt_torque(model, motor->coordinate) -
            friction) /
           motor->inertia;
}

double er_motor_acceleration_along(const er_model *model, const er_change *change, int d)
{
    const er_motor *motor = &model->robot.motor[d];
    double rate = model->memory.state.motors.rate[d], torque = model->memory.parameters.friction[d];
    double part = friction_part(model, d), left = er_stribeck_part(motor, rate), by_rate, friction;
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
static double integral_part(const er_model *model, int d, double *slope)
{
    const er_motor *motor = &model->robot.motor[d];
    double rate_error = er_model_rate_error(model, d), width = WAITING * motor->torque_limit;
    double torque = er_servo_demand(motor, rate_error, model->memory.state.motors.integral[d]);
    double beyond = fabs(torque) - motor->torque_limit, left = 1.0 - beyond / width;
    *slope = 0.0;
    if (!(beyond > 0.0 && torque * rate_error > 0.0))
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
    return model->robot.motor[d].integral_gain * er_model_rate_error(model, d) * integral_part(model, d, &slope);
}

double er_integral_growth_along(const er_model *model, const er_change *change, int d)
{
    const er_motor *motor = &model->robot.motor[d];
    double slope, part, rate_error;
    if (model->memory.options.drive != ER_SERVO)
        return 0.0;
    part = integral_part(model, d, &slope);
    rate_error = er_rate_error_along(model, change, d);
    return motor->integral_gain *
           (part * rate_error + er_model_rate_error(model, d) * slope *
                                (motor->rate_gain * rate_error + change->motors.integral[d]));
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

static void find_chain_accelerations(const er_model *model, double *acceleration)
{
    double drives[ER_MAX_JOINTS];
    er_model_accelerations(model, drives);
    er_chain_accelerations(model, drives, acceleration);
}

bool er_free_motion_solve(er_model *model)
{
    const er_robot *robot = &model->robot;
    const er_memory *memory = &model->memory;
    const er_parameters *parameters = &memory->parameters;
    int m = robot->elastics;
    double theta[ER_MAX_ANGLES], values[ER_MAX_ANGLES];
    const er_load *acting = &memory->held.load;
    er_load at_rest = *acting;
    double of_contact[6];
    ER_ALIGNED er_lanes load[ER_MAX_ANGLES];
    er_placement placement;
    er_free_motion *free = &model->free;
    er_motion *motion = &free->motion;
    free->linked = false;
    at_rest.contact.stiffness = 0.0; /* it moves */
    er_model_angles(model, false, theta);
    er_place_bodies(robot, theta, &placement);
    for (int i = 0; i < robot->angles; i++)
        for (int l = 0; l < ER_LANES; l++) {
            motion->sine[i][l] = sin(theta[i]);
            motion->cosine[i][l] = cos(theta[i]);
        }
    er_model_rates(model, false, values);
    fill_lanes(robot->angles, values, motion->rate);
    find_chain_accelerations(model, values);
    fill_lanes(robot->angles, values, motion->acceleration);
    er_anchor_gap(&acting->anchor, 0.0, placement.tool_position, free->gap);
    er_load_wrench(&at_rest, placement.tool_position, free->wrench);
    if (er_contact_holds(&acting->contact)) {
        er_model_contact(model, &free->contact, of_contact);
        for (int c = 0; c < 6; c++)
            free->wrench[c] += of_contact[c];
    }
    model->kernel.loads(robot, motion, 1, parameters->gravity, free->wrench, NULL, load);
    for (int k = 0; k < m; k++)
        free->acceleration[k] = er_model_gear_torque(model, k) - load[k][0];
    for (int b = 0; b < robot->balancers; b++) {
        int k = robot->balancer[b].coordinate;
        er_balance at = er_balance_at(&robot->balancer[b], theta[robot->elastic_angle[k]]);
        free->acceleration[k] += at.torque;
        free->balance[b] = at.slope;
    }
    er_mass_matrix(robot, &placement, free->mass);
    if (!er_lu_factor(m, free->mass, free->pivot))
        return false;
    er_lu_solve(m, free->mass, free->pivot, free->acceleration);
    return true;
}

/* The tangent belongs to the whole motion, x'' included. */
static void prepare_tangent(er_model *model)
{
    er_free_motion *free = &model->free;
    const er_memory *memory = &model->memory;
    double values[ER_MAX_ANGLES];
    find_chain_accelerations(model, values);
    for (int k = 0; k < model->robot.elastics; k++)
        values[model->robot.elastic_angle[k]] += free->acceleration[k];
    fill_lanes(model->robot.angles, values, free->motion.acceleration);
    model->kernel.link(&model->robot, &free->motion, memory->parameters.gravity, free->wrench, NULL, &free->links);
    free->linked = true;
}

/* Loads by a change of gravity [N m]. */
static void find_weights(const er_model *model, const double gravity[3], er_lanes *load)
{
    er_motion still = model->free.motion;
    memset(still.rate, 0, sizeof still.rate);
    memset(still.acceleration, 0, sizeof still.acceleration);
    model->kernel.loads(&model->robot, &still, 1, gravity, NULL, NULL, load);
}

/* What the contact changes in the wrench. */
static void add_contact(const er_model *model, const er_change *change, double wrench[6])
{
    const er_robot *robot = &model->robot;
    const er_load *load = &model->memory.held.load;
    const er_contact_motion *motion = &model->free.contact;
    double theta[ER_MAX_ANGLES], rate[ER_MAX_ANGLES], along[6];
    if (!er_contact_holds(&load->contact) || !(motion->touch.depth > 0.0))
        return;
    er_angles_along(model, change, false, theta);
    er_rates_along(model, change, false, rate);
    er_contact_wrench_along(robot, load, motion, theta, rate, &change->held.load, along);
    for (int c = 0; c < 6; c++)
        wrench[c] += along[c];
}

void er_free_motion_along(er_model *model, const er_change *change, double *acceleration)
{
    er_free_motion *free = &model->free;
    const er_robot *robot = &model->robot;
    const er_memory *memory = &model->memory;
    double values[ER_MAX_ANGLES], wrench[6], tcp_shift[3], pull[3];
    double drives[ER_MAX_JOINTS], drives_along[ER_MAX_JOINTS];
    ER_ALIGNED er_lanes load[ER_MAX_ANGLES], weight[ER_MAX_ANGLES];
    ER_ALIGNED er_vector shift;
    er_direction direction;
    if (!free->linked)
        prepare_tangent(model);
    er_angles_along(model, change, false, values);
    fill_lanes(robot->angles, values, direction.angle);
    er_rates_along(model, change, false, values);
    fill_lanes(robot->angles, values, direction.rate);
    er_model_accelerations(model, drives);
    er_accelerations_along(model, change, drives_along);
    er_chain_accelerations_along(model, change, drives, drives_along, values);
    fill_lanes(robot->angles, values, direction.acceleration);
    model->kernel.shift(robot, &free->links, &direction, shift);
    for (int c = 0; c < 3; c++)
        tcp_shift[c] = shift[c][0];
    er_anchor_along(&memory->held.load.anchor, free->gap, &change->held.load.anchor, tcp_shift, pull);
    memcpy(wrench, change->held.load.wrench, sizeof wrench);
    for (int c = 0; c < 3; c++)
        wrench[c] += pull[c];
    add_contact(model, change, wrench);
    memset(load, 0, sizeof load);
    model->kernel.tangent(robot, &free->links, &direction, wrench, NULL, load);
    find_weights(model, change->parameters.gravity, weight);
    for (int k = 0; k < robot->elastics; k++)
        acceleration[k] = er_gear_torque_along(model, change, k) - load[k][0] - weight[k][0];
    for (int b = 0; b < robot->balancers; b++) {
        int k = robot->balancer[b].coordinate;
        acceleration[k] += free->balance[b] * direction.angle[robot->elastic_angle[k]][0];
    }
    er_lu_solve(robot->elastics, free->mass, free->pivot, acceleration);
}
