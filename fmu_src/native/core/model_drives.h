/* What moves the drives of a model: its trajectory, or commands. */
#ifndef ER_MODEL_DRIVES_H
#define ER_MODEL_DRIVES_H

#include "model.h"

/* Has the trajectory of this path in the model, with the samples of `fingerprint` unless that is 0. */
bool er_model_require_trajectory(er_model *model, const char *path, uint64_t fingerprint, er_failure *failure);

/* The drives of the trajectory, or those that follow a command through a step. */
er_drives er_model_drives(er_model *model, double start, double end, const er_command *command);

/* Drives at a time, and the load as it is a while after its beginning; false if they do not cover it. */
bool er_model_find_held(const er_model *model, const er_drives *drives, double time, const er_load *load,
                        double elapsed, er_held *held, er_failure *failure);

#endif
