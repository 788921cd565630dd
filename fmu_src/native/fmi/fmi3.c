/* The functions of FMI 3.0 for co-simulation.
 *
 * Value references are those of FMI 2.0; an array has that of its first element, and the independent
 * variable, time, the first one behind all others.
 */
#include "fmi3.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"

#define ROBOT_FILE "robot.txt"

typedef struct {
    er_instance *robot;
    char *name;
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
    bool logging;
} component;

fmi3Status er_fmi3_refuse(fmi3Instance instance, const char *text)
{
    const component *c = instance;
    if (c->logging && c->log != NULL) {
        c->log(c->environment, fmi3Error, "logStatusError", text);
    } else {
        fprintf(stderr, "%s: %s\n", c->name, text);
        fflush(stderr);
    }
    return fmi3Error;
}

static fmi3Status status(component *c, bool good)
{
    return good ? fmi3OK : er_fmi3_refuse(c, c->robot->failure.text);
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

static char *joined(const char *first, const char *separator, const char *second)
{
    size_t size = strlen(first) + strlen(separator) + strlen(second) + 1;
    char *text = malloc(size);
    if (text != NULL)
        snprintf(text, size, "%s%s%s", first, separator, second);
    return text;
}

static er_instance *create(fmi3String token, fmi3String resources, er_failure *failure)
{
    er_instance *robot;
    char *file;
    size_t length = resources != NULL ? strlen(resources) : 0;
    if (token == NULL) {
        er_fail(failure, "there is no instantiation token; needed is that of modelDescription.xml");
        return NULL;
    }
    if (length == 0) {
        er_fail(failure, "there is no path of the resources; needed is that of the unpacked FMU's");
        return NULL;
    }
    file = joined(resources, resources[length - 1] == '/' ? "" : "/", ROBOT_FILE);
    if (file == NULL) {
        er_fail(failure, "the path of the resources does not fit into memory");
        return NULL;
    }
    robot = er_instance_create(file, token, failure);
    free(file);
    return robot;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
    const fmi3ValueReference intermediate[], size_t intermediate_count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update)
{
    component *c = calloc(1, sizeof *c);
    er_failure failure;
    (void)visible;
    (void)early_return; /* allowed, never done */
    (void)intermediate;
    (void)update;
    if (c == NULL)
        return NULL;
    c->name = joined(name != NULL ? name : "", "", "");
    if (c->name == NULL) {
        free(c);
        return NULL;
    }
    c->log = log;
    c->environment = environment;
    c->logging = logging;
    if (event_mode)
        er_fail(&failure, "event mode is asked for; this FMU has none");
    else if (intermediate_count > 0)
        er_fail(&failure, "intermediate variables are asked for; this FMU has none");
    else
        c->robot = create(token, resources, &failure);
    if (c->robot == NULL) {
        er_fmi3_refuse(c, failure.text);
        fmi3FreeInstance(c);
        return NULL;
    }
    return c;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    component *c = instance;
    if (c == NULL)
        return;
    er_instance_free(c->robot);
    free(c->name);
    free(c);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean logging, size_t count,
                               const fmi3String categories[])
{
    (void)count;
    (void)categories;
    ((component *)instance)->logging = logging;
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
    component *c = instance;
    (void)has_stop;
    (void)stop;
    if (c->robot->progress.started)
        return er_fmi3_refuse(c, "initialisation is entered after it has ended; needed is a reset"
                              " first");
    return status(c, er_instance_setup(c->robot, start, has_tolerance ? tolerance : 0.0));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    component *c = instance;
    return status(c, er_instance_start(c->robot));
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    (void)instance;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    er_instance_reset(((component *)instance)->robot);
    return fmi3OK;
}

static bool is_time(const component *c, fmi3ValueReference reference)
{
    return reference == (unsigned)c->robot->layout.first[ER_BLOCKS];
}

/* Checks that there is one value for each element of some variables. */
static bool require_count(component *c, const fmi3ValueReference references[], size_t count,
                          size_t values)
{
    size_t elements = 0;
    for (size_t i = 0; i < count; i++) {
        int size = is_time(c, references[i]) ? 1 : er_array_size(&c->robot->layout, references[i]);
        if (size == 0)
            return er_fail(&c->robot->failure, "the value reference %u is asked for as a Float64"
                           " variable; this FMU has none there", references[i]);
        elements += (size_t)size;
    }
    if (elements == values)
        return true;
    return er_fail(&c->robot->failure, "there are %lu values for variables of %lu elements; needed is"
                   " one for each", (unsigned long)values, (unsigned long)elements);
}

/* Value references of the elements of one variable; returns their number. */
static size_t elements_of(const component *c, fmi3ValueReference reference, unsigned *elements)
{
    size_t size = is_time(c, reference)
                      ? 1 : (size_t)er_array_size(&c->robot->layout, reference);
    for (size_t k = 0; k < size; k++)
        elements[k] = reference + (unsigned)k;
    return size;
}

/* Value references of the elements of some variables, of which there are `values`. */
static bool expand(component *c, const fmi3ValueReference references[], size_t count, size_t values,
                   unsigned elements[ER_MAX_REALS])
{
    size_t known = 0;
    if (!require_count(c, references, count, values))
        return false;
    if (values > ER_MAX_REALS)
        return er_fail(&c->robot->failure, "%lu values are given in one call; this FMU has %d",
                       (unsigned long)values, er_real_count(&c->robot->layout));
    for (size_t i = 0; i < count; i++)
        known += elements_of(c, references[i], elements + known);
    return true;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                          fmi3Float64 values[], size_t value_count)
{
    component *c = instance;
    if (!require_count(c, references, count, value_count))
        return status(c, false);
    for (size_t i = 0; i < count; i++) {
        unsigned elements[ER_MAX_REALS];
        size_t size = elements_of(c, references[i], elements);
        if (is_time(c, references[i]))
            *values = c->robot->progress.time;
        else if (!er_instance_get_reals(c->robot, elements, size, values))
            return status(c, false);
        values += size;
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                          const fmi3Float64 values[], size_t value_count)
{
    component *c = instance;
    unsigned elements[ER_MAX_REALS];
    return status(c, expand(c, references, count, value_count, elements) &&
                         er_instance_set_reals(c->robot, elements, value_count, values));
}

static bool require_strings(component *c, size_t count, size_t values)
{
    return count == values ||
           er_fail(&c->robot->failure, "there are %lu values for %lu string variables; needed is one"
                   " for each", (unsigned long)values, (unsigned long)count);
}

fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                         fmi3String values[], size_t value_count)
{
    component *c = instance;
    bool good = require_strings(c, count, value_count);
    for (size_t i = 0; good && i < count; i++)
        good = er_instance_get_string(c->robot, references[i], &values[i]);
    return status(c, good);
}

fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                         const fmi3String values[], size_t value_count)
{
    component *c = instance;
    bool good = require_strings(c, count, value_count);
    for (size_t i = 0; good && i < count; i++)
        good = er_instance_set_string(c->robot, references[i], values[i]);
    return status(c, good);
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    component *c = instance;
    if (*state == NULL && (*state = calloc(1, sizeof(er_saved_state))) == NULL)
        return er_fmi3_refuse(c, "the state does not fit into memory");
    er_instance_save(c->robot, *state);
    return fmi3OK;
}

