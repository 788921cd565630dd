/* Saved states.  PythonFMU's are addresses of Python objects, which it takes as they come; and it leaves a
 * freed one's address in place. */
#include <stdlib.h>

#include "component.h"

static bool lacks(const er_component *c, fmi2FMUstate state)
{
    if (state == NULL)
        er_component_refuse(c, "state: expected one that this FMU has saved, got none");
    return state == NULL;
}

/* Frees the state that was in the host's place and puts the new one there. */
static fmi2Status replace(er_component *c, fmi2Status status, fmi2FMUstate made, fmi2FMUstate *place)
{
    if (status == fmi2OK) {
        if (*place != NULL)
            c->functions->fmi2FreeFMUstate(c->inner, place);
        *place = made;
    }
    return er_component_end(c, status);
}

fmi2Status fmi2GetFMUstate(fmi2Component instance, fmi2FMUstate *state)
{
    er_component *c = instance;
    fmi2FMUstate made = NULL;
    fmi2Status status;
    if (!er_component_begin(c))
        return er_component_none(c);
    if (!er_component_given(c, 1, state, state))
        return fmi2Error;
    status = c->functions->fmi2GetFMUstate(c->inner, &made);
    return replace(c, status, made, state);
}

/* Whether the slave takes a state, which it checks when it is set; it is then as before. */
static fmi2Status try_state(er_component *c, fmi2FMUstate made)
{
    fmi2FMUstate present = NULL;
    fmi2Status status = c->functions->fmi2GetFMUstate(c->inner, &present);
    if (status != fmi2OK)
        return status;
    status = c->functions->fmi2SetFMUstate(c->inner, made);
    if (status == fmi2OK)
        status = c->functions->fmi2SetFMUstate(c->inner, present);
    c->functions->fmi2FreeFMUstate(c->inner, &present);
    return status;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component instance, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    er_component *c = instance;
    fmi2FMUstate made = NULL;
    fmi2Status status;
    if (!er_component_begin(c))
        return er_component_none(c);
    if (!er_component_given(c, 1, state, state) || !er_component_given(c, size, bytes, bytes))
        return fmi2Error;
    status = c->functions->fmi2DeSerializeFMUstate(c->inner, bytes, size, &made);
    if (status == fmi2OK) {
        status = try_state(c, made);
        if (status != fmi2OK)
            c->functions->fmi2FreeFMUstate(c->inner, &made);
    }
    return replace(c, status, made, state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component instance, fmi2FMUstate *state)
{
    er_component *c = instance;
    fmi2Status status;
    if (!er_component_begin(c))
        return er_component_none(c);
    if (state == NULL || *state == NULL)
        return fmi2OK;
    status = c->functions->fmi2FreeFMUstate(c->inner, state);
    *state = NULL;
    return er_component_end(c, status);
}

fmi2Status fmi2SetFMUstate(fmi2Component instance, fmi2FMUstate state)
{
    er_component *c = instance;
    if (!er_component_begin(c))
        return er_component_none(c);
    if (lacks(c, state))
        return fmi2Error;
    return er_component_end(c, c->functions->fmi2SetFMUstate(c->inner, state));
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component instance, fmi2FMUstate state, size_t *size)
{
    er_component *c = instance;
    if (!er_component_begin(c))
        return er_component_none(c);
    if (lacks(c, state) || !er_component_given(c, 1, size, size))
        return fmi2Error;
    return er_component_end(c, c->functions->fmi2SerializedFMUstateSize(c->inner, state, size));
}

fmi2Status fmi2SerializeFMUstate(fmi2Component instance, fmi2FMUstate state, fmi2Byte bytes[],
                                 size_t size)
{
    er_component *c = instance;
    size_t needed = 0;
    fmi2Status status = fmi2SerializedFMUstateSize(instance, state, &needed);
    if (status != fmi2OK)
        return status;
    if (!er_component_given(c, size, bytes, bytes))
        return fmi2Error;
    if (size < needed)
        return er_component_refuse(c, "buffer: expected at least the state's size, got less");
    return er_component_end(c, c->functions->fmi2SerializeFMUstate(c->inner, state, bytes, needed));
}
