#include "instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../core/growth.h"
#include "../io/file.h"

/* The file holds the robot and, behind it, the variables. */
static bool read_file(er_instance *instance, er_robot *robot, const char *file)
{
    size_t size;
    er_failure reason;
    char *text = er_read_file(file, &size, &reason);
    er_lines lines;
    bool good;
    if (text == NULL)
        return er_fail(&instance->failure, "the robot's data %.500s: %.500s", file, reason.text);
    er_lines_start(&lines, text, &instance->failure);
    good = er_robot_parse(robot, &lines) &&
           er_interface_parse(&instance->interface, robot, &lines);
    free(text);
    return good;
}

/* The folder of the robot's file is that of the resources. */
static bool keep_folder(er_instance *instance, const char *file)
{
    const char *end = strrchr(file, '/');
    size_t length = end == NULL ? 0 : (size_t)(end + 1 - file);
    char *folder = calloc(1, length + 1);
    if (folder == NULL)
        return er_fail(&instance->failure, "the path of the resources does not fit into memory");
    memcpy(folder, file, length);
    instance->model->resources = folder;
    return true;
}

static bool read_robot(er_instance *instance, const char *file, const char *guid)
{
    er_failure *failure = &instance->failure;
    er_robot *robot = malloc(sizeof *robot);
    bool good;
    if (robot == NULL)
        return er_fail(failure, "the robot does not fit into memory");
    good = read_file(instance, robot, file);
    if (good && strcmp(robot->guid, guid) != 0)
        good = er_fail(failure, "GUID: expected that of this FMU's modelDescription.xml, %.80s, got"
                       " %.80s", robot->guid, guid);
    if (good) {
        instance->fingerprint = er_hash(robot, sizeof *robot);
        instance->model = er_model_create(robot);
        good = instance->model != NULL || er_fail(failure, "the model does not fit into memory");
    }
    free(robot);
    return good && keep_folder(instance, file);
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
        er_instance_free(instance);
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
    const er_interface *interface = &instance->interface;
    er_model *model = instance->model;
    memset(&instance->inputs, 0, sizeof instance->inputs);
    for (int i = 0; i < ER_MAX_JOINTS; i++)
        instance->inputs.command.jerk[i] = NAN;
    instance->inputs.load.contact = er_contact_none();
    memset(&instance->progress, 0, sizeof instance->progress);
    instance->progress.stop = INFINITY;
    memset(instance->step_start, 0, sizeof instance->step_start);
    memset(&model->memory, 0, sizeof model->memory);
    instance->inputs.parameters = model->robot.parameters;
    strcpy(model->memory.options.trajectory, interface->string[ER_TRAJECTORY].text);
    model->memory.options.curve = interface->string[ER_TORQUE_CURVE].start;
    model->memory.options.quasistatic = interface->string[ER_MODE].start == 1;
    model->memory.options.drive = (er_drive_kind)interface->string[ER_DRIVE].start;
    model->memory.options.initial = (er_initial)interface->string[ER_INITIAL_STATE].start;
    model->memory.options.tolerance = interface->tolerance.usual;
    instance->exchange.held = false;
    memset(instance->exchange.piece, 0, sizeof instance->exchange.piece);
    model->loaded_path[0] = '\0'; /* the file may change before it is wanted again */
    instance->over_limit = 0;
    instance->jumps = 0;
    instance->warned = false;
    instance->fresh = 0;
}

bool er_instance_setup(er_instance *instance, double start, double stop, double tolerance)
{
    char number[ER_NUMBER_TEXT], other[ER_NUMBER_TEXT];
    if (!isfinite(start))
        return er_fail(&instance->failure, "start time: expected a finite number, got %s s", er_shown(start, number));
    if (!(stop >= start))
        return er_fail(&instance->failure, "stop time: expected the start time, %s s, or a later one, got"
                       " %s s", er_shown(start, other), er_shown(stop, number));
    if (!isfinite(tolerance) || tolerance < 0.0)
        return er_fail(&instance->failure, "tolerance: expected a number > 0, or 0 for %g m at the TCP, got"
                       " %s", instance->interface.tolerance.usual, er_shown(tolerance, number));
    instance->progress.time = instance->progress.start = start;
    instance->progress.stop = stop;
    instance->progress.tolerance = tolerance;
    instance->progress.computed = false;
    instance->fresh = 0;
    return true;
}

