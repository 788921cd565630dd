/* Calls of FMI 2.0 by the names that programs of random calls have for both versions. */
#ifndef CALLS_FMI2_H
#define CALLS_FMI2_H

#include "fmi2Functions.h"
#include "request.h"

typedef fmi2Component instance;
typedef fmi2FMUstate saved;
typedef fmi2Status status_of_call;
#define GOOD fmi2OK
#define REFUSED fmi2Error
#define DISCARDED fmi2Discard

static long messages;

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String message, ...)
{
    (void)environment;
    CHECK(name != NULL && category != NULL && strlen(message) > 10);
    CHECK(strcmp(category, "logEvents") == 0 ? status == fmi2OK
                                             : status >= fmi2Warning && status <= fmi2Error);
    messages++;
}

static const fmi2CallbackFunctions callbacks = {log_message, NULL, NULL, NULL, NULL};

#define CALL(name) fmi2##name
#define DRAW_REQUEST draw_request
#define GET_BY(c, r, references) fmi2GetReal(c, references, (r).count, (r).values)
#define SET_TO(c, r, values) fmi2SetReal(c, (r).references, (r).count, values)
#define DERIVE_ALONG(c, of, by, seed)                                                               \
    fmi2GetDirectionalDerivative(c, (of).references, (of).count, (by).references, (by).count, seed, \
                                 (of).values)
#define GET_TEXTS(c, references, count, texts, size) fmi2GetString(c, references, size, texts)
#define SET_TEXTS(c, references, count, texts, size) fmi2SetString(c, references, count, texts)
#define SAVE fmi2GetFMUstate
#define RESTORE fmi2SetFMUstate
#define FREE_STATE fmi2FreeFMUstate
#define SIZE_OF_STATE fmi2SerializedFMUstateSize
#define SERIALIZE(c, state, bytes, size) fmi2SerializeFMUstate(c, state, bytes, size)
#define DESERIALIZE(c, bytes, size, place) fmi2DeSerializeFMUstate(c, bytes, size, place)

#endif
