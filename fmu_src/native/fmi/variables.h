/* What a master asks an instance for: reals and strings by value reference, derivatives, states to save. */
#ifndef ER_VARIABLES_H
#define ER_VARIABLES_H

#include "instance.h"

/* Outputs are computed when they are read. */
bool er_instance_get_reals(er_instance *instance, const unsigned *references, size_t count,
                           double *values);
bool er_instance_set_reals(er_instance *instance, const unsigned *references, size_t count,
                           const double *values);

/* Takes derivatives of the first order of inputs: those of the wrench and of the anchor's position, which are
 * inputs too, and of q''.  Others have no effect: `ignored` says of the first, or is NULL. */
bool er_instance_set_derivatives(er_instance *instance, const unsigned *references, size_t count,
                                 const int *orders, const double *values, const char **ignored);

/* Has the values of a block of computed variables, by its place in er_blocks. */
bool er_instance_require(er_instance *instance, int block);

/* Where an input, a parameter or a state has its value; nothing is looked at. */
double *er_instance_settable(er_instance *instance, unsigned reference);

bool er_instance_get_string(er_instance *instance, unsigned reference, const char **value);
bool er_instance_set_strings(er_instance *instance, const unsigned *references, size_t count,
                             const char *const *values);

/* d(unknowns)/d(knowns) times a seed: how outputs at the end of the last step, or in the initial
 * state, follow the inputs and parameters that led there, and at a communication point the states and
 * time. */
bool er_instance_derivative(er_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed,
                            double *sensitivity);

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
