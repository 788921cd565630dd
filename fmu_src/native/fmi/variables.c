/* Variables of an instance: inputs and parameters as they are set, outputs computed when read, strings fixed
 * when initialisation ends. */
#include <math.h>
#include <string.h>

#include "../io/file.h"
#include "variables.h"
#include "exchange.h"
#include "blocks.h"

/* How many of some references, from the first on, follow one another in a block: its values lie so as well. */
static size_t run_of(const er_interface *in, const unsigned *references, size_t count)
{
    int block = in->block[references[0]];
    size_t left = (size_t)(in->first[block] + in->size[block]) - references[0], run = 1;
    if ((er_blocks[block].torsion > 0 || er_blocks[block].hysteretic > 0) && !er_is_computed(&er_blocks[block]))
        return 1;
    while (run < count && run < left && references[run] == references[0] + run)
        run++;
    return run;
}

bool er_instance_require(er_instance *instance, int block)
{
    uint64_t bit = ER_BIT(block);
    if ((instance->fresh & bit) != 0) /* nothing has changed since */
        return true;
    if (!er_instance_initialise(instance) || !er_exchange_hold(instance) ||
        !er_block_find(instance, block, instance->outputs + instance->interface.first[block]))
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

/* Values of a block's variables that follow one another. */
static bool get_run(er_instance *instance, unsigned first, size_t count, double *values)
{
    int block = instance->interface.block[first];
    if (!er_is_computed(&er_blocks[block])) {
        memcpy(values, er_block_value(instance, first), count * sizeof *values);
        return true;
    }
    if (!er_instance_require(instance, block))
        return false;
    for (size_t k = 0; k < count; k++)
        if (!require_finite(instance, first + (unsigned)k, instance->outputs[first + k]))
            return false;
    memcpy(values, instance->outputs + first, count * sizeof *values);
    return true;
}

bool er_instance_get_reals(er_instance *instance, const unsigned *references, size_t count, double *values)
{
    const unsigned time = er_time_reference(&instance->interface);
    size_t run;
    for (size_t i = 0; i < count; i++)
        if (references[i] != time && !require_real(instance, references[i]))
            return false;
    for (size_t i = 0; i < count; i += run) {
        run = 1;
        if (references[i] == time) {
            values[i] = instance->progress.time;
            continue;
        }
        run = run_of(&instance->interface, references + i, count - i);
        if (!get_run(instance, references[i], run, values + i))
            /* An integrator tries states; those of co-simulation are its own. */
            return er_exchange_runs(instance) && er_let_retry(&instance->failure);
    }
    return true;
}

static bool may_derive(er_instance *instance, unsigned reference, int order, double value)
{
    const er_interface *interface = &instance->interface;
    char number[ER_NUMBER_TEXT];
    if (!require_real(instance, reference))
        return false;
    if (er_block_of(interface, reference)->kind != ER_INPUT)
        return er_fail(&instance->failure, "derivative: expected that of an input, got %s", interface->name[reference]);
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
        size_t place = er_block_of(&instance->interface, references[i])->rate;
        if (place > 0)
            *er_input_at(instance, place, er_entry(&instance->interface, references[i])) = values[i];
        else if (*ignored == NULL)
            *ignored = instance->interface.name[references[i]];
    }
    return true;
}

/* Whether variables like this one may be set now. */
static bool may_set(er_instance *instance, unsigned reference)
{
    const er_interface *interface = &instance->interface;
    const er_block *block = er_block_of(interface, reference);
    const bool state = er_is_state(interface, reference);
    if (er_is_computed(block) && !(state && er_exchange_runs(instance)))
        return er_fail(&instance->failure, "%s is %s and cannot be set", interface->name[reference],
                       block->kind == ER_OUTPUT ? "an output" : "computed");
    if (block->kind == ER_FIXED && instance->progress.phase >= ER_RUNNING)
        return er_fail(&instance->failure, "%s is fixed; set it before initialisation ends",
                       interface->name[reference]);
    return instance->progress.phase != ER_CONTINUOUS_MODE || block->kind == ER_INPUT || state ||
           er_fail(&instance->failure, "%s: expected event mode before a parameter changes, got continuous-time mode",
                   interface->name[reference]);
}

/* Whether a variable may have a value. */
static bool may_be(er_instance *instance, unsigned reference, double value)
{
    const er_interface *interface = &instance->interface;
    char number[ER_NUMBER_TEXT];
    if (!isfinite(value))
        er_fail(&instance->failure, "%s: expected a finite number, got %s %s",
                interface->name[reference], er_shown(value, number), interface->unit[reference]);
    else if (er_require_range(interface, reference, value, &instance->failure))
        return true;
    return er_let_retry(&instance->failure);
}

