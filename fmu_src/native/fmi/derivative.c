/* A step is computed again from where it began, with the sensitivities of its state carried along, for all entries of
 * the wrench or of the command, say, at once.  They serve until the state changes. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "derivative.h"

#include "../core/outputs/chain_motion.h"
#include "../core/outputs/drive_outputs.h"
#include "../core/model_drives.h"
#include "../core/step/sensitivity.h"
#include "../core/outputs/tangent.h"
#include "exchange.h"
#include "variables.h"
#include "blocks.h"

/* The first of the causes whose columns are computed together with those of one. */
static er_cause first_beside(er_cause cause)
{
    if (cause == ER_BY_QD || cause == ER_BY_QDD)
        return ER_BY_Q;
    return cause == ER_BY_ANCHOR_VELOCITY ? ER_BY_ANCHOR : cause == ER_BY_NORMAL ? ER_BY_CONTACT
                                                                                 : cause;
}

static void start_columns(er_model *model, er_cause first, const er_step_start *start)
{
    const er_robot *robot = &model->robot;
    double time = start->state.time;
    er_cause last = first;
    while (last + 1 < ER_CAUSES && first_beside((er_cause)(last + 1)) == first)
        last++;
    er_sensitivity_start(&model->sensitivity, robot, first, last, time);
    model->sensitivity.drive = start->stepped ? model->memory.options.drive : ER_IDEAL; /* motors start at commands */
    if (first == ER_BY_Q)
        er_command_along(robot, &start->past, &start->command,
                         start->stepped ? start->end - time : 0.0, model->sensitivity.commanded);
}

/* The block of a real; NULL for other references. */
static const er_block *block_of_real(const er_instance *instance, unsigned reference)
{
    bool real = reference < (unsigned)instance->interface.reals;
    return real ? er_block_of(&instance->interface, reference) : NULL;
}

/* In initialisation mode states are unknowns. */
static bool is_known(const er_instance *instance, unsigned reference)
{
    const er_block *block = block_of_real(instance, reference);
    if (block == NULL)
        return reference == er_time_reference(&instance->interface);
    return block->kind == ER_INPUT || block->kind == ER_TUNABLE ||
           (instance->progress.phase >= ER_RUNNING && er_is_state(&instance->interface, reference));
}

/* A variable as sentences call it. */
static const char *name_of(const er_instance *instance, unsigned reference, char text[ER_NAME])
{
    if (reference < (unsigned)instance->interface.reals)
        return instance->interface.name[reference];
    snprintf(text, ER_NAME, "value reference %u", reference);
    return text;
}

static bool require_kinds(er_instance *instance, const unsigned *unknowns, size_t unknown_count,
                          const unsigned *knowns, size_t known_count, const double *seed)
{
    char text[ER_NAME];
    for (size_t i = 0; i < unknown_count; i++) {
        const er_block *block = block_of_real(instance, unknowns[i]);
        if (block == NULL || !er_is_computed(block))
            return er_fail(&instance->failure, "derivative: expected an output to differentiate, got"
                           " %s", name_of(instance, unknowns[i], text));
    }
    for (size_t j = 0; j < known_count; j++) {
        if (!is_known(instance, knowns[j]))
            return er_fail(&instance->failure, "derivative: expected an input, a tunable parameter, time or,"
                           " behind initialisation, a state to differentiate by, got %s",
                           name_of(instance, knowns[j], text));
        if (!isfinite(seed[j]))
            return er_fail(&instance->failure, "the seed of %s is not finite", name_of(instance, knowns[j], text));
    }
    return true;
}

/* The column's unit change of what is held at the present time, and of parameters. */
static void known_along(const er_instance *instance, int column, double factor, er_change *change)
{
    const er_model *model = instance->model;
    er_held *held = &change->held;
    const er_step_start *start = er_step_start_of(instance);
    double elapsed = start->stepped ? start->end - start->state.time : 0.0;
    er_share share = er_share_of(&model->sensitivity, &model->robot, column, elapsed);
    int entry;
    er_cause cause = er_cause_of(&model->robot, column, &entry);
    er_parameter_along(&model->robot, column, factor, &change->parameters);
    for (int k = 0; k < 6; k++)
        held->load.wrench[k] += factor * share.load.wrench[k];
    for (int c = 0; c < 3; c++) {
        held->load.anchor.position[c] += factor * share.load.anchor.position[c];
        held->load.anchor.velocity[c] += factor * share.load.anchor.velocity[c];
    }
    if (cause == ER_BY_CONTACT)
        *er_contact_entry(&held->load.contact, entry) += factor;
    else if (cause == ER_BY_NORMAL)
        held->load.contact.normal[entry] += factor;
    for (int k = 0; k < ER_SYMMETRIC; k++)
        held->load.anchor.stiffness[k] += factor * share.load.anchor.stiffness[k];
    /* Along a trajectory commands are not looked at. */
    if (share.joint >= 0 && model->memory.options.trajectory[0] == '\0') {
        held->q[share.joint] += factor * share.q;
        held->qd[share.joint] += factor * share.qd;
        held->qdd[share.joint] += factor * share.qdd;
    }
    if (cause == ER_BY_TORQUE)
        held->torque[entry] += factor;
}

