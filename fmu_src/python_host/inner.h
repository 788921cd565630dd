/* PythonFMU's library: its functions of FMI 2.0 for co-simulation. */
#ifndef ER_INNER_H
#define ER_INNER_H

#include "../native/io/failure.h"
#include "../native/fmi/fmi2Functions.h"

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

/* The functions, after starting Python and loading the library at the first call in this process; NULL with
 * the reason if that failed. */
const er_inner *er_inner_functions(er_failure *failure);

#endif
