/* Variables of an instance: inputs and parameters as they are set, outputs computed when read, strings fixed
 * when initialisation ends. */
#ifndef ER_VARIABLES_H
#define ER_VARIABLES_H

#include "instance.h"

/* Reals and strings by value reference.  Outputs are computed when they are read. */
bool er_instance_get_reals(er_instance *instance, const unsigned *references, size_t count, double *values);
bool er_instance_set_reals(er_instance *instance, const unsigned *references, size_t count, const double *values);

/* Takes derivatives of the first order of inputs: those of the wrench and of the anchor's position, which are
 * inputs too, and of q''.  Others have no effect: `ignored` says of the first, or is NULL. */
bool er_instance_set_derivatives(er_instance *instance, const unsigned *references, size_t count,
                                 const int *orders, const double *values, const char **ignored);

/* Has the values of a block of computed variables, by its place in er_blocks. */
bool er_instance_require(er_instance *instance, int block);

bool er_instance_get_string(er_instance *instance, unsigned reference, const char **value);
bool er_instance_set_strings(er_instance *instance, const unsigned *references, size_t count,
                             const char *const *values);

#endif
