/* What the files of FMI 3.0 share. */
#ifndef ER_FMI3_H
#define ER_FMI3_H

#include "component.h"
#include "fmi3Functions.h"

er_log er_fmi3_log(bool on, fmi3LogMessageCallback function, fmi3InstanceEnvironment environment);

#endif
