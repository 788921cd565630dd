/* What moves the drives of a model: its trajectory, or commands. */
#ifndef ER_MODEL_DRIVES_H
#define ER_MODEL_DRIVES_H

#include "outputs/memory.h"

/* Has the trajectory of this path in the model, with the samples of `fingerprint` unless that is 0. */
bool er_model_require_trajectory(er_model *model, const char *path, uint64_t fingerprint, er_failure *failure);

/* The drives of the trajectory, or those that follow a command through a step. */
er_drives er_model_drives(er_model *model, double start, double end, const er_command *command);

/* Drives at a time, and the load as it is a while after its beginning; false if they do not cover it. */
bool er_model_find_held(const er_model *model, const er_drives *drives, double time, const er_load *load,
                        double elapsed, er_held *held, er_failure *failure);

/* Holds drives and load as they are at a time, the master's; a command is the motion at that time. */
void er_model_hold(er_model *model, double time, const er_command *command, const er_load *load);

/* Whether a trajectory, if there is one, covers a time. */
bool er_model_covers(er_model *model, double time, er_failure *failure);

/* The first time after one at which a drive's third derivative jumps; infinite if there is none. */
double er_model_next_kink(er_model *model, double time);

/* How the drives held now follow time: along a trajectory, or not at all. */
void er_model_held_by_time(er_model *model, er_held *change);

#endif
