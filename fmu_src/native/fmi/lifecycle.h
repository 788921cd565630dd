/* Which call may be made when: the states of an instance and one table for FMI 2.0 and FMI 3.0. */
#ifndef ER_LIFECYCLE_H
#define ER_LIFECYCLE_H


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

#endif
