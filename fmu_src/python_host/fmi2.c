/* The functions of FMI 2.0 for co-simulation, passed on to PythonFMU's library.
 *
 * Different from there: an exception in Python is fmi2Error, as the instance can go on; what PythonFMU would
 * not survive is refused with a sentence.  Saved states: fmi2_states.c.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "component.h"
#include "../native/fmi/log_categories.h"
#include "../native/io/file.h"

/* Among the resources: the name of the slave's module, and the FMU's GUID. */
#define SLAVE_FILE "slavemodule.txt"
#define GUID_FILE "guid.txt"

/* elastic_robot/fmi/inputs.py has the same: beyond it are the derivatives of inputs, and at it, to be read, the
 * end of the last step. */
#define OF_DERIVATIVES (1u << 30)
#define LAST_TIME OF_DERIVATIVES

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

/* Whether a file among the resources has this text, or any text if it is NULL. */
static bool has(const char *location, const char *name, const char *text)
{
    char line[100] = "", *path = er_path_from_uri(location, name);
    FILE *file = path != NULL ? fopen(path, "r") : NULL;
    bool read = file != NULL && fgets(line, sizeof line, file) != NULL;
    if (file != NULL)
        fclose(file);
    free(path);
    line[strcspn(line, "\r\n")] = '\0';
    return read && (text == NULL || strcmp(line, text) == 0);
}

static bool is_asked_rightly(const char *name, fmi2Type type, const char *guid,
                             const char *location, er_failure *failure)
{
    if (!er_is_utf8(name))
        return er_fail(failure, "instance name: expected UTF-8, got other bytes");
    if (type != fmi2CoSimulation)
        return er_fail(failure, "model exchange is asked for; this FMU does co-simulation only");
    if (!has(location, SLAVE_FILE, NULL))
        return er_fail(failure, "resources: expected the file: URI of a folder with " SLAVE_FILE
                       ", got '%.700s'", location != NULL ? location : "");
    if (strstr(location, "%2520") != NULL) /* PythonFMU decodes once more */
        return er_fail(failure, "resources: expected a folder without %%20 in its name, got '%.700s'",
                       location);
    if (guid == NULL || !has(location, GUID_FILE, guid))
        return er_fail(failure, "GUID: expected that of modelDescription.xml, got '%.100s'",
                       guid != NULL ? guid : "");
    return true;
}

/* Says why there is no instance: to stderr, as the log may be off, and to the log. */
static fmi2Component give_up(er_component *c, fmi2Status status)
{
    fprintf(stderr, "%s: %s\n", c->name, c->cause.text);
    fflush(stderr);
    er_component_tell(c, status, c->cause.text);
    er_component_free(c);
    return NULL;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    er_component *c = er_component_create(name, functions);
    char *folder = NULL;
    if (c == NULL)
        return NULL;
    c->log = ER_LOG_ALL; /* the reason of a failure is told in any case */
    c->functions = er_inner_functions(&c->cause);
    if (c->functions == NULL)
        return give_up(c, fmi2Fatal);
    if (is_asked_rightly(c->name, type, guid, location, &c->cause))
        folder = er_path_from_uri(location, ""); /* PythonFMU takes a path as well */
    if (folder != NULL && !er_is_utf8(folder)) {
        free(folder);
        folder = NULL;
        er_fail(&c->cause, "resources: expected a folder whose name is UTF-8, got other bytes");
    }
    if (folder == NULL)
        return give_up(c, fmi2Error);
    folder[strlen(folder) - 1] = '\0';
    /* With its log on, so that the reason of a failure is known, now and later. */
    c->inner = c->functions->fmi2Instantiate(c->name, type, guid, folder, &c->relayed, visible,
                                             fmi2True);
    free(folder);
    if (c->inner == NULL) {
        er_component_tell(c, fmi2Error, c->cause.text); /* the slave has written it to stderr */
        er_component_free(c);
        return NULL;
    }
    c->log = logging != fmi2False ? ER_LOG_ALL : 0;
    return c;
}

void fmi2FreeInstance(fmi2Component instance)
{
    er_component *c = instance;
    if (c == NULL)
        return;
    if (!c->lost) /* else PythonFMU would free again what it freed then */
        c->functions->fmi2FreeInstance(c->inner);
    er_component_free(c);
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

/* Whether no reference can be taken for that of a derivative. */
static bool are_own(er_component *c, const fmi2ValueReference references[], size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (references[i] >= OF_DERIVATIVES) {
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
    er_component *c = instance;
    fmi2ValueReference *shifted;
    fmi2Status status;
    if (!er_component_begin(c))
        return er_component_none(c);
    if (!er_component_given(c, count, references, values) ||
        !er_component_given(c, count, order, order) || !are_own(c, references, count))
        return fmi2Error;
    for (size_t i = 0; i < count; i++)
        if (order[i] != 1) {
            er_fail(&c->cause, "derivative of variable %u: expected order 1, got %d", references[i],
                    order[i]);
            return er_component_refuse(c, c->cause.text);
        }
    shifted = calloc(count + 1, sizeof *shifted);
    if (shifted == NULL)
        return er_component_refuse(c, "the derivatives do not fit into memory");
    for (size_t i = 0; i < count; i++)
        shifted[i] = references[i] + OF_DERIVATIVES;
    status = c->functions->fmi2SetReal(c->inner, shifted, count, values);
    free(shifted);
    return er_component_end(c, status);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component instance,
                                        const fmi2ValueReference references[], size_t count,
                                        const fmi2Integer order[], fmi2Real values[])
{
    ER_PASS_ON(instance, fmi2GetRealOutputDerivatives, references, count, order, values);
}
