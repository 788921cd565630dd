/* Whether small errors stay small: how a shift of the state grows along a motion.
 *
 * Gears that rattle in their backlash with little damping make a motion chaotic: what rounds differently ends elsewhere,
 * and a tolerance does not bound the error.  The shift is carried along, as a column of the sensitivity, while backlashes
 * and contacts are passed often; nothing else in the model makes it grow for long.
 */
#ifndef ER_GROWTH_H
#define ER_GROWTH_H

#include "outputs/memory.h"

/* A shift that has grown by more than this is told of. */
#define ER_MOST_GROWTH 1e6

/* Before a step: whether the shift is carried along, by model->sensitivity then. */
bool er_growth_begin(er_model *model);

/* Behind it: a step of a length [s] that passed so many backlashes and contacts. */
void er_growth_end(er_model *model, double length, long crossings);

#endif
