#include "lifecycle.h"

#include <stddef.h>

#define IN(phase) (1u << (phase))
#define BEFORE (IN(ER_INSTANTIATED) | IN(ER_INITIALISING))
#define ALIVE (BEFORE | IN(ER_RUNNING))
#define EXCHANGING (IN(ER_EVENT_MODE) | IN(ER_CONTINUOUS_MODE))
#define ALWAYS (ALIVE | EXCHANGING | IN(ER_TERMINATED))
#define BEGUN (ALWAYS & ~IN(ER_INSTANTIATED))

/* The table of FMI 2.0, section 4.2.4, and the states of FMI 3.0, sections 2.3 and 4.2.  A refused call
 * ends nothing. */
static const struct {
    unsigned phases;     /* in which the call may be made */
    const char *refusal; /* elsewhere, but for the terminated instance */
} calls[] = {
    [ER_CALL_SETUP] = {IN(ER_INSTANTIATED),
                       "expected the experiment's setup before initialisation is entered, got it"
                       " after"},
    [ER_CALL_ENTER] = {IN(ER_INSTANTIATED),
                       "expected a reset before initialisation is entered again, got none"},
    [ER_CALL_EXIT] = {IN(ER_INITIALISING),
                      "expected initialisation to be entered before its end, and to end once, got"
                      " its end"},
    [ER_CALL_STEP] = {IN(ER_RUNNING),
                      "expected initialisation's end before a step, got the step first"},
    [ER_CALL_TERMINATE] = {IN(ER_RUNNING) | EXCHANGING,
                           "expected initialisation's end before termination, got the termination"
                           " first"},
    [ER_CALL_SET] = {ALIVE | EXCHANGING, NULL},
    [ER_CALL_SET_FIXED] = {BEFORE, "strings are fixed; set them before initialisation ends"},
    [ER_CALL_GET] = {BEGUN, "expected initialisation to be entered before values are read, got it"
                            " after"},
    [ER_CALL_GET_START] = {ALWAYS, NULL},
    [ER_CALL_DERIVE] = {BEGUN, "expected initialisation to be entered before derivatives are asked for,"
                               " got it after"},
    [ER_CALL_RESULT] = {IN(ER_RUNNING) | IN(ER_TERMINATED),
                        "expected initialisation's end before a step is asked about, got it after"},
    [ER_CALL_EVENT_MODE] = {EXCHANGING, "expected initialisation's end before event mode is entered, got"
                                        " the mode first"},
    [ER_CALL_EVENT] = {IN(ER_CONTINUOUS_MODE), "expected continuous-time mode before event mode is entered,"
                                               " got another"},
    [ER_CALL_UPDATE] = {IN(ER_EVENT_MODE), "expected event mode before discrete states are updated or"
                                           " continuous-time mode is entered, got another"},
    [ER_CALL_COMPLETED] = {IN(ER_CONTINUOUS_MODE), "expected continuous-time mode at the end of an"
                                                   " integrator's step, got another"},
    [ER_CALL_SET_TIME] = {EXCHANGING, "expected initialisation's end before time is set, got it first"},
    [ER_CALL_SET_STATES] = {IN(ER_CONTINUOUS_MODE), "expected continuous-time mode before continuous"
                                                    " states are set, got another"},
    [ER_CALL_GET_STATES] = {IN(ER_INITIALISING) | EXCHANGING | IN(ER_TERMINATED),
                            "expected initialisation mode or a later one for continuous states,"
                            " derivatives and event indicators, got none"},
    [ER_CALL_ANY] = {ALWAYS, NULL},
};

const char *er_refusal(er_phase phase, er_call call)
{
    if ((calls[call].phases & IN(phase)) != 0)
        return NULL;
    return phase == ER_TERMINATED ? "expected a reset or an earlier state after the simulation's"
                                    " termination, got another call"
                                  : calls[call].refusal;
}
