#include "stepper.h"

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "sensitivity.h"
#include "laws.h"
#include "newton_matrix.h"
#include "crossings.h"

/* The error estimate of a step of length h falls as h^6: h^2 times the defect, of order 4. */
#define ERROR_EXPONENT (1.0 / 6.0)
/* Steps are at least this part of a communication step that is itself hardly longer than the shortest. */
#define PART_OF_SHORT 1e-3

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
    return er_all_elements(robot) > 0 ? sizeof(er_state)
                                      : offsetof(er_state, predictor) + (size_t)robot->elastics * sizeof(er_lanes);
}

void er_state_copy(const er_robot *robot, er_state *to, const er_state *from)
{
    memcpy(to, from, er_state_size(robot)); /* a library's copy is faster than an assignment of this size */
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

/* One step, at most to `end`; false if none was found. */
static bool take_step(const er_run *r, er_state *state, double end)
{
    const er_settings *settings = r->settings;
    const er_means *means = r->means;
    er_step *step = &r->work->solved;
    double tolerance = means->tolerance, factor, proposal;
    double proposed = fmin(state->step, settings->longest_step);
    /* What lies beyond three steps does not change this one. */
    double target = er_drives_next_kink(r->system->drives, state->time,
                                        fmin(end, state->time + 3.0 * proposed), means->jump);
    double left = target - state->time;
    /* One step a little longer, or two equal ones, rather than one full and a sliver. */
    double h = left <= settings->stretch * proposed ? left : fmin(proposed, 0.5 * left);
    bool reaches_target = h == left;
    er_crossing crossing;

    er_guess(r, state, h, step);
    for (;;) {
        double shorter;
        if (r->work->tries < 1.0 || (h < r->work->shortest && !reaches_target))
            return false;
        if (!er_try_step(r, state, h, means->iteration * tolerance, step)) {
            er_relinearise(r->work);
            h *= settings->cut_after_failure;
            er_guess(r, state, h, step);
        } else {
            factor = settings->safety * pow(tolerance / fmax(step->error, DBL_MIN), ERROR_EXPONENT);
            bool crosses = er_first_crossing(r, state, step, &crossing);
            if (r->system->contacting)
                crosses = er_earlier_contact(state->touching == 1, step->depth, crosses, &crossing);
            if (crosses) {
                if (er_land(r, state, step, &crossing)) {
                    take_end(r, state, &r->work->landed);
                    er_take_crossing(r, state, &r->work->landed, &crossing);
                    return true;
                }
                shorter = 0.5 * crossing.fraction * h;
            } else if (step->error <= tolerance) {
                break;
            } else {
                shorter = h * fmax(settings->strongest_cut, factor);
            }
            er_guess_part(r, shorter / h, step, step);
            h = shorter;
        }
        proposed = h;
        reaches_target = false;
    }
    /* A step cut short by the target says little about the step that the error would allow. */
    proposal = h * fmin(settings->fastest_growth, factor);
    if (h < proposed)
        proposal = fmax(proposal, proposed);
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
    er_stick_reversed(r, state);
    return true;
}

/* Tries after which an integration over a time [s] is given up; with a smaller tolerance steps are shorter. */
static double count_tries(const er_settings *settings, double tolerance, double length)
{
    double finer = pow(settings->usual_local_error / tolerance, ERROR_EXPONENT);
    return fmax(finer, 1.0) * (settings->most_tries +
                               settings->most_tries_per_longest * length / settings->longest_step);
}

/* The first coordinate that has bent further than a robot can, or -1. */
static int find_overbent(const er_run *r, const er_state *state)
{
    for (int k = 0; k < r->m; k++)
        if (!(fabs(state->x[k]) <= r->settings->most_deflection))
            return k;
    return -1;
}

/* At which elasticity throws the TCP, each joint as if all beyond it were in a line [m/s]. */
static double elastic_speed(const er_run *r, const er_state *state)
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
        snprintf(needs, sizeof needs, "steps below %.1g s", r->work->shortest);
    return er_fail(failure, "the motion, %.3g s into a step of %.6g s, needs %s", elapsed, length, needs);
}

bool er_advance(er_state *state, const er_system *system, const er_means *means, double end,
                er_workspace *work, er_failure *failure)
{
    const er_settings *settings = &system->robot->settings;
    er_run r = {system, settings, means, work, system->robot->elastics,
                system->drive == ER_IDEAL ? 0 : system->robot->motors};
    const double start = state->time, length = end - start;
    const double shortest = settings->shortest_step * settings->longest_step;
    /* What is left after a crossing just before the end may be less than any step, unless that is all. */
    const double negligible = fmin(fmax(shortest, 8.0 * DBL_EPSILON * fabs(end)), 0.5 * length);
    work->shortest = fmin(shortest, PART_OF_SHORT * length);
    work->tries = count_tries(settings, means->tolerance, length);
    work->made = 0;
    work->crossings = 0;
    er_linearise_as(&r, state);
    if (memcmp(state->linearisation.anchor, system->load.anchor.stiffness, sizeof system->load.anchor.stiffness) != 0)
        state->rate = 1.0; /* of other matrices */
    er_obey_inputs(&r, state);
    while (end - state->time > negligible) {
        double speed = elastic_speed(&r, state);
        int k;
        work->price = fmax(1.0, speed / settings->usual_speed);
        if (!take_step(&r, state, end))
            return give_up(&r, state->time - start, length, speed, failure);
        k = find_overbent(&r, state);
        if (k >= 0)
            return er_fail(failure, "the motion, %.3g s into a step of %.6g s, bends deflection[%d]"
                           " beyond %.3g rad", state->time - start, length, k + 1, settings->most_deflection);
    }
    state->time = end;
    state->linearisation = work->linearisation;
    memcpy(state->motors.slopes, work->motors.slopes, (size_t)r.motors * sizeof *work->motors.slopes);
    return true;
}
