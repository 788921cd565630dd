/* An instance, PythonFMU's, and what its host is told; and that library, with Python, in this process. */
#ifndef ER_COMPONENT_H
#define ER_COMPONENT_H

#include <stdbool.h>

#include "../native/io/file.h"
#include "../native/fmi/fmi2Functions.h"

/* PythonFMU's functions of FMI 2.0 for co-simulation. */
#define ER_EACH_FUNCTION(DO)                                                                        \
    DO(fmi2SetDebugLogging)                                                                         \
    DO(fmi2Instantiate)                                                                             \
    DO(fmi2FreeInstance)                                                                            \
    DO(fmi2SetupExperiment)                                                                         \
    DO(fmi2EnterInitializationMode)                                                                 \
    DO(fmi2ExitInitializationMode)                                                                  \
    DO(fmi2Terminate)                                                                               \
    DO(fmi2Reset)                                                                                   \
    DO(fmi2GetReal)                                                                                 \
    DO(fmi2GetInteger)                                                                              \
    DO(fmi2GetBoolean)                                                                              \
    DO(fmi2GetString)                                                                               \
    DO(fmi2SetReal)                                                                                 \
    DO(fmi2SetInteger)                                                                              \
    DO(fmi2SetBoolean)                                                                              \
    DO(fmi2SetString)                                                                               \
    DO(fmi2GetFMUstate)                                                                             \
    DO(fmi2SetFMUstate)                                                                             \
    DO(fmi2FreeFMUstate)                                                                            \
    DO(fmi2SerializedFMUstateSize)                                                                  \
    DO(fmi2SerializeFMUstate)                                                                       \
    DO(fmi2DeSerializeFMUstate)                                                                     \
    DO(fmi2GetDirectionalDerivative)                                                                \
    DO(fmi2SetRealInputDerivatives)                                                                 \
    DO(fmi2GetRealOutputDerivatives)                                                                \
    DO(fmi2DoStep)                                                                                  \
    DO(fmi2CancelStep)                                                                              \
    DO(fmi2GetStatus)                                                                               \
    DO(fmi2GetRealStatus)                                                                           \
    DO(fmi2GetIntegerStatus)                                                                        \
    DO(fmi2GetBooleanStatus)                                                                        \
    DO(fmi2GetStringStatus)

#define ER_DECLARE(name) name##TYPE *name;
typedef struct {
    ER_EACH_FUNCTION(ER_DECLARE)
} er_inner;

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

/* Python and PythonFMU's library (library_linux.c, library_windows.c): found, loaded, never unloaded.
 *
 * The variable that names the Python program, and what stands between name and suffix of PythonFMU's
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
