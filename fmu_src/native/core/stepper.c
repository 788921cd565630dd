#include "step.h"

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "sensitivity.h"

/* The error estimate of a step of length h falls as h^6: h^2 times the defect, of order 4. */
#define ERROR_EXPONENT (1.0 / 6.0)

void er_state_start(er_state *state, const er_robot *robot, const er_gears *gears, double time)
{
    state->time = time;
    state->step = robot->settings.first_step;
    state->predictor_step = 0.0;
    state->rate = 1.0;
    state->touching = -1;
    memset(state->predictor, 0, sizeof state->predictor);
    memset(&state->linearisation, 0, sizeof state->linearisation);
    for (int k = 0; k < robot->elastics; k++)
        state->region[k] = er_gear_region(gears, k, state->x[k]);
}

size_t er_state_size(const er_robot *robot)
{
    return er_all_elements(robot) > 0 ? sizeof(er_state) : offsetof(er_state, stops);
}

void er_state_copy(const er_robot *robot, er_state *to, const er_state *from)
{
    memcpy(to, from, er_state_size(robot)); /* a library's copy is faster than an assignment of this size */
}

/* Stage accelerations at other nodes of a step's polynomial. */
static void interpolate(int m, double start, double ratio, const er_lanes *known, er_lanes *out)
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

/* Stage accelerations to start from: the last step's polynomial, continued. */
static void guess(const er_run *r, const er_state *state, double h, er_step *step)
{
    if (state->predictor_step > 0.0) {
        double ratio = h / state->predictor_step;
        interpolate(r->m, 1.0, ratio, (const er_lanes *)state->predictor, step->acceleration);
        interpolate(r->motors, 1.0, ratio, (const er_lanes *)state->motors.predictor, step->motor_acceleration);
    } else {
        memset(step->acceleration, 0, (size_t)r->m * sizeof *step->acceleration);
        memset(step->motor_acceleration, 0, (size_t)r->motors * sizeof *step->motor_acceleration);
    }
}

/* Those of a part of a step that was tried. */
static void guess_part(const er_run *r, double ratio, const er_step *tried, er_step *step)
{
    interpolate(r->m, 0.0, ratio, (const er_lanes *)tried->acceleration, step->acceleration);
    interpolate(r->motors, 0.0, ratio, (const er_lanes *)tried->motor_acceleration, step->motor_acceleration);
}

/* Solves a step as one of the tries that are left. */
static bool try_step(const er_run *r, const er_state *state, double h, double accuracy, er_step *step)
{
    er_workspace *work = r->work;
    if (work->tries < 1.0)
        return false;
    work->tries -= work->price;
    work->made++;
    return er_solve_step(r, state, h, accuracy, step);
}

/* How far a step's end is beyond a boundary [rad, rad/s, m], and at what rate it goes on. */
static double find_beyond(const er_run *r, const er_crossing *crossing, const er_step *step, double *rate)
{
    int k = crossing->coordinate;
    bool of_motor = crossing->at != ER_AT_CONTACT && k >= r->m;
    const er_servo_course *course = of_motor ? &r->work->motors.course[k - r->m] : NULL;
    double value = of_motor ? step->motors.angle[k - r->m] : step->x[k];
    *rate = of_motor ? step->motors.rate[k - r->m] : step->v[k];
    if (crossing->at == ER_AT_REVERSAL) {
        value = *rate;
        *rate = of_motor ? step->motors.acceleration[k - r->m] : step->a[k];
    } else if (crossing->at == ER_AT_CONTACT) {
        value = step->depth[ER_DEGREE];
        *rate = er_end_approach(r, step);
    } else if (crossing->at == ER_AT_TURN) {
        value = course->wanted[ER_DEGREE];
        *rate = course->turning[ER_DEGREE];
    } else if (crossing->at == ER_AT_LIMIT) {
        const er_motor *motor = &r->system->robot->motor[k - r->m];
        value = course->asked[ER_DEGREE];
        *rate = motor->rate_gain * course->turning[ER_DEGREE] +
                er_servo_growth(motor, r->work->motors.law[k - r->m], course->wanted[ER_DEGREE],
                                course->turning[ER_DEGREE]);
    }
    *rate *= crossing->outward;
    return crossing->outward * (value - crossing->boundary);
}

