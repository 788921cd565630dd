/* A library of FMI 2.0 loaded at run time; nothing of this project is known. */
#ifndef MASTER_H
#define MASTER_H

#include <dlfcn.h>

#include "fmi2Functions.h"
#include "description.h"

#define EACH_FUNCTION(DO)                                                                           \
    DO(fmi2Instantiate)                                                                             \
    DO(fmi2FreeInstance)                                                                            \
    DO(fmi2SetupExperiment)                                                                         \
    DO(fmi2EnterInitializationMode)                                                                 \
    DO(fmi2ExitInitializationMode)                                                                  \
    DO(fmi2Terminate)                                                                               \
    DO(fmi2GetReal)                                                                                 \
    DO(fmi2SetReal)                                                                                 \
    DO(fmi2GetString)                                                                               \
    DO(fmi2SetString)                                                                               \
    DO(fmi2GetFMUstate)                                                                             \
    DO(fmi2SetFMUstate)                                                                             \
    DO(fmi2FreeFMUstate)                                                                            \
    DO(fmi2SerializedFMUstateSize)                                                                  \
    DO(fmi2SerializeFMUstate)                                                                       \
    DO(fmi2DeSerializeFMUstate)                                                                     \
    DO(fmi2GetDirectionalDerivative)                                                                \
    DO(fmi2DoStep)

#define DECLARE(name) static name##TYPE *f##name;
EACH_FUNCTION(DECLARE)

static const char *guid, *resources;
static long messages;

static void load(const char *library)
{
    void *handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
    if (handle == NULL) {
        fprintf(stderr, "%s\n", dlerror());
        exit(1);
    }
#define LOAD(name)                                                                                  \
    *(void **)&f##name = dlsym(handle, #name);                                                      \
    CHECK(f##name != NULL);
    EACH_FUNCTION(LOAD)
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String message, ...)
{
    (void)environment;
    CHECK(name != NULL && category != NULL && strlen(message) > 10);
    if (strcmp(category, "logEvents") == 0) {
        CHECK(status == fmi2OK);
        return;
    }
    CHECK(status >= fmi2Warning && status <= fmi2Error);
    messages++;
}

static const fmi2CallbackFunctions callbacks = {log_message, NULL, NULL, NULL, NULL};

static fmi2Component new_instance(void)
{
    fmi2Component c =
        ffmi2Instantiate("robot", fmi2CoSimulation, guid, resources, &callbacks, fmi2False, fmi2True);
    CHECK(c != NULL);
    return c;
}

/* LIBRARY GUID RESOURCES-URI, as the first arguments of the program. */
static void start_master(int count, char **arguments)
{
    CHECK(count >= 5);
    guid = arguments[2];
    resources = arguments[3];
    load(arguments[1]);
    read_variables(resources);
}

#endif
