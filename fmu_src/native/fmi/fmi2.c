/* The functions of FMI 2.0. */
#include "fmi2Functions.h"

#include <math.h>
#include <stdlib.h>

#include "../io/file.h"
#include "component.h"
#include "log_categories.h"
#include "derivative.h"
#include "exchange_calls.h"
#include "saved_state.h"
#include "variables.h"

#define FMI(name) fmi2##name
#include "shared_functions.h"

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

/* Masters format messages like printf, and # begins the reference of a variable. */
static void tell_fmi2(const er_component *c, int status, const char *category, const char *text)
{
    char escaped[ER_ESCAPED_TEXT];
    er_escape(text, "%#", escaped);
    ((fmi2CallbackLogger)c->log.function)(c->log.environment, c->name, (fmi2Status)status, category, escaped);
}

static er_instance *create_for_fmi2(fmi2Type type, fmi2String guid, fmi2String location, er_failure *failure)
{
    char *file = er_path_from_uri(location, ER_ROBOT_FILE);
    er_instance *robot = NULL;
    if (guid == NULL)
        er_fail(failure, "GUID: expected that of modelDescription.xml, got none");
    else if (file == NULL)
        er_fail(failure, "resources: expected a file: URI, got '%.300s'", location != NULL ? location : "");
    else
        robot = er_instance_create(file, guid, failure);
    if (robot != NULL)
        robot->exchange.on = type == fmi2ModelExchange;
    free(file);
    return robot;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    er_log log = {tell_fmi2, NULL, NULL, logging != fmi2False ? ER_LOG_ALL : 0};
    er_failure failure;
    (void)visible;
    if (functions != NULL) {
        log.function = (void (*)(void))functions->logger;
        log.environment = functions->componentEnvironment;
    }
    return er_component_create(name, log, create_for_fmi2(type, guid, location, &failure), &failure);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean logging, size_t count, const fmi2String categories[])
{
    return er_status(er_component_log(c, logging != fmi2False, false, categories, count));
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    return er_status(er_component_setup(c, start, has_stop ? stop : INFINITY, has_tolerance ? tolerance : 0.0));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return er_status(er_component_enter(c));
}

fmi2Status fmi2GetReal(fmi2Component instance, const fmi2ValueReference references[], size_t count, fmi2Real values[])
{
    er_component *c = instance;
    return er_status_tried(c, er_component_may(c, ER_CALL_GET) && er_component_given(c, count, references, values) &&
                                  er_component_tried(c, er_instance_get_reals(c->robot, references, count, values)));
}

fmi2Status fmi2SetReal(fmi2Component instance, const fmi2ValueReference references[], size_t count,
                       const fmi2Real values[])
{
    return er_status_taken(instance, er_component_set_reals(instance, references, count, values));
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2String values[])
{
    return er_status(er_component_get_strings(c, ER_CALL_GET, references, count, values));
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference references[], size_t count,
                         const fmi2String values[])
{
    return er_status_tried(c, er_component_set_strings(c, references, count, values));
}

#define NO_VARIABLES(Type, kind)                                                                    \
    fmi2Status fmi2Get##Type(fmi2Component c, const fmi2ValueReference references[], size_t count,  \
                             fmi2##Type values[])                                                   \
    {                                                                                               \
        (void)values;                                                                               \
        return er_status(                                                                              \
            er_component_none_of(c, ER_CALL_GET, kind, "real and string", references, count));      \
    }                                                                                               \
    fmi2Status fmi2Set##Type(fmi2Component c, const fmi2ValueReference references[], size_t count,  \
                             const fmi2##Type values[])                                             \
    {                                                                                               \
        (void)values;                                                                               \
        return er_status(                                                                              \
            er_component_none_of(c, ER_CALL_SET, kind, "real and string", references, count));      \
    }

