/* Model exchange as its master sees it. */
#ifndef ER_EXCHANGE_CALLS_H
#define ER_EXCHANGE_CALLS_H

#include "component.h"

/* What an event has changed. */
typedef struct {
    bool has_next;    /* there is a time event */
    bool has_changed; /* states have other values */
    double next_time; /* [s] */
} er_event_update;

bool er_component_enter_event(er_component *c, er_call call);
bool er_component_enter_continuous(er_component *c);
bool er_component_update(er_component *c, er_event_update *update);
bool er_component_completed(er_component *c, bool *has_event);
bool er_component_set_time(er_component *c, double time);
bool er_component_set_states(er_component *c, const double *states, size_t count);

bool er_component_get_nominals(er_component *c, double *nominals, size_t count);

/* What a master reads as one vector: all states in the order of their blocks, their derivatives, or the
 * event indicators. */
typedef enum { ER_STATES,
               ER_STATE_DERIVATIVES,
               ER_INDICATORS } er_exchanged;
bool er_component_get_exchanged(er_component *c, er_exchanged which, double *values, size_t count);

/* Their number. */
bool er_component_count_exchanged(er_component *c, er_exchanged which, size_t *count);

#endif