/* How far a step may miss a boundary [rad, rad/s, m]. */
static double find_allowed(const er_run *r, const er_crossing *crossing)
{
    const er_robot *robot = r->system->robot;
    double tolerance = r->means->tolerance, slack = ER_CONTACT_SLACK;
    switch (crossing->at) {
    case ER_AT_EDGE: slack = er_gear_slack(r->system->gears, r->settings, crossing->coordinate, tolerance); break;
    case ER_AT_SLIP: slack = er_stop_slack(robot, crossing->element, tolerance); break;
    case ER_AT_REVERSAL: slack = er_reversal_slack(robot, crossing->coordinate, tolerance); break;
    case ER_AT_CONTACT: break;
    case ER_AT_LIMIT: slack = er_servo_slack(r, crossing->coordinate - r->m); break;
    case ER_AT_TURN: slack = er_servo_rate_slack(r); break;
    case ER_AT_RELEASE: return INFINITY; /* both laws have the same z' there */
    }
    return r->settings->landing * slack;
}

/* The error that Newton's method may leave in x [rad] for that: x' is less exact by the longest step (er_solve_step). */
static double find_accuracy(const er_run *r, const er_crossing *crossing, double allowed)
{
    double accuracy = r->settings->landing_iteration * allowed;
    switch (crossing->at) {
    case ER_AT_EDGE:
    case ER_AT_SLIP:
    case ER_AT_CONTACT: return accuracy;
    case ER_AT_REVERSAL:
    case ER_AT_TURN: return accuracy * r->settings->longest_step;
    case ER_AT_LIMIT:
        return accuracy * r->settings->longest_step / r->system->robot->motor[crossing->coordinate - r->m].rate_gain;
    case ER_AT_RELEASE: break;
    }
    return r->means->iteration * r->means->tolerance;
}

/* Shortens a solved step until it ends on the boundary it crosses, in w->landed. */
static bool land(const er_run *r, const er_state *state, const er_step *step,
                 const er_crossing *crossing)
{
    er_step *landed = &r->work->landed;
    double h = crossing->fraction * step->length, from = step->length;
    double allowed = find_allowed(r, crossing), accuracy = find_accuracy(r, crossing, allowed);
    guess_part(r, h / from, step, landed);
    for (int trial = 0; trial < r->settings->most_landings; trial++) {
        double beyond, rate;
        if (trial > 0)
            guess_part(r, h / from, landed, landed);
        if (!try_step(r, state, h, accuracy, landed))
            return false;
        beyond = find_beyond(r, crossing, landed, &rate);
        if (fabs(beyond) <= allowed)
            return landed->error <= r->means->tolerance;
        if (!(rate > 0.0))
            return false;
        from = h;
        h -= fmin(fmax(beyond / rate, -h), 0.5 * h);
    }
    return false;
}

