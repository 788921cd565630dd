/* An instance: PythonFMU's, and what its host is told. */
#ifndef ER_COMPONENT_H
#define ER_COMPONENT_H

#include <stdbool.h>

#include "inner.h"

typedef struct {
    const er_inner *functions;
    fmi2Component inner;
    fmi2CallbackFunctions host;
    fmi2CallbackFunctions relayed;
    unsigned log;     /* categories of messages that the host wants */
    bool told;        /* the present call has logged an error */
    bool warned;      /* the present call has logged a warning */
    bool discards;    /* the last exception leaves the host another try */
    bool lost;        /* a reset failed: PythonFMU's instance is no more */
    er_failure cause; /* of the last exception, as PythonFMU words it */
    char name[];
} er_component;

/* An instance without PythonFMU's; NULL if memory is short. */
er_component *er_component_create(fmi2String name, const fmi2CallbackFunctions *functions);

void er_component_free(er_component *c);

/* Gives the host's log a sentence, where it is on. */
void er_component_tell(const er_component *c, fmi2Status status, const char *text);

/* Tells the host's log and stderr a sentence; fmi2Error. */
fmi2Status er_component_refuse(const er_component *c, const char *text);

/* Whether there is an array where there is something to put into it; if not, the host is told. */
bool er_component_given(const er_component *c, size_t count, const void *first, const void *second);

/* Before a call of PythonFMU's library: whether there is an instance to call. */
bool er_component_begin(er_component *c);

/* What a call without such an instance is answered. */
fmi2Status er_component_none(const er_component *c);

/* After it: the status for the host.  A Python exception, fmi2Fatal there, is fmi2Error, or fmi2Discard where
 * the slave says so. */
fmi2Status er_component_end(er_component *c, fmi2Status status);

#define ER_PASS_ON(instance, function, ...)                                                         \
    er_component *c = instance;                                                                     \
    return er_component_begin(c)                                                                    \
               ? er_component_end(c, c->functions->function(c->inner, __VA_ARGS__))                 \
               : er_component_none(c)

#define ER_PASS_ON_ALONE(instance, function)                                                        \
    er_component *c = instance;                                                                     \
    return er_component_begin(c) ? er_component_end(c, c->functions->function(c->inner))            \
                                 : er_component_none(c)

#endif
