/* Variables of an instance by value reference: reals and strings. */
#ifndef ER_INSTANCE_VARIABLES_H
#define ER_INSTANCE_VARIABLES_H

#include "instance.h"

/* Outputs are computed when they are read. */
bool er_instance_get_reals(er_instance *instance, const unsigned *references, size_t count,
                           double *values);
bool er_instance_set_reals(er_instance *instance, const unsigned *references, size_t count,
                           const double *values);

bool er_instance_get_string(er_instance *instance, unsigned reference, const char **value);
bool er_instance_set_strings(er_instance *instance, const unsigned *references, size_t count,
                             const char *const *values);

#endif