static fmi3Status require_state(component *c, fmi3FMUState state)
{
    return state != NULL ? fmi3OK
                         : er_fmi3_refuse(c, "there is no state; needed is a state that this FMU has"
                                          " saved");
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    component *c = instance;
    if (require_state(c, state) != fmi3OK)
        return fmi3Error;
    return status(c, er_instance_restore(c->robot, state));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    (void)instance;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    *size = ER_SERIALISED_SIZE;
    return require_state(instance, state);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[],
                                 size_t size)
{
    if (require_state(instance, state) != fmi3OK)
        return fmi3Error;
    if (size < ER_SERIALISED_SIZE)
        return er_fmi3_refuse(instance, "the buffer is too small for the state; needed is the size"
                              " asked for");
    er_serialise(state, bytes);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
    component *c = instance;
    er_saved_state *saved = *state != NULL ? *state : calloc(1, sizeof *saved);
    if (saved == NULL)
        return er_fmi3_refuse(c, "the state does not fit into memory");
    if (!er_deserialise(c->robot, bytes, size, saved)) {
        if (*state == NULL)
            free(saved);
        return status(c, false);
    }
    *state = saved;
    return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t unknown_count, const fmi3ValueReference knowns[],
                                        size_t known_count, const fmi3Float64 seed[],
                                        size_t seed_count, fmi3Float64 sensitivity[],
                                        size_t sensitivity_count)
{
    component *c = instance;
    unsigned outputs[ER_MAX_REALS], inputs[ER_MAX_REALS];
    return status(c, expand(c, unknowns, unknown_count, sensitivity_count, outputs) &&
                         expand(c, knowns, known_count, seed_count, inputs) &&
                         er_instance_derivative(c->robot, outputs, sensitivity_count, inputs,
                                                seed_count, seed, sensitivity));
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 size,
                      fmi3Boolean no_set_state, fmi3Boolean *event, fmi3Boolean *terminate,
                      fmi3Boolean *early, fmi3Float64 *last_time)
{
    component *c = instance;
    bool good = er_instance_step(c->robot, time, size);
    (void)no_set_state;
    *event = fmi3False;
    *terminate = fmi3False;
    *early = fmi3False;
    *last_time = c->robot->progress.time;
    return status(c, good);
}
