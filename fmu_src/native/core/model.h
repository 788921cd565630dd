/* The elastic robot as one object: reset, step, and a step again for derivatives.  elastic_robot/robot.py is the same in
 * Python. */
#ifndef ER_MODEL_H
#define ER_MODEL_H

#include "outputs/memory.h"

/* Returns a model with the robot's start values, to be freed; NULL if it does not fit into memory. */
er_model *er_model_create(const er_robot *robot);
void er_model_free(er_model *model);

/* Starts the model's time at `origin` [s], at rest relative to the drives, with the memory's options and
 * parameters.  Commands are looked at where there is no trajectory. */
bool er_model_reset(er_model *model, double origin, const er_command *command, const er_load *load,
                    er_failure *failure);

/* Moves on to a time since the origin under a load that begins now, and tells the state where that began;
 * the memory is as before if it fails. */
bool er_model_step(er_model *model, double end, const er_command *command, const er_load *load,
                   er_state *began, er_failure *failure);

/* Lets changed parameters take effect from the present time on. */
void er_model_take_parameters(er_model *model, const er_parameters *parameters);

/* Replaces the memory; the trajectory is read again where it is another one.  `computed`: the memory
 * has been reset since its options were set.  The model is as before if that fails. */
bool er_model_restore(er_model *model, const er_memory *memory, bool computed, er_failure *failure);

/* Takes a step of a dynamic robot from a state and the past at that time again, solved to rounding, and
 * carries model->sensitivity along; the memory stays as it is. */
bool er_model_follow(er_model *model, const er_state *state, const er_past *past, double end,
                     const er_command *command, const er_load *load, er_failure *failure);

#endif
