/* Real variables of an instance: inputs and parameters as they are set, outputs computed when read. */
#include <math.h>
#include <string.h>

#include "../core/free_motion.h"
#include "exchange.h"
#include "instance_variables.h"

/* An input, state or parameter by its value reference; NULL for what else is computed. */
static double *settable(er_instance *instance, int reference)
{
    er_block block = (er_block)instance->interface.block[reference];
    int k = reference - instance->interface.first[block];
    switch (block) {
    case ER_WRENCH: return &instance->inputs.load.wrench[k];
    case ER_Q_CMD: return &instance->inputs.command.q[k];
    case ER_QD_CMD: return &instance->inputs.command.qd[k];
    case ER_QDD_CMD: return &instance->inputs.command.qdd[k];
    case ER_ANCHOR: return &instance->inputs.load.anchor.position[k];
    case ER_ANCHOR_VELOCITY: return &instance->inputs.load.anchor.velocity[k];
    case ER_ANCHOR_STIFFNESS: return &instance->inputs.load.anchor.stiffness[k];
    case ER_WRENCH_RATE: return &instance->inputs.load.rate[k];
    case ER_CONTACT: return er_contact_entry(&instance->inputs.load.contact, k);
    case ER_CONTACT_NORMAL: return &instance->inputs.load.contact.normal[k];
    case ER_TCP_TOLERANCE: return &instance->inputs.tcp_tolerance;
    case ER_DEFLECTION: return &instance->model->memory.state.x[k];
    case ER_DEFLECTION_RATE: return &instance->model->memory.state.v[k];
    default: return er_parameter(&instance->interface, &instance->inputs.parameters, block, k);
    }
}

static bool find_acceleration(er_instance *instance, double *acceleration)
{
    er_model *model = instance->model;
    size_t bytes = (size_t)model->robot.elastics * sizeof *acceleration;
    memset(acceleration, 0, bytes);
    if (model->memory.options.quasistatic)
        return true;
    if (!er_free_motion_find(model))
        return er_fail(&instance->failure, "the elastic angles have no accelerations: the mass matrix is"
                       " singular");
    memcpy(acceleration, model->free.acceleration, bytes);
    return true;
}

static void find_contact_force(const er_model *model, double *force)
{
    er_contact_motion motion;
    double wrench[6];
    er_model_contact(model, &motion, wrench);
    memcpy(force, wrench, 3 * sizeof *force);
}

static bool compute_block(er_instance *instance, er_block block)
{
    er_model *model = instance->model;
    size_t elastics = (size_t)model->robot.elastics * sizeof(double);
    double *out = instance->outputs + instance->interface.first[block];
    switch (block) {
    case ER_TCP: er_model_tcp(model, out); return true;
    case ER_VELOCITY: er_model_velocity(model, out); return true;
    case ER_RIGID: er_model_rigid(model, out); return true;
    case ER_DEVIATION: er_model_deviation(model, out); return true;
    case ER_COMPLIANCE: return er_model_compliance(model, out, &instance->failure);
    case ER_DEFLECTION: memcpy(out, model->memory.state.x, elastics); return true;
    case ER_DEFLECTION_RATE:
    case ER_DEFLECTION_DERIVATIVE: memcpy(out, model->memory.state.v, elastics); return true;
    case ER_RATE_DERIVATIVE: return find_acceleration(instance, out);
    case ER_BEND: er_exchange_bends(instance, out); return true;
    case ER_CONTACT_FORCE: find_contact_force(model, out); return true;
    case ER_CONTACT_GAP: *out = er_exchange_contact_gap(instance); return true;
    default:
        return er_fail(&instance->failure, "%s has no value: expected one in instance_reals.c",
                       instance->interface.name[instance->interface.first[block]]);
    }
}

bool er_instance_require(er_instance *instance, er_block block)
{
    unsigned bit = 1u << block;
    if ((instance->fresh & bit) != 0) /* nothing has changed since */
        return true;
    if (!er_instance_initialise(instance) || !er_exchange_hold(instance) ||
        !compute_block(instance, block))
        return false;
    instance->fresh |= bit;
    return true;
}

static bool require_real(er_instance *instance, unsigned reference)
{
    if (reference < (unsigned)instance->interface.reals)
        return true;
    return er_fail(&instance->failure, "value reference of a real variable: expected 0 to %d, got %u",
                   instance->interface.reals - 1, reference);
}

/* States and inputs beyond all measure have no outputs. */
static bool require_finite(er_instance *instance, unsigned reference, double value)
{
    char number[ER_NUMBER_TEXT];
    return isfinite(value) ||
           er_fail(&instance->failure, "%s: expected a finite number, got %s %s: give inputs, parameters and"
                   " states of physical size", instance->interface.name[reference],
                   er_shown(value, number), instance->interface.unit[reference]);
}

bool er_instance_get_reals(er_instance *instance, const unsigned *references, size_t count,
                           double *values)
{
    for (size_t i = 0; i < count; i++)
        if (references[i] != er_time_reference(&instance->interface) &&
            !require_real(instance, references[i]))
            return false;
    for (size_t i = 0; i < count; i++) {
        er_block block;
        if (references[i] == er_time_reference(&instance->interface)) {
            values[i] = instance->progress.time;
            continue;
        }
        block = (er_block)instance->interface.block[references[i]];
        if (er_is_computed(block)) {
            if (!er_instance_require(instance, block) ||
                !require_finite(instance, references[i], instance->outputs[references[i]]))
                /* An integrator tries states; those of co-simulation are its own. */
                return er_exchange_runs(instance) && er_let_retry(&instance->failure);
            values[i] = instance->outputs[references[i]];
        } else {
            values[i] = *settable(instance, (int)references[i]);
        }
    }
    return true;
}

