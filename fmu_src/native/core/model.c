#include <stdlib.h>
#include <string.h>

#include "model_drives.h"
#include "newton.h"

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
    free(((void **)model)[-1]);
}

/* Derives gears and means from options and parameters. */
static void derive(er_model *model)
{
    const er_options *options = &model->memory.options;
    const er_parameters *parameters = &model->memory.parameters;
    const er_settings *settings = &model->robot.settings;
    double longest = settings->longest_step;
    double local = options->tolerance / (er_law_switches(options->curve)
                                             ? settings->tcp_per_local_error_with_play
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

bool er_model_reset(er_model *model, double origin, const er_command *command, const er_load *load,
                    er_failure *failure)
{
    er_memory *memory = &model->memory;
    er_drives drives;
    if (!er_model_require_trajectory(model, memory->options.trajectory, 0, failure))
        return false;
    memory->trajectory_fingerprint =
        memory->options.trajectory[0] != '\0' ? model->trajectory.fingerprint : 0;
    derive(model);
    memory->origin = origin;
    memset(&memory->past, 0, sizeof memory->past);
    drives = er_model_drives(model, 0.0, 0.0, command);
    if (!er_model_find_held(model, &drives, 0.0, load, 0.0, &memory->held, failure))
        return false;
    memset(&memory->state, 0, sizeof memory->state);
    if (!memory->options.undeflected &&
        !er_equilibrium(&model->robot, &model->gears, memory->parameters.gravity, memory->held.q,
                        load, memory->state.x, failure))
        return false;
    er_state_start(&memory->state, &model->robot, &model->gears, 0.0);
    er_model_orient(model);
    return true;
}

void er_model_take_parameters(er_model *model, const er_parameters *parameters)
{
    er_state *state = &model->memory.state;
    model->memory.parameters = *parameters;
    derive(model);
    er_state_start(state, &model->robot, &model->gears, state->time);
}

bool er_model_restore(er_model *model, const er_memory *memory, bool computed, er_failure *failure)
{
    if (computed && !er_model_require_trajectory(model, memory->options.trajectory,
                                        memory->trajectory_fingerprint, failure))
        return false;
    model->memory = *memory;
    if (computed)
        derive(model);
    return true;
}
