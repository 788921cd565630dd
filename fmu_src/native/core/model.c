#include "model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "outputs/drive_outputs.h"
#include "growth.h"
#include "model_drives.h"
#include "step/newton_matrix.h"
#include "step/sensitivity.h"
#include "load/statics.h"
#include "step/stepper.h"
#include "outputs/chain_motion.h"
#include "load/trajectory_build.h"

/* What Newton's method may leave of a step that is solved to rounding [rad]. */
#define EXACT_ITERATION 1e-13

er_model *er_model_create(const er_robot *robot)
{
    er_model *model = NULL;
    void *memory = NULL;
    size_t size = sizeof *model + 64;
    /* The lanes want 32 bytes of alignment, which malloc need not give: the block's start is kept
     * in front of the model. */
    memory = calloc(1, size);
    if (memory == NULL)
        return NULL;
    model = (er_model *)(((uintptr_t)memory + 32 + sizeof(void *)) & ~(uintptr_t)31);
    ((void **)model)[-1] = memory;
    model->robot = *robot;
    model->memory.parameters = robot->parameters;
    model->kernel = er_best_kernel();
    return model;
}

void er_model_free(er_model *model)
{
    if (model == NULL)
        return;
    er_trajectory_free(&model->trajectory);
    free(model->resources);
    free(((void **)model)[-1]);
}

/* Derives gears and means from options and parameters. */
static void derive_gears(er_model *model)
{
    const er_options *options = &model->memory.options;
    const er_parameters *parameters = &model->memory.parameters;
    const er_settings *settings = &model->robot.settings;
    double longest = settings->longest_step;
    double local = options->tolerance / (er_law_switches(options->curve) ? settings->tcp_per_local_error_with_backlash
                                             : settings->tcp_per_local_error);
    if (model->derived_law == options->curve && model->derived_tolerance == options->tolerance &&
        memcmp(&model->derived_parameters, parameters, sizeof *parameters) == 0)
        return;
    model->means = (er_means){local, settings->iteration,
                              local / (settings->shift_by_jump * longest * longest * longest),
                              model->kernel};
    er_gears_build(&model->gears, options->curve, &model->robot, parameters);
    er_relinearise(&model->work); /* with the damping there is now */
    model->derived_law = options->curve;
    model->derived_tolerance = options->tolerance;
    model->derived_parameters = *parameters;
}

/* The equilibrium that the present state comes to rest in. */
static bool rest_at(er_model *model, const er_held *held, er_failure *failure)
{
    er_state *state = &model->memory.state;
    const er_robot *robot = &model->robot;
    er_history history;
    double x[ER_MAX_ANGLES], driven[ER_MAX_JOINTS];
    memcpy(history.x, state->x, sizeof history.x);
    memcpy(history.elongation, state->stops.elongation, sizeof history.elongation);
    for (int i = 0; i < robot->joints; i++)
        driven[i] = held->q[i] + er_gear_error_at(robot, i, held->q[i]).value;
    if (!er_equilibrium(robot, &model->gears, &history, model->memory.parameters.gravity, driven, &held->load,
                        x, failure))
        return false;
    memcpy(state->x, x, (size_t)robot->elastics * sizeof *x);
    er_stops_rest(robot, &history, x, &state->stops);
    return true;
}

/* Motors that move by themselves begin with the motion of their commands, and servos with the torque for it. */
static void start_motors(er_model *model, const er_command *command)
{
    er_memory *memory = &model->memory;
    er_motors *motors = &memory->state.motors;
    memcpy(memory->held.torque, command->torque, sizeof memory->held.torque);
    for (int d = 0; d < model->robot.motors; d++)
        motors->angle[d] = motors->rate[d] = motors->integral[d] = 0.0;
    for (int d = 0; d < er_model_motors(model); d++) {
        const er_motor *motor = &model->robot.motor[d];
        double rate = memory->held.qd[motor->joint], slope;
        motors->angle[d] = memory->held.q[motor->joint];
        motors->rate[d] = rate;
        motors->integral[d] = motor->inertia * memory->held.qdd[motor->joint] +
                              er_model_felt_torque(model, motor->coordinate) +
                              er_motor_friction(motor, memory->parameters.friction[d], 0.0, 0.0, rate, &slope) -
                              motor->rate_gain * er_servo_rate_error(motor, 0.0, 0.0, rate);
    }
}

