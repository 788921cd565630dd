/* An instance of the FMU, whichever version of FMI drives it: variables <-> er_model, nothing else.
 *
 * Every function that can fail leaves a sentence in instance->failure and returns false; the instance
 * is then as before.  elastic_robot/fmi/instance.py is the same in Python.
 */
#ifndef ER_INSTANCE_H
#define ER_INSTANCE_H

#include <stddef.h>

#include "interface.h"
#include "../core/model.h"

/* Which call may be made when (lifecycle.c): the states of an instance and one table for FMI 2.0 and FMI 3.0.
 * elastic_robot/fmi/lifecycle.py is the same in Python. */
typedef enum {
    ER_INSTANTIATED,
    ER_INITIALISING, /* initialisation mode */
    ER_RUNNING,      /* initialisation has ended: step mode */
    ER_EVENT_MODE,   /* of model exchange, as the next */
    ER_CONTINUOUS_MODE,
    ER_TERMINATED
} er_phase;

/* Calls that have the same rights. */
typedef enum {
    ER_CALL_SETUP,     /* SetupExperiment of FMI 2.0 */
    ER_CALL_ENTER,     /* EnterInitializationMode */
    ER_CALL_EXIT,      /* ExitInitializationMode */
    ER_CALL_STEP,      /* DoStep */
    ER_CALL_TERMINATE, /* Terminate */
    ER_CALL_SET,       /* SetReal, SetFloat64: inputs and tunable parameters */
    ER_CALL_SET_FIXED, /* SetString: fixed parameters */
    ER_CALL_GET,       /* Get.. of FMI 2.0 */
    ER_CALL_GET_START, /* Get.. of FMI 3.0, start values too */
    ER_CALL_DERIVE,    /* GetDirectionalDerivative */
    ER_CALL_RESULT,    /* of the last step: its status, derivatives of outputs by time */
    ER_CALL_EVENT_MODE, /* EnterEventMode of FMI 2.0, which its table allows in event mode, too */
    ER_CALL_EVENT,      /* EnterEventMode of FMI 3.0 */
    ER_CALL_UPDATE,     /* NewDiscreteStates, UpdateDiscreteStates, EnterContinuousTimeMode */
    ER_CALL_COMPLETED,  /* CompletedIntegratorStep */
    ER_CALL_SET_TIME,   /* SetTime */
    ER_CALL_SET_STATES, /* SetContinuousStates */
    ER_CALL_GET_STATES, /* continuous states, their derivatives, event indicators */
    ER_CALL_ANY        /* FMU states, SetDebugLogging, Reset */
} er_call;

/* Why a call is refused in a phase; NULL if it is not. */
const char *er_refusal(er_phase phase, er_call call);

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
    unsigned beyond; /* drives that are told to go beyond their limits, a bit each */
    int jumps;       /* last steps in a row to which angles jumped without rates, until that is told */
    bool warned;     /* `failure` says what is wrong with values that were taken all the same */
    uint64_t fresh; /* blocks of `outputs` that belong to the present state, a bit each */
    double outputs[ER_MAX_REALS];
    er_failure failure;
};

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

/* variables.c: reals and strings by value reference.  Outputs are computed when they are read. */
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

/* derivative.c: d(unknowns)/d(knowns) times a seed: how outputs at the end of the last step, or in the initial
 * state, follow the inputs and parameters that led there, and at a communication point the states and
 * time. */
bool er_instance_derivative(er_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed,
                            double *sensitivity);

/* Model exchange (exchange.c): the robot as a differential equation that the master integrates.
 *
 * The states are x, x' and the elongations of elements of hysteresis, and of motors angles, rates, integrals of their
 * servos and elongations of their friction; their derivatives are a function of time, states, inputs and parameters,
 * and of which elements slip.  What an event changes is that, and which bends of the torque curves are watched: the
 * event indicators say how far each gear is from leaving the piece of its curve on which it was at the last event, and
 * each element from slipping or sticking.  Drives follow their trajectory by time, or the inputs as they are at the
 * moment.
 */

/* As many values as one of the kinds of event indicators below may have. */
enum { ER_MAX_INDICATORS = 2 * ER_MAX_JOINTS > ER_MAX_ELEMENTS ? 2 * ER_MAX_JOINTS : ER_MAX_ELEMENTS };

/* Turns a rate into a way, of about a first step [s]. */
#define ER_REVERSAL_TIME 1e-3

/* Whether states and time are the master's: initialisation has ended. */
bool er_exchange_runs(const er_instance *instance);

/* Lets time, inputs and parameters as they are set now act on the model, where the master integrates. */
bool er_exchange_hold(er_instance *instance);

/* What was set since the last evaluation is not in the model yet. */
void er_exchange_disturb(er_instance *instance);

/* Ways from x to the bends of a torsion's curve below and above [rad]: to those of its piece while the
 * master integrates, else to the nearest. */
void er_exchange_bends(const er_instance *instance, double *ways);

/* How they change with x and backlash. */
void er_exchange_bends_along(const er_instance *instance, const er_change *change, double *ways);

/* Ways of the elements, behind those of gears those of motors, to their slip angles [rad], of those that slip to the
 * reversal of their coordinates, which is their rate times ER_REVERSAL_TIME; 1 of motors that do not move by
 * themselves; and how they change. */
void er_exchange_slips(const er_instance *instance, double *ways);
void er_exchange_slips_along(const er_instance *instance, const er_change *change, double *ways);

/* Ways of the motors' servos to their torque limits [N m], 1 without one or without servo; and how they change. */
void er_exchange_limits(const er_instance *instance, double *ways);
void er_exchange_limits_along(const er_instance *instance, const er_change *change, double *ways);

/* Chooses pieces, and which elements slip, anew, as events do: `changed` tells of elongations that are other ones
 * now.  Time must be one of the trajectory's. */
bool er_exchange_settle(er_instance *instance, bool *changed);

/* Whether a gear has left its piece; and refuses times that the trajectory does not cover. */
bool er_exchange_completed(er_instance *instance, bool *has_event);

/* The next time event; infinite if there is none. */
double er_exchange_next_event(er_instance *instance);

/* Takes a time [s]. */
bool er_exchange_set_time(er_instance *instance, double time);

#endif
