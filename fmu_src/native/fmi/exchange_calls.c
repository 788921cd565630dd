#include "exchange_calls.h"

#include <math.h>

#include "exchange.h"
#include "variables.h"
#include "blocks.h"

/* As many as one vector may have. */
enum { MOST = ER_MAX_STATES * ER_MAX_ANGLES };

static const char *const called[] = {"continuous states", "derivatives of continuous states",
                                     "event indicators"};

/* Place of a vector's block in the table. */
static int block_of_vector(const er_interface *in, er_exchanged which, int k)
{
    return which == ER_INDICATORS ? in->indicator[k] : which == ER_STATES ? in->state[k].block
                                                                          : in->state[k].derivative;
}

/* Value references of a vector; returns their number. */
static int list_references(const er_interface *in, er_exchanged which, unsigned references[MOST])
{
    int blocks = which == ER_INDICATORS ? in->indicators : in->states, total = 0;
    for (int b = 0; b < blocks; b++) {
        int block = block_of_vector(in, which, b);
        for (int k = 0; k < in->size[block]; k++)
            references[total++] = (unsigned)(in->first[block] + k);
    }
    return total;
}

/* The same where the master gives or takes as many values. */
static bool require_references(er_instance *instance, er_exchanged which, const char *what, size_t count,
                     unsigned references[MOST])
{
    int total = list_references(&instance->interface, which, references);
    return count == (size_t)total ||
           er_fail(&instance->failure, "%s: expected %d values, got %lu", what, total, (unsigned long)count);
}

static bool set_states(er_instance *instance, const double *states, size_t count)
{
    unsigned references[MOST];
    char number[ER_NUMBER_TEXT];
    if (!require_references(instance, ER_STATES, called[ER_STATES], count, references))
        return false;
    for (size_t k = 0; k < count; k++)
        if (!isfinite(states[k]))
            return er_fail(&instance->failure, "continuous state %lu: expected a finite number, got %s",
                           (unsigned long)k + 1, er_shown(states[k], number)) ||
                   er_let_retry(&instance->failure);
    for (size_t k = 0; k < count; k++)
        *er_block_value(instance, references[k]) = states[k];
    instance->fresh = 0;
    return true;
}

static bool get_exchanged(er_instance *instance, er_exchanged which, double *values, size_t count)
{
    unsigned references[MOST];
    return require_references(instance, which, called[which], count, references) &&
           er_instance_get_reals(instance, references, count, values);
}

static bool get_nominals(er_instance *instance, double *nominals, size_t count)
{
    const er_interface *in = &instance->interface;
    unsigned references[MOST];
    if (!require_references(instance, ER_STATES, "nominals of continuous states", count, references))
        return false;
    for (int k = 0; k < in->states; k++)
        for (int i = 0; i < in->size[in->state[k].block]; i++)
            *nominals++ = in->state[k].nominal;
    return true;
}

static bool may_exchange(er_component *c, er_call call)
{
    if (c != NULL && !c->robot->exchange.on)
        return er_component_refuse(c, "model exchange is asked for; this instance was made for co-simulation");
    return er_component_may(c, call);
}

static bool enter_exchange_phase(er_component *c, er_call call, er_phase phase)
{
    if (!may_exchange(c, call))
        return false;
    c->robot->progress.phase = phase;
    return true;
}

bool er_component_enter_event(er_component *c, er_call call)
{
    return enter_exchange_phase(c, call, ER_EVENT_MODE);
}

bool er_component_enter_continuous(er_component *c)
{
    return enter_exchange_phase(c, ER_CALL_UPDATE, ER_CONTINUOUS_MODE);
}

bool er_component_update(er_component *c, er_event_update *update)
{
    if (!may_exchange(c, ER_CALL_UPDATE) || !er_component_told(c, er_exchange_settle(c->robot, &update->has_changed)))
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
           er_component_tried(c, set_states(c->robot, states, count));
}

bool er_component_get_nominals(er_component *c, double *nominals, size_t count)
{
    return may_exchange(c, ER_CALL_ANY) && er_component_given(c, count, nominals, nominals) &&
           er_component_told(c, get_nominals(c->robot, nominals, count));
}

bool er_component_get_exchanged(er_component *c, er_exchanged which, double *values, size_t count)
{
    return may_exchange(c, ER_CALL_GET_STATES) && er_component_given(c, count, values, values) &&
           er_component_tried(c, get_exchanged(c->robot, which, values, count));
}

bool er_component_count_exchanged(er_component *c, er_exchanged which, size_t *count)
{
    unsigned references[MOST];
    if (!may_exchange(c, ER_CALL_ANY) || !er_component_given(c, 1, count, count))
        return false;
    *count = (size_t)list_references(&c->robot->interface, which, references);
    return true;
}
