/* How x and x' follow the inputs of a communication step: forward sensitivities, carried from step
 * to step of the integration, whose lengths are held.
 *
 * What they follow is a column each, cause by cause (columns.c). */
#ifndef ER_SENSITIVITY_H
#define ER_SENSITIVITY_H

#include "columns.h"

/* Begins with x and x' that do not depend on the inputs: the columns from one cause to another. */
void er_sensitivity_start(er_sensitivity *sensitivity, const er_robot *robot, er_cause first, er_cause last,
                          double start);

/* Carries the columns over a step that was just solved from `state`; the workspace is as it left it. */
void er_sensitivity_follow(er_sensitivity *sensitivity, const er_run *r, const er_state *state, const er_step *step);

#endif
