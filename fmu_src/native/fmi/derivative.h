/* Directional derivatives: how the outputs follow the inputs and parameters that the last step, or the
 * initial state, was computed from; and how they are a function of state and time. */
#ifndef ER_DERIVATIVE_H
#define ER_DERIVATIVE_H

#include "instance.h"

/* d(unknowns)/d(knowns) times a seed: how outputs at the end of the last step, or in the initial state, follow the
 * inputs and parameters that led there, and at a communication point the states and time. */
bool er_instance_derivative(er_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity);

#endif
