#include "instance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hash.h"

#define DEFAULT_TOLERANCE 1e-6
/* A communication step may start this far [s] from where the last one ended (rounding of sums). */
#define TIME_SLACK 1e-9
static const char *const curves[] = {"linear", "backlash", "spline"};
static const char *const modes[] = {"dynamic", "quasistatic"};
static const char *const initial_states[] = {"equilibrium", "undeflected"};

#define NUMBER_TEXT 32

/* A number as Python shows it: 1.0, -1e-09, nan. */
static const char *shown(double value, char text[NUMBER_TEXT])
{
    snprintf(text, NUMBER_TEXT, "%.12g", isnan(value) ? fabs(value) : value);
    if (isfinite(value) && strpbrk(text, ".,e") == NULL)
        strcat(text, ".0");
    return text;
}

static bool read_robot(er_instance *instance, const char *file, const char *guid)
{
    er_failure *failure = &instance->failure;
    er_robot *robot = malloc(sizeof *robot);
    bool good;
    if (robot == NULL)
        return er_fail(failure, "the robot does not fit into memory");
    good = er_robot_read(robot, file, failure);
    if (good && strcmp(robot->guid, guid) != 0)
        good = er_fail(failure, "the GUID is %.80s; this FMU's resources belong to %.80s; needed is"
                       " the GUID of its modelDescription.xml", guid, robot->guid);
    if (good) {
        size_t size = sizeof(er_saved_state);
        instance->print = er_hash(&size, sizeof size, er_hash(robot, sizeof *robot, ER_HASH_START));
        er_layout_of(robot, &instance->layout);
        instance->model = er_model_create(robot);
        good = instance->model != NULL || er_fail(failure, "the model does not fit into memory");
    }
    free(robot);
    if (good && strlen(file) < ER_MAX_PATH) {
        const char *behind = strrchr(file, '/');
        memcpy(instance->model->resources, file, behind == NULL ? 0 : (size_t)(behind + 1 - file));
    }
    return good;
}

er_instance *er_instance_create(const char *robot_file, const char *guid, er_failure *failure)
{
    er_instance *instance = calloc(1, sizeof *instance);
    if (instance == NULL) {
        er_fail(failure, "the instance does not fit into memory");
        return NULL;
    }
    if (!read_robot(instance, robot_file, guid)) {
        *failure = instance->failure;
        free(instance);
        return NULL;
    }
    er_instance_reset(instance);
    return instance;
}

void er_instance_free(er_instance *instance)
{
    if (instance != NULL)
        er_model_free(instance->model);
    free(instance);
}

void er_instance_reset(er_instance *instance)
{
    er_model *model = instance->model;
    memset(&instance->inputs, 0, sizeof instance->inputs);
    memset(&instance->progress, 0, sizeof instance->progress);
    memset(&instance->departure, 0, sizeof instance->departure);
    memset(&model->memory, 0, sizeof model->memory);
    instance->inputs.parameters = model->robot.parameters;
    model->memory.options.curve = ER_BACKLASH;
    model->memory.options.tolerance = DEFAULT_TOLERANCE;
    model->loaded_path[0] = '\0'; /* the file may change before it is wanted again */
    instance->fresh = 0;
}

bool er_instance_setup(er_instance *instance, double start, double tolerance)
{
    char number[NUMBER_TEXT];
    if (instance->progress.started)
        return er_fail(&instance->failure, "the experiment is set up after initialisation; needed is"
                       " to do so before");
    if (!isfinite(start))
        return er_fail(&instance->failure, "the start time is %s s; needed is a finite number",
                       shown(start, number));
    if (!isfinite(tolerance) || tolerance < 0.0)
        return er_fail(&instance->failure, "the tolerance is %s m; needed is a number > 0, or 0 for"
                       " %g m", shown(tolerance, number), DEFAULT_TOLERANCE);
    instance->progress.time = start;
    if (tolerance > 0.0)
        instance->model->memory.options.tolerance = tolerance;
    instance->progress.computed = false;
    instance->fresh = 0;
    return true;
}

