#include "exchange_calls.h"

#include <math.h>

#include "exchange.h"

static bool may_exchange(er_component *c, er_call call)
{
    if (c != NULL && !c->robot->exchange.on)
        return er_component_refuse(c, "model exchange is asked for; this instance was made for"
                                      " co-simulation");
    return er_component_may(c, call);
}

static bool enter(er_component *c, er_call call, er_phase phase)
{
    if (!may_exchange(c, call))
        return false;
    c->robot->progress.phase = phase;
    return true;
}

bool er_component_enter_event(er_component *c, er_call call)
{
    return enter(c, call, ER_EVENT_MODE);
}

bool er_component_enter_continuous(er_component *c)
{
    return enter(c, ER_CALL_UPDATE, ER_CONTINUOUS_MODE);
}

bool er_component_update(er_component *c, er_event_update *update)
{
    if (!may_exchange(c, ER_CALL_UPDATE) || !er_component_told(c, er_exchange_settle(c->robot)))
        return false;
    update->next_time = er_exchange_next_event(c->robot);
    update->has_next = isfinite(update->next_time) != 0;
    return true;
}

bool er_component_completed(er_component *c, bool *has_event)
{
    return may_exchange(c, ER_CALL_COMPLETED) &&
           er_component_told(c, er_exchange_completed(c->robot, has_event));
}

bool er_component_set_time(er_component *c, double time)
{
    return may_exchange(c, ER_CALL_SET_TIME) &&
           er_component_told(c, er_exchange_set_time(c->robot, time));
}

bool er_component_set_states(er_component *c, const double *states, size_t count)
{
    return may_exchange(c, ER_CALL_SET_STATES) && er_component_given(c, count, states, states) &&
           er_component_tried(c, er_exchange_set_states(c->robot, states, count));
}

bool er_component_get_nominals(er_component *c, double *nominals, size_t count)
{
    return may_exchange(c, ER_CALL_ANY) && er_component_given(c, count, nominals, nominals) &&
           er_component_told(c, er_exchange_get_nominals(c->robot, nominals, count));
}

bool er_component_get_exchanged(er_component *c, er_exchange_getter *getter, double *values,
                                size_t count)
{
    return may_exchange(c, ER_CALL_GET_STATES) && er_component_given(c, count, values, values) &&
           er_component_tried(c, getter(c->robot, values, count));
}

bool er_component_count_exchanged(er_component *c, er_exchange_counter *counter, size_t *count)
{
    if (!may_exchange(c, ER_CALL_ANY) || !er_component_given(c, 1, count, count))
        return false;
    *count = (size_t)counter(c->robot);
    return true;
}