bool er_instance_require_before_stop(er_instance *instance, double time)
{
    const er_progress *progress = &instance->progress;
    const er_settings *settings = &instance->model->robot.settings;
    char number[ER_NUMBER_TEXT], other[ER_NUMBER_TEXT];
    return time <= progress->stop || /* sums of steps round */
           time - progress->stop <= er_slack_at(settings, progress->stop) +
                                        settings->stop_slack * (progress->stop - progress->start) ||
           er_fail(&instance->failure, "time: expected at most the stop time, %s s, got %s s",
                   er_shown(progress->stop, other), er_shown(time, number));
}

/* The error allowed at the TCP [m]: the parameter's own, or what the experiment's tolerance makes of the usual one. */
static double tcp_tolerance(const er_instance *instance)
{
    const er_tolerance *tolerance = &instance->interface.tolerance;
    double master_end = instance->progress.tolerance;
    if (instance->inputs.tcp_tolerance > 0.0)
        return instance->inputs.tcp_tolerance;
    if (master_end == 0.0)
        return tolerance->usual;
    return fmin(fmax(tolerance->usual * (master_end / tolerance->relative), tolerance->least), tolerance->most);
}

const er_step_start *er_step_start_of(const er_instance *instance)
{
    return &instance->step_start[instance->latest];
}

/* The next step's start, whose state and past are there, becomes the latest. */
static void keep_step_start(er_instance *instance, double end, bool stepped)
{
    er_step_start *start;
    instance->latest = 1 - instance->latest;
    start = &instance->step_start[instance->latest];
    start->command = instance->inputs.command;
    start->load = instance->inputs.load;
    start->end = end;
    start->stepped = stepped;
    instance->columns = 0;
}

bool er_instance_initialise(er_instance *instance)
{
    er_model *model = instance->model;
    er_memory before;
    if (instance->progress.computed)
        return true;
    if (instance->exchange.on && model->memory.options.quasistatic)
        return er_fail(&instance->failure, "%s: expected dynamic in model exchange, got quasistatic: a"
                       " robot at rest has no states; use co-simulation", instance->interface.string[ER_MODE].name);
    if (!er_anchor_require(&instance->inputs.load.anchor, &instance->failure) ||
        !er_contact_require(&instance->inputs.load.contact, &instance->failure))
        return false;
    before = model->memory;
    model->memory.options.tolerance = tcp_tolerance(instance);
    model->memory.parameters = instance->inputs.parameters;
    if (!er_model_reset(model, instance->progress.time, &instance->inputs.command,
                        &instance->inputs.load, &instance->failure)) {
        model->memory = before;
        return false;
    }
    instance->step_start[1 - instance->latest].state = model->memory.state;
    instance->step_start[1 - instance->latest].past = model->memory.past;
    keep_step_start(instance, 0.0, false);
    instance->progress.computed = true;
    instance->progress.parameters_changed = false;
    instance->fresh = 0;
    return true;
}

/* A trajectory may lead beyond the drives' limits, as commands may. */
static void watch_trajectory(er_instance *instance)
{
    const er_model *model = instance->model;
    const er_trajectory *motion = &model->trajectory;
    const er_interface *interface = &instance->interface;
    char low[ER_NUMBER_TEXT], high[ER_NUMBER_TEXT], number[ER_NUMBER_TEXT], time[ER_NUMBER_TEXT];
    instance->warned = false;
    if (model->memory.options.trajectory[0] == '\0')
        return;
    for (size_t k = 0; k < motion->samples; k++) {
        const double *row = motion->row + k * er_trajectory_width(motion);
        for (int i = 0; i < motion->joints; i++) {
            const double *limit = interface->limit[i];
            if (row[1 + i] >= limit[0] && row[1 + i] <= limit[1])
                continue;
            instance->warned = true;
            er_fail(&instance->failure, "trajectory: expected angles within the limits of drive %d, %s to %s rad, got %s rad"
                    " at %s s", i + 1, er_shown(limit[0], low), er_shown(limit[1], high),
                    er_shown(row[1 + i], number), er_shown(row[0], time));
            return;
        }
    }
}

bool er_instance_start(er_instance *instance)
{
    if (!er_instance_initialise(instance))
        return false;
    watch_trajectory(instance);
    instance->progress.phase = instance->exchange.on ? ER_EVENT_MODE : ER_RUNNING;
    return true;
}

/* Whether spring and contact can be such; the spring of the last step was. */
static bool require_load(er_instance *instance)
{
    const er_anchor *anchor = &instance->inputs.load.anchor;
    const er_anchor *last = &instance->model->memory.held.load.anchor;
    return (memcmp(anchor->stiffness, last->stiffness, sizeof anchor->stiffness) == 0 ||
            er_anchor_require(anchor, &instance->failure)) &&
           er_contact_require(&instance->inputs.load.contact, &instance->failure);
}