/* One value of a block of parameters by its place, NULL if it is not a parameter. */
static double *parameter(er_instance *instance, er_parameters *parameters, er_block block, int k)
{
    switch (block) {
    case ER_GRAVITY: return &parameters->gravity[k];
    case ER_STIFFNESS: return &parameters->stiffness[k];
    case ER_DAMPING: return &parameters->damping[k];
    case ER_BACKLASH_WIDTH: return &parameters->backlash[instance->layout.twist[k]];
    default: return NULL;
    }
}

/* An input or parameter by its value reference; NULL for an output. */
static double *settable(er_instance *instance, int reference)
{
    er_block block = (er_block)instance->layout.block[reference];
    int k = reference - instance->layout.first[block];
    switch (block) {
    case ER_WRENCH: return &instance->inputs.wrench[k];
    case ER_Q_CMD: return &instance->inputs.command.q[k];
    case ER_QD_CMD: return &instance->inputs.command.qd[k];
    case ER_QDD_CMD: return &instance->inputs.command.qdd[k];
    default: return parameter(instance, &instance->inputs.parameters, block, k);
    }
}

static bool require_parameters(er_instance *instance)
{
    const er_layout *layout = &instance->layout;
    for (int reference = layout->first[ER_STIFFNESS]; reference < layout->first[ER_STRINGS];
         reference++) {
        bool stiffness = layout->block[reference] == ER_STIFFNESS;
        double value = *settable(instance, reference);
        if (stiffness ? !(value > 0.0) : !(value >= 0.0)) {
            char name[ER_VARIABLE_TEXT], number[NUMBER_TEXT];
            er_variable_name(layout, &instance->model->robot, reference, name);
            return er_fail(&instance->failure, "%s is %s %s; needed is a number %s", name,
                           shown(value, number),
                           er_variable_unit(layout, reference), stiffness ? "> 0" : ">= 0");
        }
    }
    return true;
}

static void depart(er_instance *instance, const er_state *state, double end, bool stepped)
{
    er_departure *departure = &instance->departure;
    departure->state = *state;
    departure->command = instance->inputs.command;
    memcpy(departure->wrench, instance->inputs.wrench, sizeof departure->wrench);
    departure->end = end;
    departure->stepped = stepped;
    instance->columns = 0;
}

/* Computes the initial state unless it is there. */
static bool initialise(er_instance *instance)
{
    er_model *model = instance->model;
    if (instance->progress.computed)
        return true;
    if (!require_parameters(instance))
        return false;
    model->memory.parameters = instance->inputs.parameters;
    if (!er_model_reset(model, instance->progress.time, &instance->inputs.command,
                        instance->inputs.wrench, &instance->failure))
        return false;
    depart(instance, &model->memory.state, instance->progress.time, false);
    instance->progress.computed = true;
    instance->progress.parameters_changed = false;
    instance->fresh = 0;
    return true;
}

bool er_instance_start(er_instance *instance)
{
    if (!initialise(instance))
        return false;
    instance->progress.started = true;
    return true;
}

static bool move(er_instance *instance, double end)
{
    er_model *model = instance->model;
    const er_state before = model->memory.state;
    if (!er_model_step(model, end, &instance->inputs.command, instance->inputs.wrench,
                       &instance->failure))
        return false;
    depart(instance, &before, end, true);
    return true;
}

/* After a refused step the model goes on with what it had, and the new parameters wait again. */
static bool move_with_new_parameters(er_instance *instance, double end)
{
    er_model *model = instance->model;
    const er_parameters parameters = model->memory.parameters;
    const er_state before = model->memory.state;
    if (!require_parameters(instance))
        return false;
    er_model_take_parameters(model, &instance->inputs.parameters);
    if (move(instance, end)) {
        instance->progress.parameters_changed = false;
        return true;
    }
    er_model_take_parameters(model, &parameters);
    model->memory.state = before;
    return false;
}

