/* An instance of the FMU, whichever version of FMI drives it: variables <-> er_model, nothing else.
 *
 * Every function that can fail leaves a sentence in instance->failure and returns false; the instance
 * is then as before.  elastic_robot_slave.py is the same in Python.
 */
#ifndef ER_INSTANCE_H
#define ER_INSTANCE_H

#include <stddef.h>

#include "interface.h"
#include "../core/model.h"

/* What is set from outside: the inputs, and the parameters that the next step takes. */
typedef struct {
    double wrench[6];
    er_command command;
    er_parameters parameters;
} er_inputs;

/* How far the simulation is. */
typedef struct {
    double time;             /* of the last step's end, or the start [s] */
    bool computed;           /* the model's state belongs to the inputs and parameters */
    bool started;            /* initialisation has ended: strings are fixed */
    bool parameters_changed; /* since the last step */
} er_progress;

/* How the present state came about, for derivatives. */
typedef struct {
    er_state state;     /* where the last step began */
    er_command command; /* of that step */
    double wrench[6];   /* of that step */
    double end;         /* [s] */
    bool stepped;       /* false: the present state is the initial one, computed from these inputs */
} er_departure;

/* All that an instance remembers: one flat block. */
typedef struct {
    uint64_t mark;  /* of this format */
    uint64_t print; /* hash of the robot's data and the format */
    er_inputs inputs;
    er_progress progress;
    er_departure departure;
    er_memory memory;
} er_saved_state;

typedef struct {
    er_model *model;
    er_layout layout;
    uint64_t print;
    er_inputs inputs;
    er_progress progress;
    er_departure departure;
    unsigned columns; /* groups of model->sensitivity that belong to the present state, a bit each */
    unsigned fresh; /* blocks of `outputs` that belong to the present state, a bit each */
    double outputs[ER_MAX_REALS];
    er_failure failure;
} er_instance;

/* Makes an instance of the robot whose data are in a file; NULL, with the reason, if that fails.
 * `guid` is compared with the one in the file. */
er_instance *er_instance_create(const char *robot_file, const char *guid, er_failure *failure);
void er_instance_free(er_instance *instance);

/* Back to the state after creation. */
void er_instance_reset(er_instance *instance);

/* Start time [s], and the error allowed at the TCP [m]; 0 for the default. */
bool er_instance_setup(er_instance *instance, double start, double tolerance);

/* Computes the initial state from what is set by now; strings are fixed from now on. */
bool er_instance_start(er_instance *instance);

/* Computes the initial state unless it is there. */
bool er_instance_initialise(er_instance *instance);

/* Whether the parameters that were set can be those of a robot. */
bool er_instance_require_parameters(er_instance *instance);

/* Moves on by a communication step [s]; inputs are held over it. */
bool er_instance_step(er_instance *instance, double start, double size);

bool er_instance_get_reals(er_instance *instance, const unsigned *references, size_t count,
                           double *values);
bool er_instance_set_reals(er_instance *instance, const unsigned *references, size_t count,
                           const double *values);
bool er_instance_get_string(er_instance *instance, unsigned reference, const char **value);
bool er_instance_set_string(er_instance *instance, unsigned reference, const char *value);

/* d(unknowns)/d(knowns) times a seed: how outputs at the end of the last step, or in the initial
 * state, follow the inputs that led there. */
bool er_instance_derivative(er_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed,
                            double *sensitivity);

/* Saves and restores the whole instance. */
void er_instance_save(const er_instance *instance, er_saved_state *saved);
bool er_instance_restore(er_instance *instance, const er_saved_state *saved);

/* The same as bytes with a checksum, for another process on the same kind of machine. */
#define ER_SERIALISED_SIZE (sizeof(er_saved_state) + sizeof(uint64_t))
void er_serialise(const er_saved_state *saved, unsigned char *bytes);
bool er_deserialise(er_instance *instance, const unsigned char *bytes, size_t size,
                    er_saved_state *saved);

#endif
