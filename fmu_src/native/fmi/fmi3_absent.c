/* The functions of FMI 3.0 for what this FMU does not have: each is refused with a sentence. */
#include <stdio.h>

#include "../io/failure.h"
#include "fmi3.h"

#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter" /* nothing here looks at what is asked */
#endif

static fmi3Status none_of(fmi3Instance instance, const char *type,
                          const fmi3ValueReference references[], size_t count)
{
    char text[ER_FAILURE_TEXT];
    if (count == 0)
        return fmi3OK;
    snprintf(text, sizeof text, "%s variable %u is asked for; this FMU has Float64 and String"
             " variables only", type, references[0]);
    return er_fmi3_refuse(instance, text);
}

#define NO_VARIABLES(Type)                                                                          \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference references[],          \
                             size_t count, fmi3##Type values[], size_t value_count)                 \
    {                                                                                               \
        return none_of(instance, #Type, references, count);                                         \
    }                                                                                               \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference references[],          \
                             size_t count, const fmi3##Type values[], size_t value_count)           \
    {                                                                                               \
        return none_of(instance, #Type, references, count);                                         \
    }

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(Boolean)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                         size_t sizes[], fmi3Binary values[], size_t value_count)
{
    return none_of(instance, "Binary", references, count);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                         const size_t sizes[], const fmi3Binary values[], size_t value_count)
{
    return none_of(instance, "Binary", references, count);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                        fmi3Clock values[])
{
    return none_of(instance, "Clock", references, count);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                        const fmi3Clock values[])
{
    return none_of(instance, "Clock", references, count);
}

#define ABSENT(Name, parameters, found)                                                             \
    fmi3Status fmi3##Name parameters                                                                \
    {                                                                                               \
        return er_fmi3_refuse(instance, found);                                                     \
    }

#define CLOCKS "intervals of a clock are asked for; this FMU has no clocks"
ABSENT(GetIntervalDecimal,
       (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
        fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]), CLOCKS)
ABSENT(GetIntervalFraction,
       (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
        fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]), CLOCKS)
ABSENT(GetShiftDecimal,
       (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
        fmi3Float64 shifts[]), CLOCKS)
ABSENT(GetShiftFraction,
       (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
        fmi3UInt64 counters[], fmi3UInt64 resolutions[]), CLOCKS)
ABSENT(SetIntervalDecimal,
       (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
        const fmi3Float64 intervals[]), CLOCKS)
ABSENT(SetIntervalFraction,
       (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
        const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]), CLOCKS)
ABSENT(SetShiftDecimal,
       (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
        const fmi3Float64 shifts[]), CLOCKS)
ABSENT(SetShiftFraction,
       (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
        const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]), CLOCKS)
ABSENT(ActivateModelPartition,
       (fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time), CLOCKS)

#define EVENTS "event mode is asked for; this FMU has none"
ABSENT(EnterEventMode, (fmi3Instance instance), EVENTS)
ABSENT(EnterStepMode, (fmi3Instance instance), EVENTS)
ABSENT(EvaluateDiscreteStates, (fmi3Instance instance), EVENTS)
ABSENT(UpdateDiscreteStates,
       (fmi3Instance instance, fmi3Boolean *needs_update, fmi3Boolean *terminate,
        fmi3Boolean *nominals_changed, fmi3Boolean *values_changed, fmi3Boolean *has_next,
        fmi3Float64 *next), EVENTS)

#define STRUCTURE "configuration mode is asked for; the sizes of this FMU's variables are fixed"
ABSENT(EnterConfigurationMode, (fmi3Instance instance), STRUCTURE)
ABSENT(ExitConfigurationMode, (fmi3Instance instance), STRUCTURE)

#define DEPENDENCIES "dependencies of elements are asked for; those in modelDescription.xml hold for all"
ABSENT(GetNumberOfVariableDependencies,
       (fmi3Instance instance, fmi3ValueReference reference, size_t *count), DEPENDENCIES)
ABSENT(GetVariableDependencies,
       (fmi3Instance instance, fmi3ValueReference dependent, size_t dependent_elements[],
        fmi3ValueReference independents[], size_t independent_elements[],
        fmi3DependencyKind kinds[], size_t count), DEPENDENCIES)

ABSENT(GetAdjointDerivative,
       (fmi3Instance instance, const fmi3ValueReference unknowns[], size_t unknown_count,
        const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],
        size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count),
       "adjoint derivatives are asked for; this FMU has directional ones")
ABSENT(GetOutputDerivatives,
       (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
        const fmi3Int32 orders[], fmi3Float64 values[], size_t value_count),
       "output derivatives are asked for; there are none")

#define EXCHANGE "model exchange is asked for; this FMU does co-simulation only"
ABSENT(EnterContinuousTimeMode, (fmi3Instance instance), EXCHANGE)
ABSENT(CompletedIntegratorStep,
       (fmi3Instance instance, fmi3Boolean no_set_state, fmi3Boolean *enter_event_mode,
        fmi3Boolean *terminate), EXCHANGE)
ABSENT(SetTime, (fmi3Instance instance, fmi3Float64 time), EXCHANGE)
ABSENT(SetContinuousStates,
       (fmi3Instance instance, const fmi3Float64 states[], size_t count), EXCHANGE)
ABSENT(GetContinuousStateDerivatives,
       (fmi3Instance instance, fmi3Float64 derivatives[], size_t count), EXCHANGE)
ABSENT(GetEventIndicators,
       (fmi3Instance instance, fmi3Float64 indicators[], size_t count), EXCHANGE)
ABSENT(GetContinuousStates, (fmi3Instance instance, fmi3Float64 states[], size_t count), EXCHANGE)
ABSENT(GetNominalsOfContinuousStates,
       (fmi3Instance instance, fmi3Float64 nominals[], size_t count), EXCHANGE)
ABSENT(GetNumberOfEventIndicators, (fmi3Instance instance, size_t *count), EXCHANGE)
ABSENT(GetNumberOfContinuousStates, (fmi3Instance instance, size_t *count), EXCHANGE)

/* There is no instance that could tell, so the sentence goes to the master's log or stderr. */
static fmi3Instance instantiate_none(const char *name, bool logging,
                                     fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                     const char *text)
{
    if (logging && log != NULL)
        log(environment, fmi3Error, "logStatusError", text);
    else
        fprintf(stderr, "%s: %s\n", name != NULL ? name : "", text);
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    return instantiate_none(name, logging, environment, log, EXCHANGE);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback clock_update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock)
{
    return instantiate_none(name, logging, environment, log,
                            "scheduled execution is asked for; this FMU does co-simulation only");
}
