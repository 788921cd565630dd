/* The functions of FMI 2.0 for co-simulation. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "instance.h"
#include "../io/uri.h"

#define ROBOT_FILE "robot.txt"

typedef struct {
    er_instance *robot;
    char *name;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    bool logging;
} component;

/* Tells the master; without its log, stderr.  Masters format messages like printf. */
static void tell(const component *c, const char *text)
{
    char escaped[ER_ESCAPED_TEXT];
    if (!c->logging || c->logger == NULL) {
        fprintf(stderr, "%s: %s\n", c->name, text);
        fflush(stderr);
        return;
    }
    er_escape(text, escaped);
    c->logger(c->environment, c->name, fmi2Error, "logStatusError", escaped);
}

static fmi2Status refuse(component *c, const char *text)
{
    tell(c, text);
    return fmi2Error;
}

static fmi2Status status(component *c, bool good)
{
    return good ? fmi2OK : refuse(c, c->robot->failure.text);
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

static void release(component *c)
{
    er_instance_free(c->robot);
    free(c->name);
    free(c);
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    component *c = calloc(1, sizeof *c);
    char *file;
    er_failure failure;
    (void)visible;
    if (c == NULL)
        return NULL;
    c->name = malloc(strlen(name != NULL ? name : "") + 1);
    if (c->name == NULL) {
        free(c);
        return NULL;
    }
    strcpy(c->name, name != NULL ? name : "");
    c->logging = logging != fmi2False;
    if (functions != NULL) {
        c->logger = functions->logger;
        c->environment = functions->componentEnvironment;
    }
    file = er_path_from_uri(location, ROBOT_FILE);
    if (type != fmi2CoSimulation)
        er_fail(&failure, "model exchange is asked for; this FMU does co-simulation only");
    else if (guid == NULL)
        er_fail(&failure, "there is no GUID; needed is that of modelDescription.xml");
    else if (file == NULL)
        er_fail(&failure, "the resources are at '%.300s'; needed is a file: URI",
                location != NULL ? location : "");
    else
        c->robot = er_instance_create(file, guid, &failure);
    free(file);
    if (c->robot == NULL) {
        tell(c, failure.text);
        release(c);
        return NULL;
    }
    return c;
}

void fmi2FreeInstance(fmi2Component instance)
{
    if (instance != NULL)
        release(instance);
}

fmi2Status fmi2SetDebugLogging(fmi2Component instance, fmi2Boolean logging, size_t count,
                               const fmi2String categories[])
{
    (void)count;
    (void)categories;
    ((component *)instance)->logging = logging != fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component instance, fmi2Boolean has_tolerance,
                               fmi2Real tolerance, fmi2Real start, fmi2Boolean has_stop,
                               fmi2Real stop)
{
    component *c = instance;
    (void)has_stop;
    (void)stop;
    return status(c, er_instance_setup(c->robot, start, has_tolerance ? tolerance : 0.0));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component instance)
{
    component *c = instance;
    if (c->robot->progress.started)
        return refuse(c, "initialisation is entered after it has ended; needed is a reset first");
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component instance)
{
    component *c = instance;
    return status(c, er_instance_start(c->robot));
}

fmi2Status fmi2Terminate(fmi2Component instance)
{
    (void)instance;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component instance)
{
    er_instance_reset(((component *)instance)->robot);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component instance, const fmi2ValueReference references[], size_t count,
                       fmi2Real values[])
{
    component *c = instance;
    return status(c, er_instance_get_reals(c->robot, references, count, values));
}

fmi2Status fmi2SetReal(fmi2Component instance, const fmi2ValueReference references[], size_t count,
                       const fmi2Real values[])
{
    component *c = instance;
    return status(c, er_instance_set_reals(c->robot, references, count, values));
}

fmi2Status fmi2GetString(fmi2Component instance, const fmi2ValueReference references[],
                         size_t count, fmi2String values[])
{
    component *c = instance;
    for (size_t i = 0; i < count; i++)
        if (!er_instance_get_string(c->robot, references[i], &values[i]))
            return status(c, false);
    return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component instance, const fmi2ValueReference references[],
                         size_t count, const fmi2String values[])
{
    component *c = instance;
    for (size_t i = 0; i < count; i++)
        if (!er_instance_set_string(c->robot, references[i], values[i]))
            return status(c, false);
    return fmi2OK;
}

static fmi2Status none_of(component *c, const char *kind, const fmi2ValueReference references[],
                          size_t count)
{
    if (count == 0)
        return fmi2OK;
    er_fail(&c->robot->failure, "%s variable %u is asked for; this FMU has real and string variables"
            " only", kind, references[0]);
    return status(c, false);
}

fmi2Status fmi2GetInteger(fmi2Component instance, const fmi2ValueReference references[],
                          size_t count, fmi2Integer values[])
{
    (void)values;
    return none_of(instance, "integer", references, count);
}

fmi2Status fmi2SetInteger(fmi2Component instance, const fmi2ValueReference references[],
                          size_t count, const fmi2Integer values[])
{
    (void)values;
    return none_of(instance, "integer", references, count);
}

fmi2Status fmi2GetBoolean(fmi2Component instance, const fmi2ValueReference references[],
                          size_t count, fmi2Boolean values[])
{
    (void)values;
    return none_of(instance, "boolean", references, count);
}

fmi2Status fmi2SetBoolean(fmi2Component instance, const fmi2ValueReference references[],
                          size_t count, const fmi2Boolean values[])
{
    (void)values;
    return none_of(instance, "boolean", references, count);
}

fmi2Status fmi2GetFMUstate(fmi2Component instance, fmi2FMUstate *state)
{
    component *c = instance;
    if (*state == NULL && (*state = calloc(1, sizeof(er_saved_state))) == NULL)
        return refuse(c, "the state does not fit into memory");
    er_instance_save(c->robot, *state);
    return fmi2OK;
}

static fmi2Status require_state(component *c, fmi2FMUstate state)
{
    return state != NULL ? fmi2OK
                         : refuse(c, "there is no state; needed is a state that this FMU has saved");
}

fmi2Status fmi2SetFMUstate(fmi2Component instance, fmi2FMUstate state)
{
    component *c = instance;
    if (require_state(c, state) != fmi2OK)
        return fmi2Error;
    return status(c, er_instance_restore(c->robot, state));
}

fmi2Status fmi2FreeFMUstate(fmi2Component instance, fmi2FMUstate *state)
{
    (void)instance;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component instance, fmi2FMUstate state, size_t *size)
{
    *size = ER_SERIALISED_SIZE;
    return require_state(instance, state);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component instance, fmi2FMUstate state, fmi2Byte bytes[],
                                 size_t size)
{
    component *c = instance;
    if (require_state(c, state) != fmi2OK)
        return fmi2Error;
    if (size < ER_SERIALISED_SIZE)
        return refuse(c, "the buffer is too small for the state; needed is the size asked for");
    er_serialise(state, (unsigned char *)bytes);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component instance, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    component *c = instance;
    er_saved_state *saved = *state != NULL ? *state : calloc(1, sizeof *saved);
    if (saved == NULL)
        return refuse(c, "the state does not fit into memory");
    if (!er_deserialise(c->robot, (const unsigned char *)bytes, size, saved)) {
        if (*state == NULL)
            free(saved);
        return status(c, false);
    }
    *state = saved;
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component instance,
                                        const fmi2ValueReference unknowns[], size_t unknown_count,
                                        const fmi2ValueReference knowns[], size_t known_count,
                                        const fmi2Real seed[], fmi2Real sensitivity[])
{
    component *c = instance;
    return status(c, er_instance_derivative(c->robot, unknowns, unknown_count, knowns, known_count,
                                            seed, sensitivity));
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component instance,
                                       const fmi2ValueReference references[], size_t count,
                                       const fmi2Integer order[], const fmi2Real values[])
{
    (void)references;
    (void)order;
    (void)values;
    return count == 0 ? fmi2OK : refuse(instance, "input derivatives are set; inputs are held");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component instance,
                                        const fmi2ValueReference references[], size_t count,
                                        const fmi2Integer order[], fmi2Real values[])
{
    (void)references;
    (void)order;
    (void)values;
    return count == 0 ? fmi2OK : refuse(instance, "output derivatives are asked for; there are none");
}

fmi2Status fmi2DoStep(fmi2Component instance, fmi2Real time, fmi2Real size, fmi2Boolean no_set_state)
{
    component *c = instance;
    (void)no_set_state;
    return status(c, er_instance_step(c->robot, time, size));
}

fmi2Status fmi2CancelStep(fmi2Component instance)
{
    return refuse(instance, "a step is cancelled; steps of this FMU are not asynchronous");
}

fmi2Status fmi2GetStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)instance;
    (void)kind;
    *value = fmi2OK;
    return fmi2Discard;
}

fmi2Status fmi2GetRealStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = ((component *)instance)->robot->progress.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component instance, const fmi2StatusKind kind,
                                fmi2Integer *value)
{
    (void)instance;
    (void)kind;
    (void)value;
    return fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component instance, const fmi2StatusKind kind,
                                fmi2Boolean *value)
{
    (void)instance;
    (void)kind;
    *value = fmi2False;
    return fmi2Discard;
}

fmi2Status fmi2GetStringStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2String *value)
{
    (void)instance;
    (void)kind;
    (void)value;
    return fmi2Discard;
}