/* The input that is an input's first derivative, NULL where none is. */
static double *derivative_of(er_instance *instance, int reference)
{
    er_block block = (er_block)instance->interface.block[reference];
    int k = reference - instance->interface.first[block];
    switch (block) {
    case ER_WRENCH: return &instance->inputs.load.rate[k];
    case ER_QDD_CMD: return &instance->inputs.command.jerk[k];
    case ER_ANCHOR: return &instance->inputs.load.anchor.velocity[k];
    default: return NULL;
    }
}

static bool may_derive(er_instance *instance, unsigned reference, int order, double value)
{
    const er_interface *interface = &instance->interface;
    char number[ER_NUMBER_TEXT];
    if (!require_real(instance, reference))
        return false;
    if (!er_is_input((er_block)interface->block[reference]))
        return er_fail(&instance->failure, "derivative: expected that of an input, got %s",
                       interface->name[reference]);
    if (order != 1)
        return er_fail(&instance->failure, "derivative of %s: expected order 1, got %d",
                       interface->name[reference], order);
    return isfinite(value) ||
           er_fail(&instance->failure, "derivative of %s: expected a finite number, got %s",
                   interface->name[reference], er_shown(value, number));
}

bool er_instance_set_derivatives(er_instance *instance, const unsigned *references, size_t count,
                                 const int *orders, const double *values, const char **ignored)
{
    *ignored = NULL;
    for (size_t i = 0; i < count; i++)
        if (!may_derive(instance, references[i], orders[i], values[i]))
            return false;
    for (size_t i = 0; i < count; i++) {
        double *derivative = derivative_of(instance, (int)references[i]);
        if (derivative != NULL)
            *derivative = values[i];
        else if (*ignored == NULL)
            *ignored = instance->interface.name[references[i]];
    }
    return true;
}

static bool may_set(er_instance *instance, unsigned reference, double value)
{
    const er_interface *interface = &instance->interface;
    char number[ER_NUMBER_TEXT];
    er_block block;
    if (!require_real(instance, reference))
        return false;
    block = (er_block)interface->block[reference];
    if (er_is_input(block) && block != ER_CONTACT && isfinite(value))
        return true;
    if (er_is_computed(block) && !(er_is_state(block) && er_exchange_runs(instance)))
        return er_fail(&instance->failure, "%s is %s and cannot be set", interface->name[reference],
                       er_is_output(block) ? "an output" : "computed");
    if (block == ER_TCP_TOLERANCE && instance->progress.phase >= ER_RUNNING)
        return er_fail(&instance->failure, "%s is fixed; set it before initialisation ends",
                       interface->name[reference]);
    if (instance->progress.phase == ER_CONTINUOUS_MODE && !er_is_input(block) && !er_is_state(block))
        return er_fail(&instance->failure, "%s: expected event mode before a parameter changes, got"
                       " continuous-time mode", interface->name[reference]);
    if (!isfinite(value))
        er_fail(&instance->failure, "%s: expected a finite number, got %s %s",
                interface->name[reference], er_shown(value, number), interface->unit[reference]);
    else if (er_require_range(interface, reference, value, &instance->failure))
        return true;
    return er_let_retry(&instance->failure);
}

/* A drive that is told to go beyond its limits goes there: said once, until it is back. */
static void watch_limits(er_instance *instance, int reference)
{
    const er_interface *interface = &instance->interface;
    int i = reference - interface->first[ER_Q_CMD];
    const double *limit = interface->limit[i];
    double q = instance->inputs.command.q[i];
    unsigned bit = 1u << i;
    char low[ER_NUMBER_TEXT], high[ER_NUMBER_TEXT], number[ER_NUMBER_TEXT];
    if (q >= limit[0] && q <= limit[1]) {
        instance->beyond &= ~bit;
    } else if ((instance->beyond & bit) == 0) {
        instance->beyond |= bit;
        instance->warned = true;
        er_fail(&instance->failure, "%s: expected an angle within the drive's limits, %s to %s rad, got %s rad",
                interface->name[reference], er_shown(limit[0], low), er_shown(limit[1], high),
                er_shown(q, number));
    }
}

bool er_instance_set_reals(er_instance *instance, const unsigned *references, size_t count,
                           const double *values)
{
    instance->warned = false;
    for (size_t i = 0; i < count; i++)
        if (!may_set(instance, references[i], values[i]))
            return false;
    for (size_t i = 0; i < count; i++) {
        er_block block = (er_block)instance->interface.block[references[i]];
        *settable(instance, (int)references[i]) = values[i];
        if (block == ER_Q_CMD)
            watch_limits(instance, (int)references[i]);
        if (er_is_tunable(block))
            instance->progress.parameters_changed = true;
    }
    if (er_exchange_runs(instance))
        er_exchange_disturb(instance);
    if (instance->progress.phase < ER_RUNNING && count > 0) {
        instance->progress.computed = false;
        instance->fresh = 0;
    }
    return true;
}