static bool advance_model(er_instance *instance, double end)
{
    er_model *model = instance->model;
    er_step_start *next = &instance->step_start[1 - instance->latest];
    next->past = model->memory.past;
    if (!require_load(instance) ||
        !er_model_step(model, end, &instance->inputs.command, &instance->inputs.load, &next->state, &instance->failure))
        return false;
    keep_step_start(instance, end, true);
    return true;
}

/* After a refused step the model goes on with what it had, and the new parameters wait again. */
static bool advance_with_parameters(er_instance *instance, double end)
{
    er_model *model = instance->model;
    const er_parameters parameters = model->memory.parameters;
    const er_state before = model->memory.state;
    er_model_take_parameters(model, &instance->inputs.parameters);
    if (advance_model(instance, end)) {
        instance->progress.parameters_changed = false;
        return true;
    }
    er_model_take_parameters(model, &parameters);
    model->memory.state = before;
    return false;
}

/* A step's end since the start: in the model's time while the master's cannot tell. */
static double step_end(const er_model *model, double start, double size)
{
    double origin = model->memory.origin, master_end = (start - origin) + size;
    double model_end = model->memory.state.time + size;
    double rounding = er_time_rounding(&model->robot.settings, fmax(fabs(origin), fabs(start)));
    return fabs(master_end - model_end) <= rounding ? model_end : master_end;
}

/* Drives hold an angle without a rate to the step's end, and jump to the next: told once, at the second jump in a
 * row. */
static void watch_rates(er_instance *instance)
{
    const er_step_start *last = &instance->step_start[1 - instance->latest];
    const er_command *now = &instance->step_start[instance->latest].command;
    int joint = -1, joints = instance->model->robot.joints, block = 0;
    if (instance->model->memory.options.trajectory[0] != '\0' || instance->jumps > 1)
        return;
    for (int i = joints - 1; last->stepped && i >= 0; i--)
        if (now->q[i] != last->command.q[i])
            joint = i;
    for (int i = 0; i < joints; i++)
        if (now->qd[i] != 0.0 || now->qdd[i] != 0.0)
            joint = -1;
    instance->jumps = joint < 0 ? 0 : instance->jumps + 1;
    if (instance->jumps < 2)
        return;
    while (er_blocks[block].cause != ER_BY_Q)
        block++;
    instance->warned = true;
    er_fail(&instance->failure, "%s: expected qd_cmd and qdd_cmd beside angles that change from step to step, got zero:"
            " each angle is held to the step's end, and the drive jumps to the next; set all three, or name the"
            " motion's file in trajectory", instance->interface.name[instance->interface.first[block] + joint]);
}

/* A motion that is chaotic is told of once; `before`: it had been. */
static void watch_growth(er_instance *instance, bool before)
{
    const er_model *model = instance->model;
    char number[ER_NUMBER_TEXT], other[ER_NUMBER_TEXT];
    if (before || !model->growth.has_grown)
        return;
    instance->warned = true;
    er_fail(&instance->failure, "the motion from %s to %s s: expected small errors to stay small, got gears or a contact whose"
            " rattling makes one grow more than %g times, so that tcp_tolerance does not bound the error and rounding"
            " decides on the path: check damping and backlash",
            er_shown(model->memory.origin + model->growth.since, other), er_shown(instance->progress.time, number),
            ER_MOST_GROWTH);
}

bool er_instance_step(er_instance *instance, double start, double size)
{
    er_progress *progress = &instance->progress;
    char number[ER_NUMBER_TEXT], other[ER_NUMBER_TEXT];
    double end;
    const bool grown = instance->model->growth.has_grown;
    instance->warned = false;
    if (!isfinite(size) || size < 0.0)
        return er_fail(&instance->failure, "step size: expected a finite number >= 0, got %s s",
                       er_shown(size, number));
    if (!(fabs(start - progress->time) <= er_slack_at(&instance->model->robot.settings, progress->time)))
        return er_fail(&instance->failure, "step start: expected the last step's end, %s s, got %s s",
                       er_shown(progress->time, other), er_shown(start, number));
    if (size == 0.0)
        return true;
    if (!er_instance_require_before_stop(instance, start + size))
        return false;
    end = step_end(instance->model, start, size);
    if (!(progress->parameters_changed ? advance_with_parameters(instance, end) : advance_model(instance, end)))
        return er_let_retry(&instance->failure);
    progress->time = start + size;
    instance->fresh = 0;
    watch_rates(instance);
    watch_growth(instance, grown);
    return true;
}
