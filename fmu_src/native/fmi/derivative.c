/* Directional derivatives: how the outputs follow the inputs and parameters that the last step, or the
 * initial state, was computed from; and how they are a function of state and time.
 *
 * A step is computed again from where it began, with the sensitivities of its state carried along,
 * for all entries of the wrench or of the command, say, at once.  They serve until the state changes.
 */
#include "derivative.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "../core/free_motion.h"
#include "exchange.h"
#include "instance_variables.h"

/* Columns that are computed together. */
typedef enum {
    OF_WRENCH,
    OF_COMMAND,
    OF_ANCHOR,
    OF_SPRING,
    OF_RATE,
    OF_CONTACT,
    OF_GRAVITY,
    OF_STIFFNESS, /* of the joints, as the next */
    OF_DAMPING,
    OF_BACKLASH,
    GROUPS
} column_group;

/* The first column of a group, or behind the last one. */
static int first_of(const er_robot *robot, column_group group)
{
    const int first[] = {0, ER_WRENCH_COLUMNS, er_anchor_column(robot), er_stiffness_column(robot),
                         er_rate_column(robot), er_contact_column(robot), er_gravity_column(robot),
                         er_elastic_column(robot, 0),
                         er_elastic_column(robot, 1), er_elastic_column(robot, 2),
                         er_elastic_column(robot, 3)};
    return first[group];
}

static column_group group_of(const er_robot *robot, int column)
{
    column_group group = OF_WRENCH;
    while (column >= first_of(robot, group + 1))
        group++;
    return group;
}

static void start_group(er_model *model, column_group group, const er_step_start *start)
{
    const er_robot *robot = &model->robot;
    double time = start->state.time;
    int first = first_of(robot, group);
    er_sensitivity_start(&model->sensitivity, first, first_of(robot, group + 1) - first, time);
    if (group == OF_COMMAND)
        er_command_along(robot, &start->past, &start->command,
                         start->stepped ? start->end - time : 0.0, model->sensitivity.commanded);
}

static bool is(const er_instance *instance, unsigned reference, bool (*kind)(er_block))
{
    return reference < (unsigned)instance->interface.reals &&
           kind((er_block)instance->interface.block[reference]);
}

/* In initialisation mode states are unknowns. */
static bool is_known(const er_instance *instance, unsigned reference)
{
    return is(instance, reference, er_is_input) || is(instance, reference, er_is_tunable) ||
           reference == er_time_reference(&instance->interface) ||
           (instance->progress.phase >= ER_RUNNING && is(instance, reference, er_is_state));
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
    for (size_t i = 0; i < unknown_count; i++)
        if (!is(instance, unknowns[i], er_is_computed))
            return er_fail(&instance->failure, "derivative: expected an output to differentiate, got"
                           " %s", name_of(instance, unknowns[i], text));
    for (size_t j = 0; j < known_count; j++) {
        if (!is_known(instance, knowns[j]))
            return er_fail(&instance->failure, "derivative: expected an input, a tunable parameter, time or,"
                           " behind initialisation, a state to differentiate by, got %s",
                           name_of(instance, knowns[j], text));
        if (!isfinite(seed[j]))
            return er_fail(&instance->failure, "the seed of %s is not finite",
                           name_of(instance, knowns[j], text));
    }
    return true;
}

static int column_of(const er_instance *instance, unsigned reference)
{
    const er_interface *interface = &instance->interface;
    const er_robot *robot = &instance->model->robot;
    int block = interface->block[reference], k = (int)reference - interface->first[block];
    switch (block) {
    case ER_WRENCH: return k;
    case ER_ANCHOR: return er_anchor_column(robot) + k;
    case ER_ANCHOR_VELOCITY: return er_anchor_column(robot) + 3 + k;
    case ER_ANCHOR_STIFFNESS: return er_stiffness_column(robot) + k;
    case ER_WRENCH_RATE: return er_rate_column(robot) + k;
    case ER_CONTACT: return er_contact_column(robot) + k;
    case ER_CONTACT_NORMAL: return er_contact_column(robot) + 5 + k;
    case ER_GRAVITY: return er_gravity_column(robot) + k;
    case ER_STIFFNESS: return er_elastic_column(robot, 0) + k;
    case ER_DAMPING: return er_elastic_column(robot, 1) + k;
    case ER_BACKLASH_WIDTH: return er_elastic_column(robot, 2) + interface->torsion[k];
    default: return ER_WRENCH_COLUMNS + (block - ER_Q_CMD) * robot->joints + k;
    }
}

