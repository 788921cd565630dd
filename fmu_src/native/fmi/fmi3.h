/* What the files of FMI 3.0 share. */
#ifndef ER_FMI3_H
#define ER_FMI3_H

#include "fmi3Functions.h"

/* Tells the master a sentence and returns fmi3Error. */
fmi3Status er_fmi3_refuse(fmi3Instance instance, const char *text);

#endif