bool er_instance_step(er_instance *instance, double start, double size)
{
    er_progress *progress = &instance->progress;
    char number[NUMBER_TEXT], other[NUMBER_TEXT];
    double end = start + size;
    if (!progress->started)
        return er_fail(&instance->failure, "a step is asked for before initialisation has ended;"
                       " needed is to end it first");
    if (!isfinite(size) || size < 0.0)
        return er_fail(&instance->failure, "step size is %s s; needed is a finite number >= 0",
                       shown(size, number));
    if (!(fabs(start - progress->time) <= TIME_SLACK))
        return er_fail(&instance->failure, "the step starts at %s s; needed is the last step's end,"
                       " %s s", shown(start, number), shown(progress->time, other));
    if (size == 0.0)
        return true;
    if (!(progress->parameters_changed ? move_with_new_parameters(instance, end)
                                       : move(instance, end)))
        return false;
    progress->time = end;
    instance->fresh = 0;
    return true;
}

static bool compute_block(er_instance *instance, er_block block)
{
    const er_model *model = instance->model;
    double *out = instance->outputs + instance->layout.first[block];
    switch (block) {
    case ER_TCP: er_model_tcp(model, out); return true;
    case ER_VELOCITY: er_model_velocity(model, out); return true;
    case ER_RIGID: er_model_rigid(model, out); return true;
    case ER_DEVIATION: er_model_deviation(model, out); return true;
    case ER_COMPLIANCE: return er_model_compliance(model, out, &instance->failure);
    default:
        memcpy(out, model->memory.state.x, (size_t)model->robot.elastics * sizeof *out);
        return true;
    }
}

static bool require_block(er_instance *instance, er_block block)
{
    unsigned bit = 1u << block;
    if (!initialise(instance))
        return false;
    if ((instance->fresh & bit) == 0) {
        if (!compute_block(instance, block))
            return false;
        instance->fresh |= bit;
    }
    return true;
}

static bool require_real(er_instance *instance, unsigned reference)
{
    if (reference < (unsigned)er_real_count(&instance->layout))
        return true;
    return er_fail(&instance->failure, "the value reference %u is asked for as a real variable; this"
                   " FMU has 0 to %d", reference, er_real_count(&instance->layout) - 1);
}

bool er_instance_get_reals(er_instance *instance, const unsigned *references, size_t count,
                           double *values)
{
    for (size_t i = 0; i < count; i++) {
        er_block block;
        if (!require_real(instance, references[i]))
            return false;
        block = (er_block)instance->layout.block[references[i]];
        if (er_is_output(block)) {
            if (!require_block(instance, block))
                return false;
            values[i] = instance->outputs[references[i]];
        } else {
            values[i] = *settable(instance, (int)references[i]);
        }
    }
    return true;
}

static bool may_set(er_instance *instance, unsigned reference, double value)
{
    char name[ER_VARIABLE_TEXT], number[NUMBER_TEXT];
    if (!require_real(instance, reference))
        return false;
    if (er_is_output((er_block)instance->layout.block[reference])) {
        er_variable_name(&instance->layout, &instance->model->robot, (int)reference, name);
        return er_fail(&instance->failure, "%s is an output and cannot be set", name);
    }
    if (!isfinite(value)) {
        er_variable_name(&instance->layout, &instance->model->robot, (int)reference, name);
        return er_fail(&instance->failure, "%s is %s %s; needed is a finite number", name,
                       shown(value, number),
                       er_variable_unit(&instance->layout, (int)reference));
    }
    return true;
}

bool er_instance_set_reals(er_instance *instance, const unsigned *references, size_t count,
                           const double *values)
{
    for (size_t i = 0; i < count; i++)
        if (!may_set(instance, references[i], values[i]))
            return false;
    for (size_t i = 0; i < count; i++) {
        *settable(instance, (int)references[i]) = values[i];
        if (!er_is_input((er_block)instance->layout.block[references[i]]))
            instance->progress.parameters_changed = true;
    }
    if (!instance->progress.started && count > 0) {
        instance->progress.computed = false;
        instance->fresh = 0;
    }
    return true;
}

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
    if (instance->progress.started)
        return er_fail(&instance->failure,
                       "strings are fixed; set them before initialisation ends");
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
