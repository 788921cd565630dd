/* Which call may be made when: the states of an instance and one table for FMI 2.0 and FMI 3.0. */
#ifndef ER_LIFECYCLE_H
#define ER_LIFECYCLE_H

typedef enum {
    ER_INSTANTIATED,
    ER_INITIALISING, /* initialisation mode */
    ER_RUNNING,      /* initialisation has ended: step mode */
    ER_TERMINATED
} er_phase;

/* Calls that have the same rights. */
typedef enum {
    ER_CALL_SETUP,      /* fmi2SetupExperiment */
    ER_CALL_ENTER,      /* EnterInitializationMode */
    ER_CALL_EXIT,       /* ExitInitializationMode */
    ER_CALL_STEP,       /* DoStep */
    ER_CALL_SET,        /* SetReal, SetFloat64 */
    ER_CALL_SET_STRING, /* SetString, of fixed parameters only */
    ER_CALL_ANY         /* Get.., FMU states, derivatives, logging, Terminate, Reset */
} er_call;

/* Why a call is refused in a phase; NULL if it is not. */
const char *er_refusal(er_phase phase, er_call call);

#endif
