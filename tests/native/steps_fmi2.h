/* Co-simulation of FMI 2.0 by the names that fuzz_steps.c has for both versions. */
#ifndef STEPS_FMI2_H
#define STEPS_FMI2_H

#include "calls_fmi2.h"

static instance create(const char *token, const char *resources)
{
    return fmi2Instantiate("robot", fmi2CoSimulation, token, resources, &callbacks, fmi2False,
                           fmi2True);
}

static fmi2Status set_up(instance c, double start)
{
    double tolerance = draw(2) ? 1e-6 : draw_value();
    return fmi2SetupExperiment(c, draw(2), tolerance, start, draw(2), draw_value());
}

static fmi2Status enter(instance c)
{
    return fmi2EnterInitializationMode(c);
}

/* A step from a time to its end, which is the time afterwards. */
static fmi2Status step(instance c, double *time, double size)
{
    fmi2Status status = fmi2DoStep(c, *time, size, fmi2True);
    if (status == fmi2OK)
        *time += size;
    return status;
}

/* First derivatives of inputs; others, and those of other variables, are refused.  Or a status. */
static fmi2Status call_of_version(instance c)
{
    request r;
    fmi2Integer *orders;
    fmi2Status status;
    double value;
    if (draw(3) == 0)
        return fmi2GetRealStatus(c, draw(4), &value);
    r = draw_request(draw(10) == 0 ? NULL : "input");
    orders = malloc(r.count * sizeof *orders);
    CHECK(orders != NULL || r.count == 0);
    for (size_t i = 0; i < r.count; i++)
        orders[i] = draw_order();
    status = fmi2SetRealInputDerivatives(c, draw(40) == 0 ? NULL : r.references, r.count,
                                         draw(40) == 0 ? NULL : orders,
                                         draw(40) == 0 ? NULL : r.values);
    for (size_t i = 0; status == fmi2OK && i < r.count; i++)
        CHECK(orders[i] == 1 && isfinite(r.values[i]));
    free(orders);
    drop(r);
    return status;
}

static fmi2Status misuse_of_version(instance c, double time)
{
    fmi2ValueReference reference = draw_reference();
    fmi2Boolean truth = fmi2True;
    fmi2Integer number = 1;
    double value = 0.0;
    switch (draw(7)) {
    case 0: return fmi2GetInteger(c, &reference, 1, &number);
    case 1: return fmi2SetBoolean(c, &reference, 1, &truth);
    case 2: return fmi2DoStep(NULL, time, 0.001, fmi2True);
    case 3: return fmi2GetReal(NULL, &reference, 1, &value);
    case 4: return fmi2CancelStep(c);
    case 5: return fmi2SetRealInputDerivatives(NULL, &reference, 1, &number, &value);
    default: return fmi2GetRealOutputDerivatives(c, &reference, 1, &number, &value);
    }
}

#endif
