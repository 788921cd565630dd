/* String variables of an instance: what is fixed when initialisation ends. */
#include <string.h>

#include "instance_variables.h"
#include "../io/file.h"

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
    const int chosen[ER_STRINGS] = {0, options->curve, options->quasistatic, options->undeflected};
    unsigned which;
    if (!require_string(instance, reference, &which))
        return false;
    *value = which == ER_TRAJECTORY ? options->trajectory
                                    : instance->interface.string[which].choice[chosen[which]];
    return true;
}

/* Place of a text among a string's choices, or -1 and a sentence. */
static int choose(er_instance *instance, const er_string *string, const char *value)
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

static bool set_trajectory(er_instance *instance, er_options *options, const char *value)
{
    if (strlen(value) >= ER_MAX_PATH)
        return er_fail(&instance->failure, "%s: expected less than %d characters, got %lu",
                       instance->interface.string[ER_TRAJECTORY].name, ER_MAX_PATH,
                       (unsigned long)strlen(value));
    memset(options->trajectory, 0, sizeof options->trajectory);
    strcpy(options->trajectory, value);
    return true;
}

static bool set_string(er_instance *instance, er_options *options, unsigned reference,
                       const char *value)
{
    unsigned which;
    int chosen = 0;
    if (!require_string(instance, reference, &which))
        return false;
    if (value == NULL)
        return er_fail(&instance->failure, "%s: expected a text, got NULL",
                       instance->interface.string[which].name);
    if (!er_is_utf8(value))
        return er_fail(&instance->failure, "%s: expected UTF-8, got other bytes",
                       instance->interface.string[which].name) ||
               er_let_retry(&instance->failure);
    if (which == ER_TRAJECTORY)
        return set_trajectory(instance, options, value) || er_let_retry(&instance->failure);
    chosen = choose(instance, &instance->interface.string[which], value);
    switch (which) {
    case ER_TORQUE_CURVE: options->curve = chosen; break;
    case ER_MODE: options->quasistatic = chosen == 1; break;
    case ER_INITIAL_STATE: options->undeflected = chosen == 1; break;
    }
    return chosen >= 0 || er_let_retry(&instance->failure);
}

bool er_instance_set_strings(er_instance *instance, const unsigned *references, size_t count,
                             const char *const *values)
{
    er_options options = instance->model->memory.options;
    for (size_t i = 0; i < count; i++)
        if (!set_string(instance, &options, references[i], values[i]))
            return false;
    if (count == 0)
        return true;
    instance->model->memory.options = options;
    instance->progress.computed = false;
    instance->fresh = 0;
    return true;
}