/* Whether drives may be what they are told to be. */
static bool require_drives(const er_model *model, er_failure *failure)
{
    const er_options *options = &model->memory.options;
    if (options->drive != ER_IDEAL && model->robot.motors == 0)
        return er_fail(failure, "drive: expected ideal, as no joint of the robot has a drive, got %s",
                       options->drive == ER_SERVO ? "servo" : "torque");
    if (options->drive == ER_TORQUE && (options->quasistatic || options->trajectory[0] != '\0'))
        return er_fail(failure, "drive torque: expected mode dynamic and no trajectory, as torques are not told at"
                                " rest or by one, got %s", options->quasistatic ? "mode quasistatic" : "a trajectory");
    return true;
}

bool er_model_reset(er_model *model, double origin, const er_command *command, const er_load *load, er_failure *failure)
{
    er_memory *memory = &model->memory;
    er_drives drives;
    if (!require_drives(model, failure) || !er_model_require_trajectory(model, memory->options.trajectory, 0, failure))
        return false;
    memory->trajectory_fingerprint =
        memory->options.trajectory[0] != '\0' ? model->trajectory.fingerprint : 0;
    derive_gears(model);
    memory->origin = origin;
    memset(&model->growth, 0, sizeof model->growth);
    memset(&memory->past, 0, sizeof memory->past);
    drives = er_model_drives(model, 0.0, 0.0, command);
    if (!er_model_find_held(model, &drives, 0.0, load, 0.0, &memory->held, failure))
        return false;
    memset(&memory->state, 0, sizeof memory->state);
    for (int j = 0; j < model->robot.elements; j++)
        memory->state.stops.elongation[j] = memory->options.initial == ER_FROM_BELOW   ? INFINITY
                                            : memory->options.initial == ER_FROM_ABOVE ? -INFINITY
                                                                                       : 0.0;
    if (memory->options.initial != ER_UNDEFLECTED && !rest_at(model, &memory->held, failure))
        return false;
    er_state_start(&memory->state, &model->robot, &model->gears, 0.0);
    start_motors(model, command);
    er_model_orient(model);
    return true;
}

void er_model_take_parameters(er_model *model, const er_parameters *parameters)
{
    er_state *state = &model->memory.state;
    if (memcmp(&model->memory.parameters, parameters, sizeof *parameters) == 0)
        return; /* the integration goes on as it was */
    model->memory.parameters = *parameters;
    derive_gears(model);
    er_state_start(state, &model->robot, &model->gears, state->time);
    er_stops_limit(&model->robot, &state->stops);
}

bool er_model_restore(er_model *model, const er_memory *memory, bool computed, er_failure *failure)
{
    if (computed && !er_model_require_trajectory(model, memory->options.trajectory,
                                                 memory->trajectory_fingerprint, failure))
        return false;
    er_memory_copy(&model->robot, &model->memory, memory);
    model->growth.is_carried = false;
    if (computed)
        derive_gears(model);
    return true;
}

/* Says what acted where a motion was given up: one of these may have grown too large. */
static bool tell_acting(const er_model *model, const er_held *held, er_failure *failure)
{
    const er_failure reason = *failure;
    const double *w = held->load.wrench, *k = held->load.anchor.stiffness;
    double stiffness = 0.0, rate = 0.0, acceleration = 0.0;
    char spring[64] = "", contact[64] = "";
    for (int i = 0; i < ER_SYMMETRIC; i++)
        stiffness = fmax(stiffness, fabs(k[i]));
    for (int i = 0; i < model->robot.joints; i++) {
        rate = fmax(rate, fabs(held->qd[i]));
        acceleration = fmax(acceleration, fabs(held->qdd[i]));
    }
    if (stiffness > 0.0)
        snprintf(spring, sizeof spring, "a spring of %.3g N/m, ", stiffness);
    if (er_contact_holds(&held->load.contact))
        snprintf(contact, sizeof contact, "a contact of %.3g N/m, ", held->load.contact.stiffness);
    return er_fail(failure, "%.400s, under %.3g N, %.3g N m, %s%sdrives of %.3g rad/s and %.3g rad/s2:"
                            " one of these is too large, or the robot is unstable", reason.text,
                   hypot(hypot(w[0], w[1]), w[2]), hypot(hypot(w[3], w[4]), w[5]), spring, contact, rate, acceleration);
}

