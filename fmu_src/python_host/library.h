/* Python and PythonFMU's library in this process: found, loaded, never unloaded. */
#ifndef ER_LIBRARY_H
#define ER_LIBRARY_H

#include <stdbool.h>

#include "../native/io/failure.h"

/* The variable that names the Python program, and what stands between name and suffix of PythonFMU's
 * library, which lies beside this one. */
#define ER_PYTHON_VARIABLE "ELASTIC_ROBOT_PYTHON"
#define ER_INNER_SUFFIX "_pythonfmu"

/* Makes Python's functions known in this process.  `program` is set to the Python program that they were
 * found by, or to NULL if they were there before. */
bool er_require_python(const char **program, er_failure *failure);

/* A function of Python, NULL if there is none of this name. */
void *er_python_function(const char *name);

/* Loads PythonFMU's library; NULL if it does not load.  Needs Python to be there. */
void *er_load_inner(er_failure *failure);

/* A function of a library, NULL if there is none of this name. */
void *er_function(void *library, const char *name);

/* Does the work at the first call; later calls, also from other threads, wait until it is done. */
void er_once(void (*work)(void));

#endif
