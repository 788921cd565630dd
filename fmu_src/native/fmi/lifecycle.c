#include "lifecycle.h"

#include <stddef.h>

#define IN(phase) (1u << (phase))
#define BEFORE (IN(ER_INSTANTIATED) | IN(ER_INITIALISING))
#define ALIVE (BEFORE | IN(ER_RUNNING))
#define ALWAYS (ALIVE | IN(ER_TERMINATED))

/* The standards, and what masters do beyond them: some never enter initialisation mode, enter it before
 * they set up the experiment or read values before it.  A refused step ends nothing. */
static const struct {
    unsigned phases;     /* in which the call may be made */
    const char *refusal; /* elsewhere, but for the terminated instance */
} calls[] = {
    [ER_CALL_SETUP] = {BEFORE, "expected the experiment's setup before initialisation ends, got it"
                               " after"},
    [ER_CALL_ENTER] = {BEFORE, "expected a reset before initialisation is entered again, got none"},
    [ER_CALL_EXIT] = {ALIVE, NULL},
    [ER_CALL_STEP] = {IN(ER_RUNNING), "expected initialisation's end before a step, got the step first"},
    [ER_CALL_SET] = {ALIVE, NULL},
    [ER_CALL_SET_STRING] = {BEFORE, "strings are fixed; set them before initialisation ends"},
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
