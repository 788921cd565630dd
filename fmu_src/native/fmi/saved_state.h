/* States of an instance, which its master keeps, and brings back as they are or as bytes. */
#ifndef ER_SAVED_STATE_H
#define ER_SAVED_STATE_H

#include "component.h"

bool er_component_get_state(er_component *c, void **state);
bool er_component_set_state(er_component *c, const void *state);
bool er_component_free_state(er_component *c, void **state);
bool er_component_state_size(er_component *c, const void *state, size_t *size);
bool er_component_serialise(er_component *c, const void *state, void *bytes, size_t size);
bool er_component_deserialise(er_component *c, const void *bytes, size_t size, void **state);

#endif