static void follow_equilibrium(er_instance *instance, er_sensitivity *sensitivity)
{
    static const double still[ER_MAX_ANGLES];
    for (int k = 0; k < sensitivity->count; k++) {
        int column = sensitivity->first + k;
        er_change change;
        er_change_nothing(&instance->model->robot, &change);
        known_along(instance, column, 1.0, &change);
        if (!er_equilibrium_along(instance->model, &change, sensitivity->x[column]))
            sensitivity->reason = "the stiffness is singular";
        er_stops_follow(&instance->model->robot, &instance->model->memory.state.stops, still,
                        sensitivity->x[column], sensitivity->elongation[column]);
        memcpy(change.x, sensitivity->x[column], sizeof change.x);
        memcpy(change.elongation, sensitivity->elongation[column], sizeof change.elongation);
        er_start_motors_along(instance->model, &change, &sensitivity->motors[column]);
    }
}

/* Has the columns of a cause, for the present state. */
static bool require_columns(er_instance *instance, er_cause cause)
{
    const er_cause first = first_beside(cause);
    const er_model *model = instance->model;
    const er_options *options = &model->memory.options;
    const er_step_start *start = er_step_start_of(instance);
    er_sensitivity *sensitivity = &instance->model->sensitivity;
    bool fixed = first == ER_BY_Q && options->trajectory[0] != '\0';
    if ((instance->columns & 1u << first) != 0)
        return true;
    start_columns(instance->model, first, start);
    if (!fixed && model->robot.elastics > 0) {
        if (start->stepped && !options->quasistatic) {
            if (!er_model_follow(instance->model, &start->state, &start->past, start->end,
                                 &start->command, &start->load, &instance->failure))
                return false;
        } else if (start->stepped || options->initial != ER_UNDEFLECTED) {
            follow_equilibrium(instance, sensitivity);
        }
    }
    if (sensitivity->reason != NULL)
        return er_fail(&instance->failure, "there are no derivatives at t = %.9g s: %s",
                       instance->progress.time, sensitivity->reason);
    instance->columns |= 1u << first;
    return true;
}

/* Adds what the time does to the drives. */
static void add_drives_by_time(const er_instance *instance, double seed, er_held *held)
{
    er_held by_time;
    er_model_held_by_time(instance->model, &by_time);
    for (int i = 0; i < instance->model->robot.joints; i++) {
        held->q[i] += seed * by_time.q[i];
        held->qd[i] += seed * by_time.qd[i];
        held->qdd[i] += seed * by_time.qdd[i];
    }
}

/* Adds how motors start along a change of drives and equilibrium. */
static void add_start_of_motors(const er_model *model, const er_change *along, double seed, er_change *change)
{
    er_motor_change start = {{0.0}, {0.0}, {0.0}};
    er_start_motors_along(model, along, &start);
    for (int d = 0; d < er_model_motors(model); d++) {
        change->motors.angle[d] += seed * start.angle[d];
        change->motors.rate[d] += seed * start.rate[d];
        change->motors.integral[d] += seed * start.integral[d];
    }
}

/* What the time alone changes: the drives of a trajectory, and with them a robot at rest. */
static bool add_time(er_instance *instance, double seed, er_change *change)
{
    const er_options *options = &instance->model->memory.options;
    bool stepped = er_step_start_of(instance)->stepped;
    double x[ER_MAX_ANGLES], still[ER_MAX_ANGLES] = {0.0};
    er_change by_time;
    add_drives_by_time(instance, seed, &change->held);
    if (er_exchange_runs(instance) || (stepped ? !options->quasistatic : options->initial == ER_UNDEFLECTED))
        return true;
    er_change_nothing(&instance->model->robot, &by_time);
    add_drives_by_time(instance, 1.0, &by_time.held);
    if (!er_equilibrium_along(instance->model, &by_time, x))
        return er_fail(&instance->failure, "there are no derivatives at t = %.9g s: the stiffness is"
                       " singular", instance->progress.time);
    memcpy(by_time.x, x, sizeof by_time.x);
    er_stops_follow(&instance->model->robot, &instance->model->memory.state.stops, still, x, by_time.elongation);
    add_start_of_motors(instance->model, &by_time, seed, change);
    for (int k = 0; k < instance->model->robot.elastics; k++) {
        x[k] *= seed;
        change->x[k] += x[k];
    }
    er_stops_follow(&instance->model->robot, &instance->model->memory.state.stops, still, x, change->elongation);
    return true;
}

