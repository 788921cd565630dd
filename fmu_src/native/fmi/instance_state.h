/* Saving, restoring and serialising an instance. */
#ifndef ER_INSTANCE_STATE_H
#define ER_INSTANCE_STATE_H

#include "instance.h"

/* All that an instance remembers: one flat block. */
typedef struct {
    uint64_t mark;        /* of this format */
    uint64_t fingerprint; /* of the robot */
    er_inputs inputs;
    er_progress progress;
    er_step_start step_start;
    er_exchange exchange;
    er_memory memory;
} er_saved_state;

void er_instance_save(er_instance *instance, er_saved_state *saved);
bool er_instance_restore(er_instance *instance, const er_saved_state *saved);

/* The same as bytes with a checksum, for another process on the same kind of machine. */
#define ER_SERIALISED_SIZE (sizeof(er_saved_state) + sizeof(uint64_t))
void er_serialise(const er_saved_state *saved, void *bytes);
bool er_deserialise(er_instance *instance, const void *bytes, size_t size, er_saved_state *saved);

#endif
