/* The functions of FMI 2.0 for model exchange. */
#include "fmi2Functions.h"

#include "component.h"

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    return er_status(er_component_enter_event(c, ER_CALL_EVENT_MODE));
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    er_event_update update;
    if (!er_component_given(c, 1, info, info) || !er_component_update(c, &update))
        return fmi2Error;
    info->newDiscreteStatesNeeded = fmi2False;
    info->terminateSimulation = fmi2False;
    info->nominalsOfContinuousStatesChanged = fmi2False;
    info->valuesOfContinuousStatesChanged = update.has_changed ? fmi2True : fmi2False;
    info->nextEventTimeDefined = update.has_next ? fmi2True : fmi2False;
    info->nextEventTime = update.has_next ? update.next_time : 0.0;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    return er_status(er_component_enter_continuous(c));
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set_state,
                                       fmi2Boolean *enter_event_mode, fmi2Boolean *terminate)
{
    bool has_event;
    (void)no_set_state;
    if (!er_component_given(c, 1, enter_event_mode, terminate) ||
        !er_component_completed(c, &has_event))
        return fmi2Error;
    *enter_event_mode = has_event ? fmi2True : fmi2False;
    *terminate = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    return er_status(er_component_set_time(c, time));
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real states[], size_t count)
{
    return er_status_tried(c, er_component_set_states(c, states, count));
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_STATE_DERIVATIVES, derivatives, count));
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_INDICATORS, indicators, count));
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real states[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_STATES, states, count));
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t count)
{
    return er_status(er_component_get_nominals(c, nominals, count));
}