/* Adds what one input, state or parameter does by itself, all else as it is. */
static void add_itself(const er_instance *instance, unsigned known, double seed, er_change *change)
{
    const er_block *block = er_block_of(&instance->interface, known);
    bool drives = block->kind == ER_INPUT && block->cause >= ER_BY_Q && block->cause <= ER_BY_QDD;
    if (!drives || instance->model->memory.options.trajectory[0] == '\0')
        ((double *)((char *)change + block->along))[er_entry(&instance->interface, known)] += seed;
}

/* Adds what one input or parameter has done over the last step, or to the initial state. */
static bool add_step(er_instance *instance, unsigned known, double seed, er_change *change)
{
    const er_sensitivity *sensitivity = &instance->model->sensitivity;
    const er_robot *robot = &instance->model->robot;
    er_cause cause = er_block_of(&instance->interface, known)->cause;
    int column = er_first_column(robot, cause) + er_entry(&instance->interface, known);
    if (!require_columns(instance, cause))
        return false;
    known_along(instance, column, seed, change);
    for (int k = 0; k < robot->elastics; k++) {
        change->x[k] += seed * sensitivity->x[column][k];
        change->v[k] += seed * sensitivity->v[column][k];
    }
    for (int j = 0; j < er_all_elements(robot); j++)
        change->elongation[j] += seed * sensitivity->elongation[column][j];
    for (int d = 0; d < er_model_motors(instance->model); d++) {
        int joint = robot->motor[d].joint;
        change->motors.angle[d] += seed * sensitivity->motors[column].angle[d];
        change->motors.rate[d] += seed * sensitivity->motors[column].rate[d];
        change->motors.integral[d] += seed * sensitivity->motors[column].integral[d];
        if (sensitivity->drive == ER_TORQUE) { /* the rigid robot goes with the motors */
            change->held.q[joint] += seed * sensitivity->motors[column].angle[d];
            change->held.qd[joint] += seed * sensitivity->motors[column].rate[d];
        }
    }
    return true;
}

/* The change of drives, load, state and parameters that a seed makes. */
static bool gather_change(er_instance *instance, const unsigned *knowns, size_t count,
                        const double *seed, er_change *change)
{
    er_change_nothing(&instance->model->robot, change);
    for (size_t j = 0; j < count; j++) {
        bool good = true;
        if (seed[j] == 0.0)
            continue;
        if (knowns[j] == er_time_reference(&instance->interface))
            good = add_time(instance, seed[j], change);
        else if (er_exchange_runs(instance) || er_is_state(&instance->interface, knowns[j]))
            add_itself(instance, knowns[j], seed[j], change);
        else
            good = add_step(instance, knowns[j], seed[j], change);
        if (!good)
            return false;
    }
    return true;
}

/* Derivatives of a block along a change. */
static bool block_along(er_instance *instance, int number, const er_change *change, double *out)
{
    return (!er_blocks[number].from_value || er_instance_require(instance, number)) &&
           er_block_along(instance, number, change, out);
}

bool er_instance_derivative(er_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity)
{
    double along[ER_MAX_REALS];
    uint64_t there = 0; /* blocks in `along`, a bit each */
    er_change change;
    if (!require_kinds(instance, unknowns, unknown_count, knowns, known_count, seed))
        return false;
    if (unknown_count == 0)
        return true;
    if (!er_instance_initialise(instance) || !er_exchange_hold(instance))
        return false;
    if (!gather_change(instance, knowns, known_count, seed, &change))
        return false;
    for (size_t i = 0; i < unknown_count; i++) {
        int block = instance->interface.block[unknowns[i]];
        if ((there & ER_BIT(block)) == 0 &&
            !block_along(instance, block, &change, along + instance->interface.first[block]))
            return false;
        there |= ER_BIT(block);
        sensitivity[i] = along[unknowns[i]];
    }
    return true;
}
