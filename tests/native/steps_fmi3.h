/* Co-simulation of FMI 3.0 by the names that fuzz_steps.c has for both versions. */
#ifndef STEPS_FMI3_H
#define STEPS_FMI3_H

#include "calls_fmi3.h"

static instance create(const char *token, const char *resources)
{
    return fmi3InstantiateCoSimulation("robot", token, resources, false, true, false, false, NULL, 0,
                                       NULL, log_message, NULL);
}

/* What FMI 2.0 sets up beforehand is told where initialisation is entered. */
static fmi3Status set_up(instance c, double start)
{
    double tolerance = draw(2) ? 1e-6 : draw_value();
    return fmi3EnterInitializationMode(c, draw(2), tolerance, start, draw(2), draw_value());
}

static fmi3Status enter(instance c)
{
    (void)c;
    return fmi3OK;
}

/* A step from a time to its end, which is the time afterwards. */
static fmi3Status step(instance c, double *time, double size)
{
    fmi3Boolean event, terminate, early;
    double last;
    fmi3Status status = fmi3DoStep(c, *time, size, true, &event, &terminate, &early, &last);
    CHECK(!event && !terminate && !early);
    if (status == fmi3OK) {
        CHECK(fabs(last - (*time + size)) <= 1e-9);
        *time = last;
    }
    return status;
}

/* There are no further calls in this version. */
static fmi3Status call_of_version(instance c)
{
    (void)c;
    return fmi3OK;
}

static fmi3Status misuse_of_version(instance c, double time)
{
    fmi3ValueReference reference = draw_reference();
    fmi3Boolean flag;
    fmi3Int32 number = 1;
    double value = 0.0;
    switch (draw(8)) {
    case 0: return fmi3GetInt32(c, &reference, 1, &number, 1);
    case 1: return fmi3SetBoolean(c, &reference, 1, &flag, 1);
    case 2: return fmi3DoStep(NULL, time, 0.001, true, &flag, &flag, &flag, &value);
    case 3: return fmi3DoStep(c, time, 0.001, true, NULL, &flag, &flag, &value);
    case 4: return fmi3GetFloat64(NULL, &reference, 1, &value, 1);
    case 5: return fmi3EnterEventMode(c);
    case 6: return fmi3UpdateDiscreteStates(c, NULL, NULL, NULL, NULL, NULL, NULL);
    default: return fmi3GetOutputDerivatives(c, &reference, 1, &number, &value, 1);
    }
}

#endif
