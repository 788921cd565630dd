/* The functions that FMI 2.0 and FMI 3.0 have alike but for the prefix of their names.
 *
 * Included by fmi2.c and fmi3.c, which define FMI(name): the name with the version's prefix.
 */

void FMI(FreeInstance)(void *c)
{
    er_component_free(c);
}

FMI(Status) FMI(ExitInitializationMode)(void *c)
{
    return er_status_taken(c, er_component_exit(c));
}

FMI(Status) FMI(Terminate)(void *c)
{
    return er_status(er_component_terminate(c));
}

FMI(Status) FMI(Reset)(void *c)
{
    return er_status(er_component_reset(c));
}

FMI(Status) FMI(EnterContinuousTimeMode)(void *c)
{
    return er_status(er_component_enter_continuous(c));
}

FMI(Status) FMI(SetTime)(void *c, double time)
{
    return er_status(er_component_set_time(c, time));
}

FMI(Status) FMI(SetContinuousStates)(void *c, const double states[], size_t count)
{
    return er_status_tried(c, er_component_set_states(c, states, count));
}

FMI(Status) FMI(GetEventIndicators)(void *c, double indicators[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_INDICATORS, indicators, count));
}

FMI(Status) FMI(GetContinuousStates)(void *c, double states[], size_t count)
{
    return er_status_tried(c, er_component_get_exchanged(c, ER_STATES, states, count));
}

FMI(Status) FMI(GetNominalsOfContinuousStates)(void *c, double nominals[], size_t count)
{
    return er_status(er_component_get_nominals(c, nominals, count));
}
