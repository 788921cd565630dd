/* The laws that a state obeys: what changes at the end of a step, and between steps. */
#include "step.h"

#include <math.h>

#include "sensitivity.h"

/* Lets Newton's method find its matrices and its rate anew, as slopes have changed. */
static void forget(const er_run *r, er_state *state)
{
    state->rate = 1.0;
    r->work->linearisation.length = 0.0;
}

static void slip_one(const er_run *r, er_state *state, int j, int direction)
{
    if (r->work->sensitivity != NULL)
        er_sensitivity_slip(r->work->sensitivity, j);
    er_stops_slip(r->system->robot, &state->stops, j, direction);
}

static void slip(const er_run *r, er_state *state, const er_crossing *crossing)
{
    const er_robot *robot = r->system->robot;
    int k = crossing->coordinate;
    for (int j = robot->first_element[k]; j < robot->first_element[k + 1]; j++)
        if (er_stops_slips_too(robot, &state->stops, j, crossing->element, crossing->outward))
            slip_one(r, state, j, crossing->outward);
}

/* A step that ends on one boundary may have passed others of the same moment by a hair: what is beyond one obeys the
 * law there from now on. */
static void settle(const er_run *r, er_state *state)
{
    const er_system *system = r->system;
    const er_robot *robot = system->robot;
    for (int k = 0; k < r->m; k++) {
        double edge[2];
        int outward, region = state->region[k];
        if (!er_gear_switches(system->gears, k))
            continue;
        er_gear_edges(system->gears, r->settings, k, region, r->means->tolerance, edge);
        outward = state->x[k] > edge[1] ? 1 : state->x[k] < edge[0] ? -1
                                                                    : 0;
        if (outward != 0)
            state->region[k] = region == 0 ? outward : 0;
    }
    for (int j = 0; j < robot->elements + r->motors; j++) {
        const er_element *element = &robot->element[j];
        int way = state->stops.slipping[j], k = element->coordinate;
        double elongation = state->stops.elongation[j];
        double rate = k < r->m ? state->v[k] : state->motors.rate[k - r->m];
        if (way != 0 && way * rate < -er_reversal_slack(robot, k, r->means->tolerance))
            er_stops_stick(robot, &state->stops, k);
        else if (way == 0 && fabs(elongation) > element->angle + er_stop_slack(robot, j, r->means->tolerance))
            slip_one(r, state, j, elongation > 0.0 ? 1 : -1);
    }
    er_servos_settle(r, state);
}

static void change_servo(const er_run *r, er_state *state, const er_step *step, const er_crossing *crossing)
{
    int d = crossing->coordinate - r->m;
    const er_servo_law before = state->motors.law[d];
    er_servo_cross(r, state, crossing);
    if (r->work->sensitivity != NULL && crossing->at == ER_AT_LIMIT)
        er_sensitivity_limit(r->work->sensitivity, r, state, step, d, before);
}

void er_take_crossing(const er_run *r, er_state *state, const er_step *step, const er_crossing *crossing)
{
    if (r->work->sensitivity != NULL)
        er_sensitivity_cross(r->work->sensitivity, r, state, step, crossing);
    state->time += step->length;
    switch (crossing->at) {
    case ER_AT_EDGE: state->region[crossing->coordinate] = crossing->region; break;
    case ER_AT_SLIP: slip(r, state, crossing); break;
    case ER_AT_REVERSAL: er_stops_stick(r->system->robot, &state->stops, crossing->coordinate); break;
    case ER_AT_CONTACT: state->touching = crossing->region; break;
    case ER_AT_LIMIT:
    case ER_AT_TURN:
    case ER_AT_RELEASE: change_servo(r, state, step, crossing); break;
    }
    settle(r, state);
    if (crossing->at == ER_AT_EDGE || crossing->at == ER_AT_CONTACT)
        state->step = fmin(r->settings->first_step, state->step);
    /* The acceleration is continuous across the boundary, its derivative is not. */
    for (int k = 0; k < r->m; k++)
        for (int l = 0; l < ER_STAGES; l++)
            state->predictor[k][l] = step->a[k];
    for (int d = 0; d < r->motors; d++)
        for (int l = 0; l < ER_STAGES; l++) {
            state->motors.predictor[d][l] = step->motors.pa[d];
            state->predictor[r->system->robot->motor[d].coordinate][l] += step->motors.pa[d];
        }
    forget(r, state);
}

void er_stick_reversed(const er_run *r, er_state *state)
{
    const er_robot *robot = r->system->robot;
    for (int d = 0; d < r->motors; d++) {
        int j = robot->elements + d, way = state->stops.slipping[j];
        if (!(way * state->motors.rate[d] < -er_reversal_slack(robot, r->m + d, r->means->tolerance)))
            continue;
        er_stops_stick(robot, &state->stops, r->m + d);
        forget(r, state);
    }
}

static void touch(const er_run *r, er_state *state)
{
    int before = state->touching, after = 0;
    double miss = r->settings->landing * ER_CONTACT_SLACK;
    if (r->system->contacting) {
        double depth = er_contact_depth(r, state);
        after = depth > (before == 1 ? -miss : before == 0 ? ER_CONTACT_SLACK + miss
                                                           : 0.0);
    }
    state->touching = after;
    if (after == 1)
        state->rate = 1.0; /* what the contact exerts is not linear, and its law may be another */
    if (before >= 0 && before != after) {
        state->step = fmin(r->settings->first_step, state->step);
        forget(r, state);
    }
}

void er_obey_inputs(const er_run *r, er_state *state)
{
    touch(r, state);
    if (er_servos_settle(r, state))
        forget(r, state);
}
