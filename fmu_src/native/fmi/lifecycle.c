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
    [ER_CALL_SETUP] = {BEFORE, "the experiment is set up after initialisation; needed is to do so"
                               " before"},
    [ER_CALL_ENTER] = {BEFORE, "initialisation is entered after it has ended; needed is a reset"
                               " first"},
    [ER_CALL_EXIT] = {ALIVE, NULL},
    [ER_CALL_STEP] = {IN(ER_RUNNING), "a step is asked for before initialisation has ended; needed is to"
                                      " end it first"},
    [ER_CALL_SET] = {ALIVE, NULL},
    [ER_CALL_SET_STRING] = {BEFORE, "strings are fixed; set them before initialisation ends"},
    [ER_CALL_ANY] = {ALWAYS, NULL},
};

const char *er_refusal(er_phase phase, er_call call)
{
    if ((calls[call].phases & IN(phase)) != 0)
        return NULL;
    return phase == ER_TERMINATED ? "the simulation has been terminated; expected a reset or an earlier"
                                    " state before it goes on"
                                  : calls[call].refusal;
}
