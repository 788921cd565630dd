#include "model_drives.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../io/file.h"
#include "outputs/chain_motion.h"
#include "load/trajectory_build.h"

/* The drives of a trajectory, if there is one. */
static er_drives trajectory_drives(er_model *model)
{
    er_drives drives;
    memset(&drives, 0, sizeof drives);
    drives.joints = model->robot.joints;
    if (model->memory.options.trajectory[0] != '\0') {
        drives.trajectory = &model->trajectory;
        drives.hint = &model->hint;
        drives.start = model->trajectory.start - model->memory.origin;
    }
    return drives;
}

/* Motors without a servo are counted from where they would be at the rate they have. */
static void coast_motors(const er_model *model, er_drives *drives)
{
    const er_motors *motors = &model->memory.state.motors;
    for (int d = 0; d < er_model_motors(model); d++) {
        double *powers = drives->powers[model->robot.motor[d].joint];
        memset(powers, 0, sizeof *drives->powers);
        powers[0] = motors->angle[d];
        powers[1] = motors->rate[d];
    }
}

er_drives er_model_drives(er_model *model, double start, double end, const er_command *command)
{
    er_drives drives = trajectory_drives(model);
    if (drives.trajectory == NULL) {
        drives.start = start;
        er_command_follow(&model->robot, &model->memory.past, command, end - start, drives.powers);
        if (model->memory.options.drive == ER_TORQUE && end > start)
            coast_motors(model, &drives);
    }
    return drives;
}

bool er_model_find_held(const er_model *model, const er_drives *drives, double time,
                        const er_load *load, double elapsed, er_held *held, er_failure *failure)
{
    double slack = er_slack_at(&model->robot.settings, model->memory.origin + time);
    if (!er_drives_cover(drives, time, slack, failure))
        return false;
    er_drives_at(drives, time, held->q, held->qd, held->qdd);
    held->load = *load;
    er_load_advance(&held->load, elapsed);
    return true;
}

/* Reads a file of the resources, or else of this name: what was packed is not a master's to replace. */
static bool read_trajectory(const er_model *model, const char *path, er_trajectory *trajectory, er_failure *failure)
{
    char *packed = model->resources != NULL ? er_path_in_folder(model->resources, path) : NULL;
    bool is_packed = packed != NULL && er_exists(packed);
    bool good = er_trajectory_read(trajectory, is_packed ? packed : path, model->robot.joints,
                                   &model->robot.settings, failure);
    free(packed);
    return good;
}

bool er_model_require_trajectory(er_model *model, const char *path, uint64_t fingerprint, er_failure *failure)
{
    bool there = strcmp(path, model->loaded_path) == 0;
    er_trajectory read;
    if (path[0] == '\0')
        return true;
    if (!there && !read_trajectory(model, path, &read, failure))
        return false;
    if (fingerprint != 0 && fingerprint != (there ? &model->trajectory : &read)->fingerprint) {
        if (!there)
            er_trajectory_free(&read);
        return er_fail(failure, "trajectory %.500s: expected the motion that the state was saved with, got another",
                       path);
    }
    if (!there) {
        er_trajectory_free(&model->trajectory);
        model->trajectory = read;
        model->hint = 0;
        strcpy(model->loaded_path, path);
    }
    return true;
}

void er_model_hold(er_model *model, double time, const er_command *command, const er_load *load)
{
    er_held *held = &model->memory.held;
    er_drives drives = trajectory_drives(model);
    double model_time = time - model->memory.origin;
    if (drives.trajectory != NULL) {
        er_drives_at(&drives, model_time, held->q, held->qd, held->qdd);
    } else {
        memcpy(held->q, command->q, sizeof held->q);
        memcpy(held->qd, command->qd, sizeof held->qd);
        memcpy(held->qdd, command->qdd, sizeof held->qdd);
    }
    memcpy(held->torque, command->torque, sizeof held->torque);
    held->load = *load;
    model->memory.state.time = model_time;
}

bool er_model_covers(er_model *model, double time, er_failure *failure)
{
    er_drives drives = trajectory_drives(model);
    return er_drives_cover(&drives, time - model->memory.origin, er_slack_at(&model->robot.settings, time), failure);
}

double er_model_next_kink(er_model *model, double time)
{
    er_drives drives = trajectory_drives(model);
    double at = model->memory.state.time, origin = model->memory.origin;
    do
        at = er_drives_next_kink(&drives, at, INFINITY, model->means.jump);
    while (at + origin <= time); /* the sum rounds */
    return at + origin;
}

void er_model_held_by_time(er_model *model, er_held *change)
{
    er_drives drives = trajectory_drives(model);
    memset(change, 0, sizeof *change);
    er_drives_by_time(&drives, model->memory.state.time, change->q, change->qd, change->qdd);
}
