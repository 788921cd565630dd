/* From where steps begin, and steps that end where a law changes. */
#include "step.h"

#include <math.h>
#include <string.h>

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

void er_guess(const er_run *r, const er_state *state, double h, er_step *step)
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

void er_guess_part(const er_run *r, double ratio, const er_step *tried, er_step *step)
{
    interpolate(r->m, 0.0, ratio, (const er_lanes *)tried->acceleration, step->acceleration);
    interpolate(r->motors, 0.0, ratio, (const er_lanes *)tried->motor_acceleration, step->motor_acceleration);
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

bool er_land(const er_run *r, const er_state *state, const er_step *step, const er_crossing *crossing)
{
    er_step *landed = &r->work->landed;
    double h = crossing->fraction * step->length, from = step->length;
    double allowed = find_allowed(r, crossing), accuracy = find_accuracy(r, crossing, allowed);
    er_guess_part(r, h / from, step, landed);
    for (int trial = 0; trial < r->settings->most_landings; trial++) {
        double beyond, rate;
        if (trial > 0)
            er_guess_part(r, h / from, landed, landed);
        if (!er_try_step(r, state, h, accuracy, landed))
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
