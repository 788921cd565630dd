/* What the files of FMI 3.0 share. */
#ifndef ER_FMI3_H
#define ER_FMI3_H

#include "component.h"
#include "fmi3Functions.h"

/* A robot whose data are among the resources; NULL, with the reason, if that fails. */
er_instance *er_fmi3_create(fmi3String token, fmi3String resources, er_failure *failure);

er_log er_fmi3_log(bool on, fmi3LogMessageCallback function, fmi3InstanceEnvironment environment);

#endif