NO_VARIABLES(Integer, "integer")
NO_VARIABLES(Boolean, "boolean")

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return er_status(er_component_get_state(c, state));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    return er_status(er_component_set_state(c, state));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return er_status(er_component_free_state(c, state));
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    return er_status(er_component_state_size(c, state, size));
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return er_status(er_component_serialise(c, state, bytes, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    return er_status(er_component_deserialise(c, bytes, size, state));
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component instance,
                                        const fmi2ValueReference unknowns[], size_t unknown_count,
                                        const fmi2ValueReference knowns[], size_t known_count,
                                        const fmi2Real seed[], fmi2Real sensitivity[])
{
    er_component *c = instance;
    return er_status(er_component_may(c, ER_CALL_DERIVE) &&
                     er_component_given(c, unknown_count, unknowns, sensitivity) &&
                     er_component_given(c, known_count, knowns, seed) &&
                     er_component_told(c, er_instance_derivative(c->robot, unknowns, unknown_count,
                                                                 knowns, known_count, seed, sensitivity)));
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component instance, const fmi2ValueReference references[], size_t count,
                                       const fmi2Integer order[], const fmi2Real values[])
{
    er_component *c = instance;
    bool good = er_component_set_derivatives(c, references, count, order, values);
    return good && c->warns ? fmi2Warning : er_status(good);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference references[],
                                        size_t count, const fmi2Integer order[], fmi2Real values[])
{
    (void)references;
    (void)order;
    (void)values;
    return er_status(er_component_may(c, ER_CALL_RESULT) && (count == 0 ||
                      er_component_refuse(c, "output derivatives are asked for; there are none")));
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_set_state)
{
    (void)no_set_state;
    return er_status_tried(c, er_component_step(c, time, size));
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return er_status(er_component_refuse(c, "a step is cancelled; steps of this FMU are not asynchronous"));
}

/* Whether a status is one that is there; the others are those of steps that are still under way. */
static fmi2Status status_of_request(er_component *c, bool there, const void *value)
{
    if (!er_component_may_step(c, ER_CALL_RESULT) || !er_component_given(c, 1, value, value))
        return fmi2Error;
    if (there)
        return fmi2OK;
    er_component_discard(c, "a status is asked for that only a step under way has; steps of this FMU are"
                         " done when fmi2DoStep returns");
    return fmi2Discard;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    fmi2Status answer = status_of_request(c, false, value);
    (void)kind;
    if (answer == fmi2Discard)
        *value = fmi2OK;
    return answer;
}

fmi2Status fmi2GetRealStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2Real *value)
{
    er_component *c = instance;
    fmi2Status answer = status_of_request(c, kind == fmi2LastSuccessfulTime, value);
    if (answer == fmi2OK)
        *value = c->robot->progress.time;
    return answer;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)kind;
    return status_of_request(c, false, value);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    fmi2Status answer = status_of_request(c, kind == fmi2Terminated, value);
    if (answer != fmi2Error)
        *value = fmi2False;
    return answer;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)kind;
    return status_of_request(c, false, value);
}

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    return er_status(er_component_enter_event(c, ER_CALL_EVENT_MODE));
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    er_event_update update;
    if (!er_component_given(c, 1, info, info) || !er_component_update(c, &update))
        return fmi2Error;
    info->newDiscreteStatesNeeded = fmi2False;
    info->terminateSimulation = fmi2False;
    info->nominalsOfContinuousStatesChanged = fmi2False;
    info->valuesOfContinuousStatesChanged = update.has_changed ? fmi2True : fmi2False;
    info->nextEventTimeDefined = update.has_next ? fmi2True : fmi2False;
    info->nextEventTime = update.has_next ? update.next_time : 0.0;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set_state,
                                       fmi2Boolean *enter_event_mode, fmi2Boolean *terminate)
{
    bool has_event;
    (void)no_set_state;
    if (!er_component_given(c, 1, enter_event_mode, terminate) || !er_component_completed(c, &has_event))
        return fmi2Error;
    *enter_event_mode = has_event ? fmi2True : fmi2False;
    *terminate = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_STATE_DERIVATIVES, derivatives, count));
}

