/* Stands in for PythonFMU's library: writes what reaches it into the file INNER_LOG. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#if defined(_WIN32)
#define SHARED __declspec(dllexport)
#else
#define SHARED __attribute__((visibility("default")))
#endif

/* What the next functions answer, and the message that they log before; empty for none. */
SHARED int inner_answer = 0, inner_message_status = 0;
SHARED char inner_message[300] = "";
static const fmi2CallbackFunctions *host;

static void note(const char *format, ...)
{
    FILE *file = fopen(getenv("INNER_LOG"), "a");
    va_list arguments;
    va_start(arguments, format);
    vfprintf(file, format, arguments);
    va_end(arguments);
    fclose(file);
}

static fmi2Status answer(void)
{
    if (inner_message[0] != '\0')
        host->logger(host->componentEnvironment, "inner", inner_message_status, NULL, inner_message);
    return inner_answer;
}

SHARED void finalizePythonInterpreter(void)
{
    note("forget Python\n");
}

static void at_end(void)
{
    note("variables destroyed\n");
}

/* As a C++ library's variables are: their destructors are known from its loading on. */
__attribute__((constructor)) static void at_start(void)
{
    atexit(at_end);
}

const char *fmi2GetTypesPlatform(void) { return "inner"; }
const char *fmi2GetVersion(void) { return "inner"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    static char instance;
    host = functions;
    note("fmi2Instantiate %s %d %s %s %d %d\n", name, type, guid, location, visible, logging);
    return answer() == fmi2OK ? &instance : NULL;
}

void fmi2FreeInstance(fmi2Component c)
{
    note("fmi2FreeInstance %d\n", c != NULL);
}

#define ANSWER(signature, ...)                                                                      \
    fmi2Status signature                                                                            \
    {                                                                                               \
        (void)c;                                                                                    \
        note(__VA_ARGS__);                                                                          \
        return answer();                                                                            \
    }

#define C fmi2Component c
#define VRS const fmi2ValueReference vr[], size_t n

ANSWER(fmi2SetDebugLogging(C, fmi2Boolean on, size_t n, const fmi2String names[]),
       "fmi2SetDebugLogging %d %d %s\n", on, (int)n, n ? names[0] : "")
ANSWER(fmi2SetupExperiment(C, fmi2Boolean t, fmi2Real tolerance, fmi2Real start, fmi2Boolean s,
                           fmi2Real stop),
       "fmi2SetupExperiment %d %g %g %d %g\n", t, tolerance, start, s, stop)
ANSWER(fmi2EnterInitializationMode(C), "fmi2EnterInitializationMode\n")
ANSWER(fmi2ExitInitializationMode(C), "fmi2ExitInitializationMode\n")
ANSWER(fmi2Terminate(C), "fmi2Terminate\n")
ANSWER(fmi2Reset(C), "fmi2Reset\n")
ANSWER(fmi2GetReal(C, VRS, fmi2Real v[]), "fmi2GetReal %d %d %g\n", vr[0], (int)n, v[0])
ANSWER(fmi2GetInteger(C, VRS, fmi2Integer v[]), "fmi2GetInteger %d %d %d\n", vr[0], (int)n, v[0])
ANSWER(fmi2GetBoolean(C, VRS, fmi2Boolean v[]), "fmi2GetBoolean %d %d %d\n", vr[0], (int)n, v[0])
ANSWER(fmi2GetString(C, VRS, fmi2String v[]), "fmi2GetString %d %d %s\n", vr[0], (int)n, v[0])
ANSWER(fmi2SetReal(C, VRS, const fmi2Real v[]), "fmi2SetReal %d %d %g\n", vr[0], (int)n, v[0])
ANSWER(fmi2SetInteger(C, VRS, const fmi2Integer v[]), "fmi2SetInteger %d %d %d\n", vr[0], (int)n, v[0])
ANSWER(fmi2SetBoolean(C, VRS, const fmi2Boolean v[]), "fmi2SetBoolean %d %d %d\n", vr[0], (int)n, v[0])
ANSWER(fmi2SetString(C, VRS, const fmi2String v[]), "fmi2SetString %d %d %s\n", vr[0], (int)n, v[0])
ANSWER(fmi2SetFMUstate(C, fmi2FMUstate s), "fmi2SetFMUstate %d\n", *(int *)s)
ANSWER(fmi2GetDirectionalDerivative(C, VRS, const fmi2ValueReference k[], size_t m,
                                    const fmi2Real seed[], fmi2Real v[]),
       "fmi2GetDirectionalDerivative %d %d %d %d %g %g\n", vr[0], (int)n, k[0], (int)m, seed[0], v[0])
ANSWER(fmi2SetRealInputDerivatives(C, VRS, const fmi2Integer o[], const fmi2Real v[]),
       "fmi2SetRealInputDerivatives %d %d %d %g\n", vr[0], (int)n, o[0], v[0])
ANSWER(fmi2GetRealOutputDerivatives(C, VRS, const fmi2Integer o[], fmi2Real v[]),
       "fmi2GetRealOutputDerivatives %d %d %d %g\n", vr[0], (int)n, o[0], v[0])
ANSWER(fmi2DoStep(C, fmi2Real t, fmi2Real h, fmi2Boolean keep), "fmi2DoStep %g %g %d\n", t, h, keep)
ANSWER(fmi2CancelStep(C), "fmi2CancelStep\n")
ANSWER(fmi2GetStatus(C, const fmi2StatusKind k, fmi2Status *v), "fmi2GetStatus %d %d\n", k, *v)
ANSWER(fmi2GetRealStatus(C, const fmi2StatusKind k, fmi2Real *v), "fmi2GetRealStatus %d %g\n", k, *v)
ANSWER(fmi2GetIntegerStatus(C, const fmi2StatusKind k, fmi2Integer *v),
       "fmi2GetIntegerStatus %d %d\n", k, *v)
ANSWER(fmi2GetBooleanStatus(C, const fmi2StatusKind k, fmi2Boolean *v),
       "fmi2GetBooleanStatus %d %d\n", k, *v)
ANSWER(fmi2GetStringStatus(C, const fmi2StatusKind k, fmi2String *v),
       "fmi2GetStringStatus %d %s\n", k, *v)

/* A state is a number from 1 on, in a block of memory of its own. */
static fmi2Status new_state(fmi2FMUstate *s)
{
    static int count;
    *s = malloc(sizeof(int));
    *(int *)*s = ++count;
    return answer();
}

fmi2Status fmi2GetFMUstate(C, fmi2FMUstate *s)
{
    (void)c;
    note("fmi2GetFMUstate\n");
    return new_state(s);
}

fmi2Status fmi2FreeFMUstate(C, fmi2FMUstate *s)
{
    (void)c;
    note("fmi2FreeFMUstate %d\n", *(int *)*s);
    free(*s);
    return answer();
}

fmi2Status fmi2SerializedFMUstateSize(C, fmi2FMUstate s, size_t *size)
{
    (void)c;
    note("fmi2SerializedFMUstateSize %d\n", *(int *)s);
    *size = 5;
    return answer();
}

fmi2Status fmi2SerializeFMUstate(C, fmi2FMUstate s, fmi2Byte bytes[], size_t size)
{
    (void)c;
    note("fmi2SerializeFMUstate %d %d\n", *(int *)s, (int)size);
    memcpy(bytes, "state", size);
    return answer();
}

fmi2Status fmi2DeSerializeFMUstate(C, const fmi2Byte bytes[], size_t size, fmi2FMUstate *s)
{
    (void)c;
    note("fmi2DeSerializeFMUstate %.*s\n", (int)size, bytes);
    return new_state(s);
}
