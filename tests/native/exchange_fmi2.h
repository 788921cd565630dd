/* Model exchange of FMI 2.0 by the names that fuzz_exchange.c has for both versions. */
#ifndef EXCHANGE_FMI2_H
#define EXCHANGE_FMI2_H

#include "calls_fmi2.h"

static instance create(const char *token, const char *resources)
{
    return fmi2Instantiate("robot", fmi2ModelExchange, token, resources, &callbacks, fmi2False,
                           fmi2True);
}

static fmi2Status update(instance c)
{
    fmi2EventInfo info;
    fmi2Status status = fmi2NewDiscreteStates(c, &info);
    CHECK(status != fmi2OK || (!info.newDiscreteStatesNeeded && !info.terminateSimulation &&
                               isfinite(info.nextEventTime)));
    return status;
}

static fmi2Status complete(instance c)
{
    fmi2Boolean event, terminate;
    fmi2Status status = fmi2CompletedIntegratorStep(c, fmi2True, &event, &terminate);
    CHECK(status != fmi2OK || (!terminate && (event == fmi2False || event == fmi2True)));
    return status;
}

static fmi2Status set_up(instance c)
{
    return fmi2SetupExperiment(c, draw(2), draw_value(), 1e-3 * draw(100), fmi2False, 0.0);
}

static fmi2Status enter(instance c)
{
    return fmi2EnterInitializationMode(c);
}

static fmi2Status step(instance c)
{
    return fmi2DoStep(c, 0.0, 1e-3, fmi2True);
}

static fmi2Status set_derivative(instance c)
{
    unsigned reference = draw_variable(draw(4) ? "input" : NULL, false)->reference;
    fmi2Integer order = draw_order();
    double value = draw_value();
    fmi2Status status = fmi2SetRealInputDerivatives(c, &reference, 1, &order, &value);
    CHECK(status != fmi2OK || (order == 1 && isfinite(value)));
    return status;
}

#define DERIVATIVES fmi2GetDerivatives

#endif
