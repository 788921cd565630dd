/* The functions of FMI 3.0, but for what is in fmi3_rest.c.
 *
 * Value references are those of FMI 2.0; an array has that of its first element, and the independent
 * variable, time, the first one behind all others.
 */
#include "fmi3Functions.h"

#include <math.h>
#include <stdlib.h>

#include "../io/file.h"
#include "component.h"
#include "exchange_calls.h"
#include "log_categories.h"
#include "derivative.h"
#include "saved_state.h"
#include "variables.h"

#define FMI(name) fmi3##name
#include "shared_functions.h"

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

/* # begins the reference of a variable. */
static void tell_fmi3(const er_component *c, int status, const char *category, const char *text)
{
    char escaped[ER_ESCAPED_TEXT];
    er_escape(text, "#", escaped);
    ((fmi3LogMessageCallback)c->log.function)(c->log.environment, (fmi3Status)status, category, escaped);
}

static er_log log_of(bool on, fmi3LogMessageCallback function, fmi3InstanceEnvironment environment)
{
    return (er_log){tell_fmi3, (void (*)(void))function, environment, on ? ER_LOG_ALL : 0};
}

static er_instance *create_for_fmi3(fmi3String token, fmi3String resources, er_failure *failure)
{
    char *file = er_path_in_folder(resources != NULL ? resources : "", ER_ROBOT_FILE);
    er_instance *robot = NULL;
    if (token == NULL)
        er_fail(failure, "instantiation token: expected that of modelDescription.xml, got none");
    else if (resources == NULL || resources[0] == '\0')
        er_fail(failure, "resources: expected the path of the unpacked FMU's, got none");
    else if (file == NULL)
        er_fail(failure, "the path of the resources does not fit into memory");
    else
        robot = er_instance_create(file, token, failure);
    free(file);
    return robot;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
    const fmi3ValueReference intermediate[], size_t intermediate_count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    er_instance *robot = NULL;
    er_failure failure;
    (void)visible;
    (void)early_return; /* allowed, never done */
    (void)intermediate;
    (void)update;
    if (event_mode)
        er_fail(&failure, "event mode is asked for; this FMU has none");
    else if (intermediate_count > 0)
        er_fail(&failure, "intermediate variables are asked for; this FMU has none");
    else
        robot = create_for_fmi3(token, resources, &failure);
    return er_component_create(name, log_of(logging, log, environment), robot, &failure);
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    er_failure failure;
    er_instance *robot = create_for_fmi3(token, resources, &failure);
    (void)visible;
    if (robot != NULL)
        robot->exchange.on = true;
    return er_component_create(name, log_of(logging, log, environment), robot, &failure);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback clock_update, fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    er_failure failure;
    (void)token;
    (void)resources;
    (void)visible;
    (void)clock_update;
    (void)lock;
    (void)unlock;
    er_fail(&failure, "scheduled execution is asked for; this FMU does co-simulation and model exchange");
    return er_component_create(name, log_of(logging, log, environment), NULL, &failure);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean logging, size_t count, const fmi3String categories[])
{
    return er_status(er_component_log(c, logging, true, categories, count));
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
{
    return er_status(er_component_may(c, ER_CALL_ENTER) && er_component_setup(c, start, has_stop ? stop : INFINITY,
                                        has_tolerance ? tolerance : 0.0) && er_component_enter(c));
}

static bool is_time(const er_component *c, fmi3ValueReference reference)
{
    return reference == er_time_reference(&c->robot->interface);
}

/* Checks that there is one value for each element of some variables. */
static bool require_count(er_component *c, const fmi3ValueReference references[], size_t count, size_t values)
{
    size_t elements = 0;
    for (size_t i = 0; i < count; i++) {
        int size = is_time(c, references[i]) ? 1 : er_array_size(&c->robot->interface, references[i]);
        if (size == 0)
            return er_fail(&c->robot->failure, "the value reference %u is asked for as a Float64"
                           " variable; this FMU has none there", references[i]);
        elements += (size_t)size;
    }
    if (elements == values)
        return true;
    return er_fail(&c->robot->failure, "values: expected one for each of %lu elements, got %lu",
                   (unsigned long)elements, (unsigned long)values);
}

/* Value references of the elements of one variable; returns their number. */
static size_t elements_of(const er_component *c, fmi3ValueReference reference, unsigned *elements)
{
    size_t size = is_time(c, reference)
                      ? 1 : (size_t)er_array_size(&c->robot->interface, reference);
    for (size_t k = 0; k < size; k++)
        elements[k] = reference + (unsigned)k;
    return size;
}

/* Value references of the elements of some variables, of which there are `values`. */
static bool expand_references(er_component *c, const fmi3ValueReference references[], size_t count, size_t values,
                   unsigned elements[ER_MAX_REALS])
{
    size_t total = 0;
    if (!require_count(c, references, count, values))
        return false;
    if (values > ER_MAX_REALS)
        return er_fail(&c->robot->failure, "values: expected at most %d in one call, got %lu",
                       c->robot->interface.reals, (unsigned long)values);
    for (size_t i = 0; i < count; i++)
        total += elements_of(c, references[i], elements + total);
    return true;
}

static bool get_elements(er_component *c, const fmi3ValueReference references[], size_t count,
                fmi3Float64 values[], size_t value_count)
{
    if (!require_count(c, references, count, value_count))
        return false;
    for (size_t i = 0; i < count; i++) {
        unsigned elements[ER_MAX_REALS];
        size_t size = elements_of(c, references[i], elements);
        if (is_time(c, references[i]))
            *values = c->robot->progress.time;
        else if (!er_instance_get_reals(c->robot, elements, size, values))
            return false;
        values += size;
    }
    return true;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                          fmi3Float64 values[], size_t value_count)
{
    return er_status_tried(c, er_component_may(c, ER_CALL_GET_START) &&
                                  er_component_given(c, count, references, values) &&
                                  er_component_tried(c, get_elements(c, references, count, values, value_count)));
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                          const fmi3Float64 values[], size_t value_count)
{
    unsigned elements[ER_MAX_REALS];
    return er_status_taken(c, er_component_may(c, ER_CALL_SET) && er_component_given(c, count, references, values) &&
                                  er_component_tried(c, expand_references(c, references, count, value_count, elements)) &&
                                  er_component_set_reals(c, elements, value_count, values));
}

/* A string variable has one value. */
static bool require_strings(er_component *c, size_t count, size_t values)
{
    return c == NULL || count == values ||
           er_component_told(c, er_fail(&c->robot->failure, "values: expected one for each of %lu string variables,"
                          " got %lu", (unsigned long)count, (unsigned long)values));
}

fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                         fmi3String values[], size_t value_count)
{
    return er_status(require_strings(c, count, value_count) &&
                     er_component_get_strings(c, ER_CALL_GET_START, references, count, values));
}

fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                         const fmi3String values[], size_t value_count)
{
    return er_status_tried(c, require_strings(c, count, value_count) &&
                                  er_component_set_strings(c, references, count, values));
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return er_status(er_component_get_state(c, state));
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    return er_status(er_component_set_state(c, state));
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return er_status(er_component_free_state(c, state));
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    return er_status(er_component_state_size(c, state, size));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return er_status(er_component_serialise(c, state, bytes, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    return er_status(er_component_deserialise(c, bytes, size, state));
}

static bool derive_elements(er_component *c, const fmi3ValueReference unknowns[], size_t unknown_count,
                   const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],
                   size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count)
{
    unsigned outputs[ER_MAX_REALS], inputs[ER_MAX_REALS];
    return expand_references(c, unknowns, unknown_count, sensitivity_count, outputs) &&
           expand_references(c, knowns, known_count, seed_count, inputs) &&
           er_instance_derivative(c->robot, outputs, sensitivity_count, inputs, seed_count, seed, sensitivity);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[],
                                        size_t unknown_count, const fmi3ValueReference knowns[],
                                        size_t known_count, const fmi3Float64 seed[],
                                        size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count)
{
    return er_status(er_component_may(c, ER_CALL_DERIVE) &&
                     er_component_given(c, unknown_count, unknowns, sensitivity) &&
                     er_component_given(c, known_count, knowns, seed) &&
                     er_component_told(c, derive_elements(c, unknowns, unknown_count, knowns, known_count, seed,
                                                 seed_count, sensitivity, sensitivity_count)));
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 size,
                      fmi3Boolean no_set_state, fmi3Boolean *event, fmi3Boolean *terminate,
                      fmi3Boolean *early, fmi3Float64 *last_time)
{
    er_component *c = instance;
    bool good = c != NULL && er_component_given(c, 1, event, terminate) &&
                er_component_given(c, 1, early, last_time);
    (void)no_set_state;
    if (!good)
        return fmi3Error;
    if (size == 0.0)
        good = er_component_refuse(c, "step size: expected a number > 0, got 0.0 s");
    else
        good = er_component_step(c, time, size);
    *event = fmi3False;
    *terminate = fmi3False;
    *early = fmi3False;
    *last_time = c->robot->progress.time;
    return er_status_tried(c, good);
}
