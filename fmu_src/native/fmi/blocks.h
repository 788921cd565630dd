/* The FMU's blocks of reals, a row each: what they are, where they are set, what they are computed by. */
#ifndef ER_BLOCKS_H
#define ER_BLOCKS_H

#include "instance.h"

/* Values of a block of outputs or local variables, and their derivatives along a change. */
bool er_block_find(er_instance *instance, int block, double *values);
bool er_block_along(er_instance *instance, int block, const er_change *change, double *derivatives);

/* Where an input, a parameter or a state has its value; nothing is looked at. */
double *er_block_value(er_instance *instance, unsigned reference);

#endif
