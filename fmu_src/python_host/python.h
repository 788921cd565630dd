/* A Python interpreter in this process. */
#ifndef ER_PYTHON_H
#define ER_PYTHON_H

#include "../native/io/failure.h"

/* Starts Python where it does not run yet.  It then runs until the process is gone: it is not ended, since
 * numpy and its like cannot be loaded twice. */
bool er_start_python(er_failure *failure);

#endif