static void take_end(const er_run *r, er_state *state, const er_step *step)
{
    if (r->work->sensitivity != NULL)
        er_sensitivity_follow(r->work->sensitivity, r, state, step);
    er_stops_follow(r->system->robot, &state->stops, state->x, step->x, state->stops.elongation);
    if (r->motors > 0) {
        er_motors *motors = &state->motors;
        er_stops_follow_motors(r->system->robot, &state->stops, motors->angle, step->motors.angle,
                               state->stops.elongation);
        memcpy(motors->angle, step->motors.angle, sizeof motors->angle);
        memcpy(motors->rate, step->motors.rate, sizeof motors->rate);
        memcpy(motors->integral, step->motors.integral, sizeof motors->integral);
    }
    memcpy(state->x, step->x, (size_t)r->m * sizeof *state->x);
    memcpy(state->v, step->v, (size_t)r->m * sizeof *state->v);
    state->predictor_step = step->length;
    state->rate = fmin(step->rate, 1.0);
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
    for (int j = 0; j < er_all_elements(robot); j++)
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

static void take_crossing(const er_run *r, er_state *state, const er_step *step,
                          const er_crossing *crossing)
{
    take_end(r, state, step);
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
    state->rate = 1.0;
    r->work->linearisation.length = 0.0; /* the slopes have changed */
}

/* A step that lands on what another coordinate crosses may end just behind a motor's reversal, which no later step
 * has in it. */
static void stick_reversed(const er_run *r, er_state *state)
{
    const er_robot *robot = r->system->robot;
    for (int d = 0; d < r->motors; d++) {
        int j = robot->elements + d, way = state->stops.slipping[j];
        if (!(way * state->motors.rate[d] < -er_reversal_slack(robot, r->m + d, r->means->tolerance)))
            continue;
        er_stops_stick(robot, &state->stops, r->m + d);
        state->rate = 1.0;
        r->work->linearisation.length = 0.0;
    }
}

/* One step, at most to `end`; false if none was found. */
static bool take_step(const er_run *r, er_state *state, double end)
{
    const er_settings *settings = r->settings;
    const er_means *means = r->means;
    er_step *step = &r->work->solved;
    double tolerance = means->tolerance, factor, proposal;
    double wanted = fmin(state->step, settings->longest_step);
    /* What lies beyond three steps does not change this one. */
    double target = er_drives_next_kink(r->system->drives, state->time,
                                        fmin(end, state->time + 3.0 * wanted), means->jump);
    double left = target - state->time;
    /* One step a little longer, or two equal ones, rather than one full and a sliver. */
    double h = left <= settings->stretch * wanted ? left : fmin(wanted, 0.5 * left);
    bool reaches_target = h == left;
    er_crossing crossing;

    guess(r, state, h, step);
    for (;;) {
        double shorter;
        if (r->work->tries < 1.0 ||
            (h < settings->shortest_step * settings->longest_step && !reaches_target))
            return false;
        if (!try_step(r, state, h, means->iteration * tolerance, step)) {
            er_relinearise(r->work);
            h *= settings->cut_after_failure;
            guess(r, state, h, step);
        } else {
            factor = settings->safety * pow(tolerance / fmax(step->error, DBL_MIN), ERROR_EXPONENT);
            bool crosses = er_first_crossing(r, state, step, &crossing);
            if (r->system->contacting)
                crosses = er_earlier_contact(state->touching == 1, step->depth, crosses, &crossing);
            if (crosses) {
                if (land(r, state, step, &crossing)) {
                    take_crossing(r, state, &r->work->landed, &crossing);
                    return true;
                }
                shorter = 0.5 * crossing.fraction * h;
            } else if (step->error <= tolerance) {
                break;
            } else {
                shorter = h * fmax(settings->strongest_cut, factor);
            }
            guess_part(r, shorter / h, step, step);
            h = shorter;
        }
        wanted = h;
        reaches_target = false;
    }
    /* A step cut short by the target says little about the step that the error would allow. */
    proposal = h * fmin(settings->fastest_growth, factor);
    if (h < wanted)
        proposal = fmax(proposal, wanted);
    else if (factor < settings->smallest_growth)
        proposal = h * fmin(1.0, factor);
    take_end(r, state, step);
    if (reaches_target && target < end)
        r->work->tries += settings->tries_per_sample;
    state->time = reaches_target ? target : state->time + h;
    state->step = fmin(proposal, settings->longest_step);
    memcpy(state->predictor, step->acceleration, (size_t)r->m * sizeof *state->predictor);
    memcpy(state->motors.predictor, step->motor_acceleration, (size_t)r->motors * sizeof *state->predictor);
    if (step->passes > settings->usual_passes)
        er_relinearise(r->work);
    stick_reversed(r, state);
    return true;
}

/* Tries after which an integration over a time [s] is given up; with a smaller tolerance steps are
 * shorter. */
static double most_tries(const er_settings *settings, double tolerance, double length)
{
    double finer = pow(settings->usual_local_error / tolerance, ERROR_EXPONENT);
    return fmax(finer, 1.0) * (settings->most_tries +
                               settings->most_tries_per_longest * length / settings->longest_step);
}

/* The first coordinate that has bent further than a robot can, or -1. */
static int overbent(const er_run *r, const er_state *state)
{
    for (int k = 0; k < r->m; k++)
        if (!(fabs(state->x[k]) <= r->settings->most_deflection))
            return k;
    return -1;
}

/* At which elasticity throws the TCP, each joint as if all beyond it were in a line [m/s]. */
static double speed_of(const er_run *r, const er_state *state)
{
    double sum = 0.0;
    for (int k = 0; k < r->m; k++) {
        double speed = r->system->robot->reach[k] * state->v[k];
        sum += speed * speed;
    }
    return sqrt(sum);
}

static bool give_up(const er_run *r, double elapsed, double length, double speed, er_failure *failure)
{
    char needs[80];
    if (r->work->tries < 1.0)
        snprintf(needs, sizeof needs, "more than %ld tries of a step at %.3g m/s", r->work->made, speed);
    else
        snprintf(needs, sizeof needs, "steps below %.1g s",
                 r->settings->shortest_step * r->settings->longest_step);
    return er_fail(failure, "the motion, %.3g s into a step of %.6g s, needs %s", elapsed, length, needs);
}

/* Whether the contact presses: what moved the plane since may have changed it. */
static void touch(const er_run *r, er_state *state)
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
        state->rate = 1.0;
        state->step = fmin(r->settings->first_step, state->step);
        r->work->linearisation.length = 0.0;
    }
}

