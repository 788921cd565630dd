/* The functions of FMI 3.0 for model exchange. */
#include "fmi3Functions.h"

#include "component.h"

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    return er_status(er_component_enter_event(c, ER_CALL_EVENT));
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    return er_status(er_component_enter_continuous(c));
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
    if (!er_component_given(c, 1, enter_event_mode, terminate) ||
        !er_component_completed(c, enter_event_mode))
        return fmi3Error;
    *terminate = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    return er_status(er_component_set_time(c, time));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 states[], size_t count)
{
    return er_status_tried(c, er_component_set_states(c, states, count));
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 derivatives[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_STATE_DERIVATIVES, derivatives, count));
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_INDICATORS, indicators, count));
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 states[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_STATES, states, count));
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t count)
{
    return er_status(er_component_get_nominals(c, nominals, count));
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *count)
{
    return er_status(er_component_count_exchanged(c, ER_INDICATORS, count));
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *count)
{
    return er_status(er_component_count_exchanged(c, ER_STATES, count));
}
