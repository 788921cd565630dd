/* String variables of an instance: what is fixed when initialisation ends. */
#include <string.h>

#include "instance_variables.h"

static const char *const curves[] = {"linear", "backlash", "spline"};
static const char *const modes[] = {"dynamic", "quasistatic"};
static const char *const initial_states[] = {"equilibrium", "undeflected"};

static bool require_string(er_instance *instance, unsigned reference, int *which)
{
    unsigned first = (unsigned)instance->layout.first[ER_STRINGS];
    *which = (int)(reference - first);
    if (reference >= first && reference - first < ER_STRING_COUNT)
        return true;
    return er_fail(&instance->failure, "the value reference %u is asked for as a string variable;"
                   " this FMU has %u to %u", reference, first, first + ER_STRING_COUNT - 1);
}

bool er_instance_get_string(er_instance *instance, unsigned reference, const char **value)
{
    const er_options *options = &instance->model->memory.options;
    int which;
    if (!require_string(instance, reference, &which))
        return false;
    switch (which) {
    case ER_TRAJECTORY: *value = options->trajectory; break;
    case ER_TORQUE_CURVE: *value = curves[options->curve]; break;
    case ER_MODE: *value = modes[options->quasistatic]; break;
    default: *value = initial_states[options->undeflected];
    }
    return true;
}

/* Place of a text among the known ones, or -1 and a sentence. */
static int choice(er_instance *instance, const char *name, const char *value,
                  const char *const *known, int count)
{
    char list[80] = "";
    for (int k = 0; k < count; k++) {
        if (strcmp(value, known[k]) == 0)
            return k;
        strcat(strcat(list, k > 0 ? ", " : ""), known[k]);
    }
    er_fail(&instance->failure, "%s is '%.200s'; needed is one of %s", name, value, list);
    return -1;
}

static bool set_trajectory(er_instance *instance, const char *value)
{
    er_options *options = &instance->model->memory.options;
    if (strlen(value) >= ER_MAX_PATH)
        return er_fail(&instance->failure, "trajectory has %lu characters; needed are less than %d",
                       (unsigned long)strlen(value), ER_MAX_PATH);
    memset(options->trajectory, 0, sizeof options->trajectory);
    strcpy(options->trajectory, value);
    return true;
}

bool er_instance_set_string(er_instance *instance, unsigned reference, const char *value)
{
    er_options *options = &instance->model->memory.options;
    int which, chosen;
    if (!require_string(instance, reference, &which))
        return false;
    if (value == NULL)
        return er_fail(&instance->failure, "a string is set to nothing; needed is a text");
    switch (which) {
    case ER_TRAJECTORY:
        if (!set_trajectory(instance, value))
            return false;
        break;
    case ER_TORQUE_CURVE:
        if ((chosen = choice(instance, "torque_curve", value, curves, 3)) < 0)
            return false;
        options->curve = (er_curve_kind)chosen;
        break;
    case ER_MODE:
        if ((chosen = choice(instance, "mode", value, modes, 2)) < 0)
            return false;
        options->quasistatic = chosen == 1;
        break;
    default:
        if ((chosen = choice(instance, "initial_state", value, initial_states, 2)) < 0)
            return false;
        options->undeflected = chosen == 1;
    }
    instance->progress.computed = false;
    instance->fresh = 0;
    return true;
}
