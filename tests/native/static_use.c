/* One of several FMUs that are linked into a program: -DNAME=Left -DFMI=2. */
#include <stdio.h>

#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)

#if FMI == 2
#define FMI2_FUNCTION_PREFIX JOIN(NAME, _)
#include "fmi2Functions.h"

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String message, ...)
{
    (void)environment, (void)status, (void)category;
    fprintf(stderr, "%s: %s\n", name, message);
}

void JOIN(run_, NAME)(const char *token, const char *resources, unsigned z)
{
    static const fmi2CallbackFunctions callbacks = {log_message, NULL, NULL, NULL, NULL};
    double value = 0.0;
    fmi2Component c =
        fmi2Instantiate("robot", fmi2CoSimulation, token, resources, &callbacks, fmi2False, fmi2True);
    fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    fmi2EnterInitializationMode(c);
    fmi2ExitInitializationMode(c);
    fmi2DoStep(c, 0.0, 0.01, fmi2True);
    fmi2GetReal(c, &z, 1, &value);
    printf("%.17g\n", value);
    fmi2FreeInstance(c);
}
#else
#define FMI3_FUNCTION_PREFIX JOIN(NAME, _)
#include "fmi3Functions.h"

void JOIN(run_, NAME)(const char *token, const char *resources, unsigned z)
{
    double value = 0.0, last;
    bool flag;
    fmi3Instance c = fmi3InstantiateCoSimulation("robot", token, resources, false, false, false, false,
                                                 NULL, 0, NULL, NULL, NULL);
    fmi3EnterInitializationMode(c, false, 0.0, 0.0, false, 0.0);
    fmi3ExitInitializationMode(c);
    fmi3DoStep(c, 0.0, 0.01, true, &flag, &flag, &flag, &last);
    fmi3GetFloat64(c, &z, 1, &value, 1);
    printf("%.17g\n", value);
    fmi3FreeInstance(c);
}
#endif
