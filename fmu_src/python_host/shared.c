#include "shared.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>

void er_shared_attach(er_shared *shared, const er_inner *functions, fmi2Component instance)
{
    static const fmi2ValueReference reference = ER_SHARED_REFERENCE;
    unsigned long long values, states, count;
    fmi2String text = NULL;
    *shared = (er_shared){NULL, NULL, 0};
    if (functions->fmi2GetString(instance, &reference, 1, &text) != fmi2OK || text == NULL ||
        sscanf(text, "%llu %llu %llu", &values, &states, &count) != 3)
        return;
    shared->values = (double *)(uintptr_t)values;
    shared->states = (unsigned char *)(uintptr_t)states;
    shared->count = (size_t)count;
}

bool er_shared_set(const er_shared *shared, const fmi2ValueReference references[], size_t count,
                   const fmi2Real values[])
{
    for (size_t i = 0; i < count; i++)
        if (references[i] >= shared->count || shared->states[references[i]] != ER_SETTABLE ||
            !isfinite(values[i]))
            return false;
    for (size_t i = 0; i < count; i++)
        shared->values[references[i]] = values[i];
    return count > 0;
}

bool er_shared_get(const er_shared *shared, const fmi2ValueReference references[], size_t count,
                   fmi2Real values[])
{
    for (size_t i = 0; i < count; i++)
        if (references[i] >= shared->count || shared->states[references[i]] == ER_ASK ||
            !isfinite(shared->values[references[i]]))
            return false;
    for (size_t i = 0; i < count; i++) {
        values[i] = shared->values[references[i]];
        if (shared->states[references[i]] == ER_READABLE)
            shared->states[references[i]] = ER_WAS_READ;
    }
    return count > 0;
}
