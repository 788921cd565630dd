/* Calls of FMI 3.0 by the names that programs of random calls have for both versions. */
#ifndef CALLS_FMI3_H
#define CALLS_FMI3_H

#include "fmi3Functions.h"
#include "request.h"

typedef fmi3Instance instance;
typedef fmi3FMUState saved;
typedef fmi3Status status_of_call;
#define GOOD fmi3OK
#define REFUSED fmi3Error
#define DISCARDED fmi3Discard

static long messages;

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                        fmi3String message)
{
    (void)environment;
    CHECK(category != NULL && strlen(message) > 10);
    CHECK(strcmp(category, "logEvents") == 0 ? status == fmi3OK
                                             : status == fmi3Error || status == fmi3Discard);
    messages++;
}

#define CALL(name) fmi3##name
#define DRAW_REQUEST draw_sized_request
#define GET_BY(c, r, references) fmi3GetFloat64(c, references, (r).count, (r).values, (r).size)
#define SET_TO(c, r, values) fmi3SetFloat64(c, (r).references, (r).count, values, (r).size)
#define DERIVE_ALONG(c, of, by, seed)                                                               \
    fmi3GetDirectionalDerivative(c, (of).references, (of).count, (by).references, (by).count, seed, \
                                 (by).size, (of).values, (of).size)
#define GET_TEXTS(c, references, count, texts, size) fmi3GetString(c, references, count, texts, size)
#define SET_TEXTS(c, references, count, texts, size) fmi3SetString(c, references, count, texts, size)
#define SAVE fmi3GetFMUState
#define RESTORE fmi3SetFMUState
#define FREE_STATE fmi3FreeFMUState
#define SIZE_OF_STATE fmi3SerializedFMUStateSize
#define SERIALIZE(c, state, bytes, size) fmi3SerializeFMUState(c, state, (fmi3Byte *)(bytes), size)
#define DESERIALIZE(c, bytes, size, place)                                                          \
    fmi3DeserializeFMUState(c, (const fmi3Byte *)(bytes), size, place)

#endif