/* Servos at their torque limits may be elsewhere by new commands. */
static void settle_servos(const er_run *r, er_state *state)
{
    if (!er_servos_settle(r, state))
        return;
    state->rate = 1.0;
    r->work->linearisation.length = 0.0;
}

bool er_advance(er_state *state, const er_system *system, const er_means *means, double end,
                er_workspace *work, er_failure *failure)
{
    const er_settings *settings = &system->robot->settings;
    er_run r = {system, settings, means, work, system->robot->elastics,
                system->drive == ER_IDEAL ? 0 : system->robot->motors};
    const double start = state->time, length = end - start;
    /* What is left after a crossing just before the end may be less than any step. */
    double longest = settings->longest_step;
    double negligible = fmax(settings->shortest_step * longest, 8.0 * DBL_EPSILON * fabs(end));
    work->tries = most_tries(settings, means->tolerance, length);
    work->made = 0;
    er_linearise_as(&r, state);
    if (memcmp(state->linearisation.anchor, system->load.anchor.stiffness,
               sizeof system->load.anchor.stiffness) != 0)
        state->rate = 1.0; /* of other matrices */
    touch(&r, state);
    settle_servos(&r, state);
    while (end - state->time > negligible) {
        double speed = speed_of(&r, state);
        int k;
        work->price = fmax(1.0, speed / settings->usual_speed);
        if (!take_step(&r, state, end))
            return give_up(&r, state->time - start, length, speed, failure);
        k = overbent(&r, state);
        if (k >= 0)
            return er_fail(failure, "the motion, %.3g s into a step of %.6g s, bends deflection[%d]"
                           " beyond %.3g rad", state->time - start, length, k + 1,
                           settings->most_deflection);
    }
    state->time = end;
    state->linearisation = work->linearisation;
    memcpy(state->motors.slopes, work->motors.slopes, (size_t)r.motors * sizeof *work->motors.slopes);
    return true;
}
