/* Model exchange of FMI 3.0 by the names that fuzz_exchange.c has for both versions. */
#ifndef EXCHANGE_FMI3_H
#define EXCHANGE_FMI3_H

#include "calls_fmi3.h"

static instance create(const char *token, const char *resources)
{
    return fmi3InstantiateModelExchange("robot", token, resources, false, true, NULL, log_message);
}

static fmi3Status update(instance c)
{
    fmi3Boolean needs, terminate, nominals, values, has_next;
    fmi3Float64 next;
    fmi3Status status =
        fmi3UpdateDiscreteStates(c, &needs, &terminate, &nominals, &values, &has_next, &next);
    CHECK(status != fmi3OK || (!needs && !terminate && !nominals && isfinite(next)));
    /* An element that begins to slip is at its slip angle. */
    CHECK(status != fmi3OK || !values || has_variable("elongation[1]"));
    return status;
}

static fmi3Status complete(instance c)
{
    fmi3Boolean event, terminate;
    fmi3Status status = fmi3CompletedIntegratorStep(c, true, &event, &terminate);
    CHECK(status != fmi3OK || !terminate);
    return status;
}

/* What FMI 2.0 sets up beforehand is told where initialisation is entered. */
static fmi3Status set_up(instance c)
{
    (void)c;
    return fmi3OK;
}

static fmi3Status enter(instance c)
{
    return fmi3EnterInitializationMode(c, draw(2), draw_value(), 1e-3 * draw(100), false, 0.0);
}

static fmi3Status step(instance c)
{
    fmi3Boolean event, terminate, early;
    double last;
    return fmi3DoStep(c, 0.0, 1e-3, true, &event, &terminate, &early, &last);
}

/* There is no such call in this version. */
static fmi3Status set_derivative(instance c)
{
    (void)c;
    return fmi3OK;
}

#define DERIVATIVES fmi3GetContinuousStateDerivatives

#endif
