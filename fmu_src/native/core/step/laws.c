/* Steps that end where a law changes, and the laws that a state obeys from there on. */
#include "laws.h"

#include <math.h>
#include <string.h>

#include "sensitivity.h"
#include "newton_iteration.h"
#include "crossing_sensitivity.h"
#include "motor_step.h"
#include "stage.h"
#include "events.h"

/* Stage accelerations at other nodes of a step's polynomial. */
static void interpolate_stages(int m, double start, double ratio, const er_lanes *known, er_lanes *out)
{
    double weight[ER_STAGES][ER_STAGES];
    if (m == 0)
        return;
    er_gauss_interpolation(start, ratio, weight);
    for (int k = 0; k < m; k++) {
        er_lanes values;
        for (int i = 0; i < ER_STAGES; i++) {
            values[i] = 0.0;
            for (int j = 0; j < ER_STAGES; j++)
                values[i] += weight[i][j] * known[k][j];
        }
        memcpy(out[k], values, sizeof values);
    }
}

void er_guess(const er_run *r, const er_state *state, double h, er_step *step)
{
    if (state->predictor_step > 0.0) {
        /* Of a step that is hardly one the acceleration at its end is held: its polynomial is rounding. */
        double ratio = er_command_counts(r->system->robot, state->predictor_step) ? h / state->predictor_step : 0.0;
        interpolate_stages(r->m, 1.0, ratio, (const er_lanes *)state->predictor, step->acceleration);
        interpolate_stages(r->motors, 1.0, ratio, (const er_lanes *)state->motors.predictor, step->motor_acceleration);
    } else {
        memset(step->acceleration, 0, (size_t)r->m * sizeof *step->acceleration);
        memset(step->motor_acceleration, 0, (size_t)r->motors * sizeof *step->motor_acceleration);
    }
}

void er_guess_part(const er_run *r, double ratio, const er_step *tried, er_step *step)
{
    interpolate_stages(r->m, 0.0, ratio, (const er_lanes *)tried->acceleration, step->acceleration);
    interpolate_stages(r->motors, 0.0, ratio, (const er_lanes *)tried->motor_acceleration, step->motor_acceleration);
}

bool er_try_step(const er_run *r, const er_state *state, double h, double accuracy, er_step *step)
{
    er_workspace *work = r->work;
    if (work->tries < 1.0)
        return false;
    work->tries -= work->price;
    work->made++;
    return er_solve_step(r, state, h, accuracy, step);
}

bool er_land(const er_run *r, const er_state *state, const er_step *step, const er_crossing *crossing)
{
    er_step *landed = &r->work->landed;
    double h = crossing->fraction * step->length, from = step->length;
    const er_event *event = &er_events[crossing->at];
    const double allowed = r->settings->landing * event->slack(r->system->robot, r->system->gears, r->means->tolerance,
                                                               crossing->coordinate, crossing->element);
    const double accuracy = event->accuracy(r, crossing, allowed);
    er_guess_part(r, h / from, step, landed);
    for (int trial = 0; trial < r->settings->most_landings; trial++) {
        double beyond, rate;
        if (trial > 0)
            er_guess_part(r, h / from, landed, landed);
        if (!er_try_step(r, state, h, accuracy, landed))
            return false;
        beyond = crossing->outward * (event->value(r, crossing, landed, &rate) - crossing->boundary);
        rate *= crossing->outward;
        if (fabs(beyond) <= allowed)
            return landed->error <= r->means->tolerance;
        if (!(rate > 0.0))
            return false;
        from = h;
        h -= fmin(fmax(beyond / rate, -h), 0.5 * h);
    }
    return false;
}

/* Lets Newton's method find its matrices and its rate anew, as slopes have changed. */
static void forget_matrices(const er_run *r, er_state *state)
{
    state->rate = 1.0;
    r->work->linearisation.length = 0.0;
}

/* A step that ends on one boundary may have passed others of the same moment by a hair: what is beyond one obeys the
 * law there from now on. */
static void settle_laws(const er_run *r, er_state *state)
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
            er_slip_element(r, state, j, elongation > 0.0 ? 1 : -1);
    }
    er_servos_settle(r, state);
}

void er_take_crossing(const er_run *r, er_state *state, const er_step *step, const er_crossing *crossing)
{
    const er_event *event = &er_events[crossing->at];
    state->time += step->length;
    if (r->work->sensitivity != NULL && r->work->sensitivity->reason == NULL && event->correct != NULL)
        event->correct(r->work->sensitivity, r, state, step, crossing);
    event->apply(r, state, crossing);
    settle_laws(r, state);
    if (crossing->at == ER_AT_EDGE || crossing->at == ER_AT_CONTACT) {
        r->work->crossings++;
        state->step = fmin(r->settings->first_step, state->step);
    }
    /* The acceleration is continuous across the boundary, its derivative is not. */
    for (int k = 0; k < r->m; k++)
        for (int l = 0; l < ER_STAGES; l++)
            state->predictor[k][l] = step->a[k];
    for (int d = 0; d < r->motors; d++)
        for (int l = 0; l < ER_STAGES; l++) {
            state->motors.predictor[d][l] = step->motors.pa[d];
            state->predictor[r->system->robot->motor[d].coordinate][l] += step->motors.pa[d];
        }
    forget_matrices(r, state);
}

void er_stick_reversed(const er_run *r, er_state *state)
{
    const er_robot *robot = r->system->robot;
    for (int d = 0; d < r->motors; d++) {
        int j = robot->elements + d, way = state->stops.slipping[j];
        if (!(way * state->motors.rate[d] < -er_reversal_slack(robot, r->m + d, r->means->tolerance)))
            continue;
        er_stops_stick(robot, &state->stops, r->m + d);
        forget_matrices(r, state);
    }
}

static void settle_contact(const er_run *r, er_state *state)
{
    int before = state->touching, after = 0;
    double miss = r->settings->landing * ER_CONTACT_SLACK;
    if (r->system->contacting) {
        double depth = er_contact_depth(r, state);
        after = depth > (before == 1 ? -miss : before == 0 ? ER_CONTACT_SLACK + miss : 0.0);
    }
    state->touching = after;
    if (after == 1)
        state->rate = 1.0; /* what the contact exerts is not linear, and its law may be another */
    if (before >= 0 && before != after) {
        state->step = fmin(r->settings->first_step, state->step);
        forget_matrices(r, state);
    }
}

void er_obey_inputs(const er_run *r, er_state *state)
{
    settle_contact(r, state);
    if (er_servos_settle(r, state))
        forget_matrices(r, state);
}