/* The column's unit change of what is held at the present time, and of parameters. */
static void known_along(const er_instance *instance, int column, double factor, er_change *change)
{
    const er_model *model = instance->model;
    er_held *held = &change->held;
    const er_step_start *start = &instance->step_start;
    double elapsed = start->stepped ? start->end - start->state.time : 0.0;
    er_share share = er_share_of(&model->sensitivity, &model->robot, column, elapsed);
    er_parameter_along(&model->robot, column, factor, &change->parameters);
    for (int k = 0; k < 6; k++)
        held->load.wrench[k] += factor * share.load.wrench[k];
    for (int c = 0; c < 3; c++) {
        held->load.anchor.position[c] += factor * share.load.anchor.position[c];
        held->load.anchor.velocity[c] += factor * share.load.anchor.velocity[c];
    }
    for (int k = 0; k < ER_CONTACT_COLUMNS; k++)
        *er_contact_entry(&held->load.contact, k) += factor * *er_contact_entry(&share.load.contact, k);
    for (int k = 0; k < ER_SYMMETRIC; k++)
        held->load.anchor.stiffness[k] += factor * share.load.anchor.stiffness[k];
    /* Along a trajectory commands are not looked at. */
    if (share.joint >= 0 && model->memory.options.trajectory[0] == '\0') {
        held->q[share.joint] += factor * share.q;
        held->qd[share.joint] += factor * share.qd;
        held->qdd[share.joint] += factor * share.qdd;
    }
}

static void follow_equilibrium(er_instance *instance, er_sensitivity *sensitivity)
{
    for (int k = 0; k < sensitivity->count; k++) {
        int column = sensitivity->first + k;
        er_change change;
        memset(&change, 0, sizeof change);
        known_along(instance, column, 1.0, &change);
        if (!er_equilibrium_along(instance->model, &change, sensitivity->x[column]))
            sensitivity->reason = "the stiffness is singular";
    }
}

/* Has the columns of a group, for the present state. */
static bool require_columns(er_instance *instance, column_group group)
{
    const er_model *model = instance->model;
    const er_options *options = &model->memory.options;
    const er_step_start *start = &instance->step_start;
    er_sensitivity *sensitivity = &instance->model->sensitivity;
    bool fixed = group == OF_COMMAND && options->trajectory[0] != '\0';
    if ((instance->columns & 1u << group) != 0)
        return true;
    start_group(instance->model, group, start);
    if (!fixed && model->robot.elastics > 0) {
        if (start->stepped && !options->quasistatic) {
            if (!er_model_follow(instance->model, &start->state, &start->past, start->end,
                                 &start->command, &start->load, &instance->failure))
                return false;
        } else if (start->stepped || !options->undeflected) {
            follow_equilibrium(instance, sensitivity);
        }
    }
    if (sensitivity->reason != NULL)
        return er_fail(&instance->failure, "there are no derivatives at t = %.9g s: %s",
                       instance->progress.time, sensitivity->reason);
    instance->columns |= 1u << group;
    return true;
}

/* What the time alone changes: the drives of a trajectory, and with them a robot at rest. */
static bool add_time(er_instance *instance, double seed, er_change *change)
{
    const er_options *options = &instance->model->memory.options;
    bool stepped = instance->step_start.stepped;
    double x[ER_MAX_ANGLES];
    er_change by_time;
    memset(&by_time, 0, sizeof by_time);
    er_exchange_by_time(instance, 1.0, &by_time.held);
    for (int i = 0; i < instance->model->robot.joints; i++) {
        change->held.q[i] += seed * by_time.held.q[i];
        change->held.qd[i] += seed * by_time.held.qd[i];
        change->held.qdd[i] += seed * by_time.held.qdd[i];
    }
    if (stepped ? !options->quasistatic : options->undeflected)
        return true;
    if (!er_equilibrium_along(instance->model, &by_time, x))
        return er_fail(&instance->failure, "there are no derivatives at t = %.9g s: the stiffness is"
                       " singular", instance->progress.time);
    for (int k = 0; k < instance->model->robot.elastics; k++)
        change->x[k] += seed * x[k];
    return true;
}

/* The change of drives, wrench, state and parameters that a seed makes. */
static bool find_change(er_instance *instance, const unsigned *knowns, size_t count,
                        const double *seed, er_change *change)
{
    const er_sensitivity *sensitivity = &instance->model->sensitivity;
    memset(change, 0, sizeof *change);
    for (size_t j = 0; j < count; j++) {
        int column;
        if (seed[j] == 0.0)
            continue;
        if (knowns[j] == er_time_reference(&instance->interface)) {
            if (!add_time(instance, seed[j], change))
                return false;
            continue;
        }
        if (er_is_state((er_block)instance->interface.block[knowns[j]])) {
            er_exchange_add(instance, knowns[j], seed[j], change);
            continue;
        }
        column = column_of(instance, knowns[j]);
        if (!require_columns(instance, group_of(&instance->model->robot, column)))
            return false;
        known_along(instance, column, seed[j], change);
        for (int k = 0; k < instance->model->robot.elastics; k++) {
            change->x[k] += seed[j] * sensitivity->x[column][k];
            change->v[k] += seed[j] * sensitivity->v[column][k];
        }
    }
    return true;
}

