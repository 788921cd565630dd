/* The functions of FMI 3.0 beside co-simulation: for model exchange, and for what this FMU does not have. */
#include "fmi3Functions.h"
#include "exchange_calls.h"

#include "component.h"

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    return er_status(er_component_enter_event(c, ER_CALL_EVENT));
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *needs_update, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals_changed, fmi3Boolean *values_changed,
                                    fmi3Boolean *has_next, fmi3Float64 *next)
{
    er_event_update update;
    if (!er_component_given(c, 1, needs_update, terminate) ||
        !er_component_given(c, 1, nominals_changed, values_changed) ||
        !er_component_given(c, 1, has_next, next) || !er_component_update(c, &update))
        return fmi3Error;
    *needs_update = *terminate = *nominals_changed = fmi3False;
    *values_changed = update.has_changed;
    *has_next = update.has_next;
    *next = update.has_next ? update.next_time : 0.0;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set_state,
                                       fmi3Boolean *enter_event_mode, fmi3Boolean *terminate)
{
    (void)no_set_state;
    if (!er_component_given(c, 1, enter_event_mode, terminate) || !er_component_completed(c, enter_event_mode))
        return fmi3Error;
    *terminate = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 derivatives[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_STATE_DERIVATIVES, derivatives, count));
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *count)
{
    return er_status(er_component_count_exchanged(c, ER_INDICATORS, count));
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *count)
{
    return er_status(er_component_count_exchanged(c, ER_STATES, count));
}

/* What this FMU does not have: each is refused with a sentence. */
#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter" /* nothing here looks at what is asked */
#endif

#define VARIABLES fmi3Instance c, const fmi3ValueReference references[], size_t count

#define GET_NONE(Type, parameters) NONE(Get, ER_CALL_GET_START, Type, parameters)
#define SET_NONE(Type, parameters) NONE(Set, ER_CALL_SET, Type, parameters)
#define NONE(Name, call, Type, parameters)                                                          \
    fmi3Status fmi3##Name##Type parameters                                                          \
    {                                                                                               \
        return er_status(                                                                           \
            er_component_none_of(c, call, #Type, "Float64 and String", references, count));         \
    }

#define NO_VARIABLES(Type)                                                                          \
    GET_NONE(Type, (VARIABLES, fmi3##Type values[], size_t value_count))                           \
    SET_NONE(Type, (VARIABLES, const fmi3##Type values[], size_t value_count))

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
GET_NONE(Binary, (VARIABLES, size_t sizes[], fmi3Binary values[], size_t value_count))
SET_NONE(Binary, (VARIABLES, const size_t sizes[], const fmi3Binary values[], size_t value_count))
GET_NONE(Clock, (VARIABLES, fmi3Clock values[]))
SET_NONE(Clock, (VARIABLES, const fmi3Clock values[]))

#define ABSENT(name, parameters, found)                                                             \
    fmi3Status name parameters                                                                      \
    {                                                                                               \
        er_component_refuse(c, found);                                                              \
        return fmi3Error;                                                                           \
    }

#define CLOCKS "intervals of a clock are asked for; this FMU has no clocks"
ABSENT(fmi3GetIntervalDecimal, (VARIABLES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]), CLOCKS)
ABSENT(fmi3GetIntervalFraction, (VARIABLES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                             fmi3IntervalQualifier qualifiers[]), CLOCKS)
ABSENT(fmi3GetShiftDecimal, (VARIABLES, fmi3Float64 shifts[]), CLOCKS)
ABSENT(fmi3GetShiftFraction, (VARIABLES, fmi3UInt64 counters[], fmi3UInt64 resolutions[]), CLOCKS)
ABSENT(fmi3SetIntervalDecimal, (VARIABLES, const fmi3Float64 intervals[]), CLOCKS)
ABSENT(fmi3SetIntervalFraction, (VARIABLES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]), CLOCKS)
ABSENT(fmi3SetShiftDecimal, (VARIABLES, const fmi3Float64 shifts[]), CLOCKS)
ABSENT(fmi3SetShiftFraction, (VARIABLES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]), CLOCKS)
ABSENT(fmi3ActivateModelPartition, (fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time), CLOCKS)

ABSENT(fmi3EnterStepMode, (fmi3Instance c), "step mode is asked for; this FMU has no event mode in co-simulation")
ABSENT(fmi3EvaluateDiscreteStates, (fmi3Instance c),
       "an evaluation of discrete states is asked for; this FMU updates them only")

#define STRUCTURE "configuration mode is asked for; the sizes of this FMU's variables are fixed"
ABSENT(fmi3EnterConfigurationMode, (fmi3Instance c), STRUCTURE)
ABSENT(fmi3ExitConfigurationMode, (fmi3Instance c), STRUCTURE)

#define DEPENDENCIES "dependencies of elements are asked for; those in modelDescription.xml hold for all"
ABSENT(fmi3GetNumberOfVariableDependencies, (fmi3Instance c, fmi3ValueReference reference, size_t *count), DEPENDENCIES)
ABSENT(fmi3GetVariableDependencies, (fmi3Instance c, fmi3ValueReference dependent, size_t dependent_elements[],
        fmi3ValueReference independents[], size_t independent_elements[],
        fmi3DependencyKind kinds[], size_t count), DEPENDENCIES)

ABSENT(fmi3GetAdjointDerivative, (fmi3Instance c, const fmi3ValueReference unknowns[], size_t unknown_count,
        const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],
        size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count),
       "adjoint derivatives are asked for; this FMU has directional ones")
ABSENT(fmi3GetOutputDerivatives, (VARIABLES, const fmi3Int32 orders[], fmi3Float64 values[], size_t value_count),
       "output derivatives are asked for; there are none")