/* Moves a state on, `exact` to rounding; it is of no use if that fails. */
static bool advance_state(er_model *model, er_state *state, double end, const er_drives *drives,
                    const er_load *load, const er_held *held, bool exact, er_failure *failure)
{
    const double start = state->time;
    er_system system = {&model->robot, &model->gears, &model->memory.parameters, drives, *load,
                        start, false, er_anchor_holds(&load->anchor), er_load_changes(load),
                        er_contact_holds(&load->contact), model->memory.options.drive, held->torque};
    const er_means *means = &model->means;
    er_means finer;
    double most = model->robot.settings.most_step;
    if (!(end - start <= most))
        return er_fail(failure, "step size: expected at most %g s at a time, got %.9g s", most, end - start);
    for (int k = 0; k < 6; k++)
        system.loaded |= load->wrench[k] != 0.0;
    if (!system.anchored) /* of either sign */
        memset(system.load.anchor.stiffness, 0, sizeof system.load.anchor.stiffness);
    if (system.contacting || exact) {
        finer = model->means;
        if (system.contacting) /* it enlarges errors as a backlash does */
            finer.tolerance = fmin(finer.tolerance, model->memory.options.tolerance /
                                                        model->robot.settings.tcp_per_local_error_with_backlash);
        if (exact)
            finer.iteration = EXACT_ITERATION / finer.tolerance;
        means = &finer;
    }
    return er_advance(state, &system, means, end, &model->work, failure) ||
           tell_acting(model, held, failure);
}

/* What a step that has been taken leaves to the next one; quasi-static robots have no memory. */
static void remember_step(er_model *model, double length, const er_command *command)
{
    const er_memory *memory = &model->memory;
    er_past *past = &model->memory.past;
    if (memory->options.trajectory[0] != '\0' || memory->options.quasistatic ||
        !er_command_counts(&model->robot, length))
        return;
    past->length = length;
    memcpy(past->q, memory->held.q, sizeof past->q);
    memcpy(past->qd, memory->held.qd, sizeof past->qd);
    memcpy(past->qdd, memory->held.qdd, sizeof past->qdd);
    memcpy(past->rate, command->qd, sizeof past->rate);
    memcpy(past->acceleration, command->qdd, sizeof past->acceleration);
}

bool er_model_step(er_model *model, double end, const er_command *command, const er_load *load,
                   er_state *began, er_failure *failure)
{
    er_state *state = &model->memory.state;
    const double start = state->time;
    er_drives drives = er_model_drives(model, start, end, command);
    er_held held = model->memory.held;
    bool still = model->memory.options.quasistatic || model->robot.elastics == 0, good;
    er_state_copy(&model->robot, began, state);
    memcpy(held.torque, command->torque, sizeof held.torque);
    if (!er_model_find_held(model, &drives, end, load, end - start, &held, failure))
        return false;
    if (!still && er_growth_begin(model))
        model->work.sensitivity = &model->sensitivity;
    good = still ? rest_at(model, &held, failure) : advance_state(model, state, end, &drives, load, &held, false, failure);
    model->work.sensitivity = NULL;
    if (!good) {
        er_state_copy(&model->robot, state, began);
        model->growth.is_carried = false;
        return false;
    }
    if (still)
        er_state_start(state, &model->robot, &model->gears, end);
    else
        er_growth_end(model, end - start, model->work.crossings);
    if (model->memory.options.drive == ER_TORQUE)
        for (int d = 0; d < model->robot.motors; d++) {
            held.q[model->robot.motor[d].joint] = state->motors.angle[d];
            held.qd[model->robot.motor[d].joint] = state->motors.rate[d];
        }
    model->memory.held = held;
    remember_step(model, end - start, command);
    return true;
}

bool er_model_follow(er_model *model, const er_state *state, const er_past *past, double end,
                     const er_command *command, const er_load *load, er_failure *failure)
{
    const er_past latest = model->memory.past;
    er_drives drives;
    er_held held = model->memory.held;
    er_state end_state;
    bool good;
    /* Matrices of the step's own make the columns converge in fewer passes.  Where the torque curve
     * bends, the columns are as exact as the stages that they belong to. */
    er_state_copy(&model->robot, &end_state, state);
    memset(&end_state.linearisation, 0, sizeof end_state.linearisation);
    model->memory.past = *past;
    drives = er_model_drives(model, state->time, end, command);
    model->work.sensitivity = &model->sensitivity;
    good = er_model_find_held(model, &drives, end, load, end - state->time, &held, failure) &&
           advance_state(model, &end_state, end, &drives, load, &held, true, failure);
    model->work.sensitivity = NULL;
    model->memory.past = latest;
    return good;
}