bool er_instance_set_reals(er_instance *instance, const unsigned *references, size_t count, const double *values)
{
    const er_interface *interface = &instance->interface;
    size_t run;
    instance->warned = false;
    for (size_t i = 0; i < count; i += run) {
        if (!require_real(instance, references[i]) || !may_set(instance, references[i]))
            return false;
        run = run_of(interface, references + i, count - i);
        for (size_t k = i; k < i + run; k++)
            if (!may_be(instance, references[k], values[k]))
                return false;
    }
    for (size_t i = 0; i < count; i += run) {
        const er_block *block = er_block_of(interface, references[i]);
        run = run_of(interface, references + i, count - i);
        memcpy(er_block_value(instance, references[i]), values + i, run * sizeof *values);
        for (size_t k = i; block->watch != NULL && k < i + run; k++)
            block->watch(instance, (int)references[k]);
        if (block->kind == ER_TUNABLE)
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

static bool require_string(er_instance *instance, unsigned reference, unsigned *which)
{
    unsigned first = (unsigned)instance->interface.reals;
    *which = reference - first;
    if (reference >= first && *which < ER_STRINGS)
        return true;
    return er_fail(&instance->failure, "value reference of a string variable: expected %u to %u, got %u",
                   first, first + ER_STRINGS - 1, reference);
}

bool er_instance_get_string(er_instance *instance, unsigned reference, const char **value)
{
    const er_options *options = &instance->model->memory.options;
    const int chosen[ER_STRINGS] = {0, options->curve, options->quasistatic, options->initial,
                                    options->drive};
    unsigned which;
    if (!require_string(instance, reference, &which))
        return false;
    *value = which == ER_TRAJECTORY ? options->trajectory
                                    : instance->interface.string[which].choice[chosen[which]];
    return true;
}

/* Place of a text among a string's choices, or -1 and a sentence. */
static int find_choice(er_instance *instance, const er_string *string, const char *value)
{
    char list[ER_MAX_CHOICES * (ER_CHOICE + 2)] = "";
    for (int k = 0; k < string->choices; k++) {
        if (strcmp(value, string->choice[k]) == 0)
            return k;
        strcat(strcat(list, k > 0 ? ", " : ""), string->choice[k]);
    }
    er_fail(&instance->failure, "%s: expected one of %s, got '%.200s'", string->name, list, value);
    return -1;
}

static bool set_trajectory_option(er_instance *instance, er_options *options, const char *value)
{
    if (strlen(value) >= ER_MAX_PATH)
        return er_fail(&instance->failure, "%s: expected less than %d characters, got %lu",
                       instance->interface.string[ER_TRAJECTORY].name, ER_MAX_PATH, (unsigned long)strlen(value));
    memset(options->trajectory, 0, sizeof options->trajectory);
    strcpy(options->trajectory, value);
    return true;
}

static bool set_option(er_instance *instance, er_options *options, unsigned reference, const char *value)
{
    unsigned which;
    int chosen = 0;
    if (!require_string(instance, reference, &which))
        return false;
    if (value == NULL)
        return er_fail(&instance->failure, "%s: expected a text, got NULL", instance->interface.string[which].name);
    if (!er_is_utf8(value))
        return er_fail(&instance->failure, "%s: expected UTF-8, got other bytes",
                       instance->interface.string[which].name) ||
               er_let_retry(&instance->failure);
    if (which == ER_TRAJECTORY)
        return set_trajectory_option(instance, options, value) || er_let_retry(&instance->failure);
    chosen = find_choice(instance, &instance->interface.string[which], value);
    switch (which) {
    case ER_TORQUE_CURVE: options->curve = chosen; break;
    case ER_MODE: options->quasistatic = chosen == 1; break;
    case ER_DRIVE: options->drive = (er_drive_kind)(chosen > 0 ? chosen : 0); break;
    case ER_INITIAL_STATE: options->initial = (er_initial)(chosen > 0 ? chosen : 0); break;
    }
    return chosen >= 0 || er_let_retry(&instance->failure);
}

bool er_instance_set_strings(er_instance *instance, const unsigned *references, size_t count, const char *const *values)
{
    er_options options = instance->model->memory.options;
    for (size_t i = 0; i < count; i++)
        if (!set_option(instance, &options, references[i], values[i]))
            return false;
    if (count == 0)
        return true;
    instance->model->memory.options = options;
    instance->progress.computed = false;
    instance->fresh = 0;
    return true;
}
