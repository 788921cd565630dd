/* An instance of the FMU, whichever version of FMI drives it: variables <-> er_model, nothing else.
 *
 * Every function that can fail leaves a sentence in instance->failure and returns false; the instance
 * is then as before. */
#ifndef ER_INSTANCE_H
#define ER_INSTANCE_H

#include <stddef.h>
#include "interface.h"
#include "lifecycle.h"

/* What is set from outside: the inputs, and the parameters that the next step takes. */
typedef struct {
    er_load load;
    er_command command;
    er_parameters parameters;
    double tcp_tolerance; /* error allowed at the TCP [m]; 0: that of the experiment */
} er_inputs;

/* How far the simulation is. */
typedef struct {
    double time;             /* of the last step's end, or the start [s] */
    double start, stop;      /* of the experiment [s]; a stop that is not told is infinite */
    double tolerance;        /* of the experiment, relative; 0: not told */
    bool computed;           /* the model's state belongs to the inputs and parameters */
    er_phase phase;
    bool parameters_changed; /* since the last step */
} er_progress;

/* Where the step that led to the present state began, for derivatives. */
typedef struct {
    er_past past;
    er_command command; /* of the step */
    er_load load;       /* of the step, at its beginning */
    double end;         /* [s], in the model's time */
    bool stepped;       /* false: the present state is the initial one, computed from these inputs */
    er_state state;     /* the last, of which few robots have all */
} er_step_start;

/* What an instance of model exchange remembers beside that. */
typedef struct {
    bool on;   /* the instance is one of model exchange */
    bool held; /* what is held in the model belongs to the present time and inputs */
    int piece[ER_MAX_JOINTS]; /* of each torsion's curve, at the last event */
} er_exchange;

struct er_instance {
    er_model *model;
    er_interface interface;
    uint64_t fingerprint; /* hash of the robot's data */
    er_inputs inputs;
    er_progress progress;
    er_step_start step_start[2]; /* of the last step, and one to be filled by the next */
    int latest;                  /* of these */
    er_exchange exchange;
    unsigned columns; /* causes of model->sensitivity that belong to the present state, a bit each */
    unsigned over_limit; /* drives that are told to go beyond their limits, a bit each */
    int jumps;       /* last steps in a row to which angles jumped without rates, until that is told */
    bool warned;     /* `failure` says what is wrong with values that were taken all the same */
    uint64_t fresh; /* blocks of `outputs` that belong to the present state, a bit each */
    double outputs[ER_MAX_REALS];
    er_failure failure;
};

/* Whether states and time are the master's: initialisation has ended. */
static inline bool er_exchange_runs(const er_instance *instance)
{
    return instance->exchange.on && instance->progress.phase >= ER_EVENT_MODE;
}

/* The entry of inputs or parameters at a place in them. */
static inline double *er_input_at(er_instance *instance, size_t place, int entry)
{
    return (double *)((char *)&instance->inputs + place) + entry;
}

/* Makes an instance of the robot whose data are in a file; NULL, with the reason, if that fails.
 * `guid` is compared with the one in the file. */
er_instance *er_instance_create(const char *robot_file, const char *guid, er_failure *failure);
void er_instance_free(er_instance *instance);

/* Back to the state after creation. */
void er_instance_reset(er_instance *instance);

/* Start and stop time [s], and the relative tolerance; infinite and 0 for those not told. */
bool er_instance_setup(er_instance *instance, double start, double stop, double tolerance);

/* Refuses a time behind the stop [s]. */
bool er_instance_require_before_stop(er_instance *instance, double time);

/* Computes the initial state unless it is there. */
bool er_instance_initialise(er_instance *instance);

/* The same, with which initialisation ends: strings are fixed from now on; model exchange settles then. */
bool er_instance_start(er_instance *instance);

/* Where the last step began, or the initial state. */
const er_step_start *er_step_start_of(const er_instance *instance);

/* Moves on by a communication step [s]; inputs are those at its start. */
bool er_instance_step(er_instance *instance, double start, double size);

#endif
