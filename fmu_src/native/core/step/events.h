/* Events: the kinds of changes of law, each with all that the step, its sensitivities and model exchange need of it. */
#ifndef ER_EVENTS_H
#define ER_EVENTS_H

#include "columns.h"

typedef struct {
    /* What passes the boundary, at the end of a step, and at what rate. */
    double (*value)(const er_run *r, const er_crossing *crossing, const er_step *step, double *rate);
    /* How far beyond the boundary the law changes, so that rounding does not undo it, in the value's unit. */
    double (*slack)(const er_robot *robot, const er_gears *gears, double tolerance, int coordinate, int element);
    /* The error that Newton's method may leave in x [rad] where the value may be so far off the boundary. */
    double (*accuracy)(const er_run *r, const er_crossing *crossing, double allowed);
    /* Has the state at the end of a step obey what is beyond. */
    void (*apply)(const er_run *r, er_state *state, const er_crossing *crossing);
    /* Corrects the columns of sensitivities, before that; NULL where nothing is missing. */
    void (*correct)(er_sensitivity *sensitivity, const er_run *r, const er_state *state, const er_step *step,
                    const er_crossing *crossing);
} er_event;

extern const er_event er_events[ER_EVENTS];

/* Has an element slip in a direction from now on. */
void er_slip_element(const er_run *r, er_state *state, int element, int direction);

#endif
