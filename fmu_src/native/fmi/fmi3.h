/* What the files of FMI 3.0 share. */
#ifndef ER_FMI3_H
#define ER_FMI3_H

#include "component.h"
#include "fmi3Functions.h"

/* A robot whose data are among the resources; NULL, with the reason, if that fails. */
er_instance *er_fmi3_create(fmi3String token, fmi3String resources, er_failure *failure);

er_log er_fmi3_log(bool on, fmi3LogMessageCallback function, fmi3InstanceEnvironment environment);

/* The status of a call that may be tried again where its refusal says so. */
static inline fmi3Status er_fmi3_tried(const er_component *c, bool good)
{
    return good ? fmi3OK : c != NULL && c->discards ? fmi3Discard : fmi3Error;
}

#endif