static bool acceleration_along(er_instance *instance, const er_change *change, double *out)
{
    er_model *model = instance->model;
    memset(out, 0, (size_t)model->robot.elastics * sizeof *out);
    if (model->memory.options.quasistatic)
        return true;
    if (!er_instance_require(instance, ER_RATE_DERIVATIVE))
        return false;
    er_free_motion_along(model, change, out);
    return true;
}

/* Changes of the contact's force and of the way to its plane. */
static void contact_along(const er_instance *instance, const er_change *change, double force[3], double *gap)
{
    const er_model *model = instance->model;
    const er_robot *robot = &model->robot;
    const er_load *load = &model->memory.held.load;
    bool still = model->memory.options.quasistatic;
    er_load along = change->held.load;
    er_contact_motion motion;
    er_touch touch;
    double theta[ER_MAX_ANGLES], rate[ER_MAX_ANGLES] = {0.0}, wrench[6];
    memset(force, 0, 3 * sizeof *force);
    *gap = 0.0;
    if (!er_contact_holds(&load->contact))
        return;
    er_model_contact(model, &motion, wrench);
    er_angles(robot, change->held.q, change->x, theta);
    if (still)
        memset(along.anchor.velocity, 0, sizeof along.anchor.velocity);
    else
        er_angles(robot, change->held.qd, change->v, rate);
    er_contact_place_along(robot, load, &motion, theta, rate, &along, &touch);
    *gap = -touch.depth;
    if (!(motion.touch.depth > 0.0))
        return;
    er_contact_wrench_along(robot, load, &motion, theta, rate, &along, wrench);
    memcpy(force, wrench, 3 * sizeof *force);
}

static bool block_along(er_instance *instance, er_block block, const er_change *change, double *out)
{
    er_model *model = instance->model;
    size_t elastics = (size_t)model->robot.elastics * sizeof *out;
    double gap, force[3];
    switch (block) {
    case ER_TCP: er_tcp_along(model, change, out); return true;
    case ER_VELOCITY: er_velocity_along(model, change, out); return true;
    case ER_RIGID: er_rigid_along(model, change, out); return true;
    case ER_DEVIATION: er_deviation_along(model, change, out); return true;
    case ER_COMPLIANCE:
        return er_compliance_along(model, change, out) ||
               er_fail(&instance->failure, "the compliance has no derivative here; the robot's"
                       " stiffness is singular");
    case ER_DEFLECTION: memcpy(out, change->x, elastics); return true;
    case ER_DEFLECTION_RATE:
    case ER_DEFLECTION_DERIVATIVE: memcpy(out, change->v, elastics); return true;
    case ER_RATE_DERIVATIVE: return acceleration_along(instance, change, out);
    case ER_BEND: er_exchange_bends_along(instance, change, out); return true;
    case ER_CONTACT_FORCE: contact_along(instance, change, out, &gap); return true;
    case ER_CONTACT_GAP: contact_along(instance, change, force, out); return true;
    default:
        return er_fail(&instance->failure, "%s has no derivative; expected another output",
                       instance->interface.name[instance->interface.first[block]]);
    }
}

bool er_instance_derivative(er_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed,
                            double *sensitivity)
{
    double along[ER_MAX_REALS];
    unsigned there = 0; /* blocks in `along`, a bit each */
    er_change change;
    if (!require_kinds(instance, unknowns, unknown_count, knowns, known_count, seed))
        return false;
    if (unknown_count == 0)
        return true;
    if (!er_instance_initialise(instance) || !er_exchange_hold(instance))
        return false;
    if (er_exchange_runs(instance))
        er_exchange_change(instance, knowns, known_count, seed, &change);
    else if (!find_change(instance, knowns, known_count, seed, &change))
        return false;
    for (size_t i = 0; i < unknown_count; i++) {
        er_block block = (er_block)instance->interface.block[unknowns[i]];
        if ((there & 1u << block) == 0 &&
            !block_along(instance, block, &change, along + instance->interface.first[block]))
            return false;
        there |= 1u << block;
        sensitivity[i] = along[unknowns[i]];
    }
    return true;
}
