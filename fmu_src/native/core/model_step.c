#include <math.h>
#include <stdio.h>
#include <string.h>

#include "model_drives.h"

/* What Newton's method may leave of a step that is solved to rounding [rad]. */
#define EXACT_ITERATION 1e-13

static bool rest_at(er_model *model, double end, const er_held *held, er_failure *failure)
{
    er_state *state = &model->memory.state;
    double x[ER_MAX_ANGLES];
    if (!er_equilibrium(&model->robot, &model->gears, model->memory.parameters.gravity, held->q,
                        &held->load, x, failure))
        return false;
    memcpy(state->x, x, (size_t)model->robot.elastics * sizeof *x);
    er_state_start(state, &model->robot, &model->gears, end);
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
                   hypot(hypot(w[0], w[1]), w[2]), hypot(hypot(w[3], w[4]), w[5]), spring, contact, rate,
                   acceleration);
}

static bool move_to(er_model *model, double end, const er_drives *drives, const er_load *load,
                    const er_held *held, er_failure *failure)
{
    const double start = model->began.time;
    er_system system = {&model->robot, &model->gears, &model->memory.parameters, drives, *load,
                        start, false, er_anchor_holds(&load->anchor), er_load_changes(load),
                        er_contact_holds(&load->contact)};
    const er_means *means = &model->means;
    er_means finer;
    double most = model->robot.settings.most_step;
    if (!(end - start <= most))
        return er_fail(failure, "step size: expected at most %g s at a time, got %.9g s", most,
                       end - start);
    for (int k = 0; k < 6; k++)
        system.loaded |= load->wrench[k] != 0.0;
    if (!system.anchored) /* of either sign */
        memset(system.load.anchor.stiffness, 0, sizeof system.load.anchor.stiffness);
    if (system.contacting || model->work.sensitivity != NULL) {
        finer = model->means;
        if (system.contacting) /* it enlarges errors as a play does */
            finer.tolerance = fmin(finer.tolerance, model->memory.options.tolerance /
                                                        model->robot.settings.tcp_per_local_error_with_play);
        if (model->work.sensitivity != NULL)
            finer.iteration = EXACT_ITERATION / finer.tolerance;
        means = &finer;
    }
    if (er_advance(&model->memory.state, &system, means, end, &model->work, failure))
        return true;
    model->memory.state = model->began;
    return tell_acting(model, held, failure);
}

/* What a step that has been taken leaves to the next one; quasi-static robots have no memory. */
static void remember(er_model *model, double length, const er_command *command)
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
                   er_failure *failure)
{
    const double start = model->memory.state.time;
    er_drives drives = er_model_drives(model, start, end, command);
    er_held held = model->memory.held;
    bool still = model->memory.options.quasistatic || model->robot.elastics == 0;
    model->began = model->memory.state;
    if (!er_model_find_held(model, &drives, end, load, end - start, &held, failure) ||
        !(still ? rest_at(model, end, &held, failure)
                : move_to(model, end, &drives, load, &held, failure)))
        return false;
    model->memory.held = held;
    remember(model, end - start, command);
    return true;
}

bool er_model_follow(er_model *model, const er_state *state, const er_past *past, double end,
                     const er_command *command, const er_load *load, er_failure *failure)
{
    const er_state present = model->memory.state;
    const er_held held = model->memory.held;
    const er_past latest = model->memory.past;
    bool good;
    model->memory.state = *state;
    model->memory.past = *past;
    /* Matrices of the step's own make the columns converge in fewer passes.  Where the torque curve
     * bends, the columns are as exact as the stages that they belong to. */
    memset(&model->memory.state.linearisation, 0, sizeof model->memory.state.linearisation);
    model->work.sensitivity = &model->sensitivity;
    good = er_model_step(model, end, command, load, failure);
    model->work.sensitivity = NULL;
    model->memory.state = present;
    model->memory.held = held;
    model->memory.past = latest; /* which a step that fails has not remembered anew */
    return good;
}
