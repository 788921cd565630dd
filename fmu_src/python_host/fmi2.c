/* The functions of FMI 2.0 for co-simulation, passed on to PythonFMU's library.
 *
 * Different from there: an exception in Python is fmi2Error, as the instance can go on; what PythonFMU would
 * not survive is refused with a sentence.
 */
#include <string.h>

#include "component.h"
#include "../native/fmi/log_categories.h"
#include "../native/io/file.h"

/* The end of the last step, to be read; process_slave.py has the same. */
#define LAST_TIME (1u << 30)

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component instance, fmi2Boolean logging, size_t count,
                               const fmi2String categories[])
{
    er_component *c = instance;
    unsigned chosen;
    if (!er_component_begin(c))
        return er_component_none(c);
    if (!er_log_chosen(categories, count, &chosen))
        return er_component_refuse(c, ER_LOG_REFUSAL);
    c->log = logging != fmi2False ? chosen : 0;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component instance, fmi2Boolean has_tolerance,
                               fmi2Real tolerance, fmi2Real start, fmi2Boolean has_stop,
                               fmi2Real stop)
{
    ER_PASS_ON(instance, fmi2SetupExperiment, has_tolerance, tolerance, start, has_stop, stop);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component instance)
{
    ER_PASS_ON_ALONE(instance, fmi2EnterInitializationMode);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component instance)
{
    ER_PASS_ON_ALONE(instance, fmi2ExitInitializationMode);
}

fmi2Status fmi2Terminate(fmi2Component instance)
{
    ER_PASS_ON_ALONE(instance, fmi2Terminate);
}

fmi2Status fmi2Reset(fmi2Component instance)
{
    er_component *c = instance;
    fmi2Status status;
    if (!er_component_begin(c))
        return er_component_none(c);
    status = c->functions->fmi2Reset(c->inner);
    if (status == fmi2Fatal) {
        c->lost = true;
        er_component_tell(c, fmi2Fatal, c->cause.text);
    }
    return status;
}

fmi2Status fmi2DoStep(fmi2Component instance, fmi2Real time, fmi2Real size, fmi2Boolean keep)
{
    ER_PASS_ON(instance, fmi2DoStep, time, size, keep);
}

fmi2Status fmi2CancelStep(fmi2Component instance)
{
    ER_PASS_ON_ALONE(instance, fmi2CancelStep);
}

/* Whether some texts are UTF-8; with others PythonFMU frees its instance twice. */
static bool are_texts(const er_component *c, const fmi2String texts[], size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (texts[i] != NULL && !er_is_utf8(texts[i])) {
            er_component_refuse(c, "string: expected UTF-8, got other bytes");
            return false;
        }
    return true;
}

/* Whether no reference can be taken for that of the last time. */
static bool are_own(er_component *c, const fmi2ValueReference references[], size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (references[i] >= LAST_TIME) {
            er_fail(&c->cause, "value reference of a real variable: expected one of this FMU, got %u",
                    references[i]);
            er_component_refuse(c, c->cause.text);
            return false;
        }
    return true;
}

/* Functions of the same form for each type of value. */
#define VALUES(type, given, good)                                                                   \
    fmi2Status fmi2Get##type(fmi2Component instance, const fmi2ValueReference references[],         \
                             size_t count, fmi2##type values[])                                     \
    {                                                                                               \
        er_component *c = instance;                                                                 \
        if (!er_component_begin(c))                                                                 \
            return er_component_none(c);                                                            \
        if (!er_component_given(c, count, references, values) || !(given))                          \
            return fmi2Error;                                                                       \
        return er_component_end(c, c->functions->fmi2Get##type(c->inner, references, count, values));  \
    }                                                                                               \
    fmi2Status fmi2Set##type(fmi2Component instance, const fmi2ValueReference references[],         \
                             size_t count, const fmi2##type values[])                               \
    {                                                                                               \
        er_component *c = instance;                                                                 \
        if (!er_component_begin(c))                                                                 \
            return er_component_none(c);                                                            \
        if (!er_component_given(c, count, references, values) || !(good))                           \
            return fmi2Error;                                                                       \
        return er_component_end(c, c->functions->fmi2Set##type(c->inner, references, count, values));  \
    }

VALUES(Real, are_own(c, references, count), are_own(c, references, count))
VALUES(Integer, true, true)
VALUES(Boolean, true, true)
VALUES(String, true, are_texts(c, values, count))

#define STATUS(type)                                                                                \
    fmi2Status fmi2Get##type##Status(fmi2Component instance, const fmi2StatusKind kind,             \
                                     fmi2##type *value)                                             \
    {                                                                                               \
        er_component *c = instance;                                                                 \
        if (!er_component_begin(c))                                                                 \
            return er_component_none(c);                                                            \
        if (!er_component_given(c, 1, value, value))                                                \
            return fmi2Error;                                                                       \
        return er_component_end(c, c->functions->fmi2Get##type##Status(c->inner, kind, value));     \
    }

STATUS(Integer)
STATUS(Boolean)
STATUS(String)

/* PythonFMU does not know of states that are set, nor of the start. */
fmi2Status fmi2GetRealStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2Real *value)
{
    static const fmi2ValueReference last_time = LAST_TIME;
    er_component *c = instance;
    if (!er_component_begin(c))
        return er_component_none(c);
    if (!er_component_given(c, 1, value, value))
        return fmi2Error;
    if (kind != fmi2LastSuccessfulTime)
        return er_component_end(c, c->functions->fmi2GetRealStatus(c->inner, kind, value));
    return er_component_end(c, c->functions->fmi2GetReal(c->inner, &last_time, 1, value));
}

/* PythonFMU's answers Error. */
fmi2Status fmi2GetStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2Status *value)
{
    er_component *c = instance;
    (void)kind;
    if (!er_component_begin(c))
        return er_component_none(c);
    if (!er_component_given(c, 1, value, value))
        return fmi2Error;
    *value = fmi2OK;
    er_component_tell(c, fmi2Discard, "a status is asked for that only a step under way has; steps of this"
                      " FMU are done when fmi2DoStep returns");
    return fmi2Discard;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component instance,
                                        const fmi2ValueReference unknowns[], size_t unknown_count,
                                        const fmi2ValueReference knowns[], size_t known_count,
                                        const fmi2Real seed[], fmi2Real sensitivity[])
{
    ER_PASS_ON(instance, fmi2GetDirectionalDerivative, unknowns, unknown_count, knowns, known_count,
            seed, sensitivity);
}

/* PythonFMU has no such function: the slave takes derivatives as reals, whose references are larger by
 * OF_DERIVATIVES. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component instance,
                                       const fmi2ValueReference references[], size_t count,
                                       const fmi2Integer order[], const fmi2Real values[])
{
    ER_PASS_ON(instance, fmi2SetRealInputDerivatives, references, count, order, values);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component instance,
                                        const fmi2ValueReference references[], size_t count,
                                        const fmi2Integer order[], fmi2Real values[])
{
    ER_PASS_ON(instance, fmi2GetRealOutputDerivatives, references, count, order, values);
}

/* Saved states.  PythonFMU's are addresses of Python objects, which it takes as they come; and it leaves a
 * freed one's address in place. */

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
