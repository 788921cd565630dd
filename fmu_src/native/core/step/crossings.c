/* Where a step leaves the region in which a coordinate obeys one smooth law, or a contact begins or ends. */
#include "crossings.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "motor_step.h"

/* A passage is located to this part of a step. */
#define LOCATED 1e-12

/* Bernstein coefficients of the left and right half of a polynomial (de Casteljau). */
static void halve_bernstein(const double *whole, double *left, double *right)
{
    double work[ER_CONTROL];
    memcpy(work, whole, sizeof work);
    for (int round = 0; round < ER_CONTROL; round++) {
        left[round] = work[0];
        right[ER_DEGREE - round] = work[ER_DEGREE - round];
        for (int k = 0; k < ER_DEGREE - round; k++)
            work[k] = 0.5 * (work[k] + work[k + 1]);
    }
}

static bool all_below_or_above(const double *b)
{
    bool below = false, above = false;
    for (int k = 0; k < ER_CONTROL; k++) {
        below |= b[k] <= 0.0;
        above |= b[k] > 0.0;
    }
    return !(below && above);
}

/* The smallest s at which a polynomial, given by its Bernstein coefficients on [start, start +
 * width], rises through zero; a negative number if it does not. */
static double first_rise(const double *b, double start, double width)
{
    double left[ER_CONTROL], right[ER_CONTROL], has_first;
    if (all_below_or_above(b))
        return -1.0;
    if (width < LOCATED)
        return b[0] <= 0.0 && b[ER_DEGREE] > 0.0 ? start + width : -1.0;
    halve_bernstein(b, left, right);
    has_first = first_rise(left, start, 0.5 * width);
    return has_first >= 0.0 ? has_first : first_rise(right, start + 0.5 * width, 0.5 * width);
}

/* Takes a crossing, all but its fraction, if the polynomial of these coefficients passes it before the first. */
static void take_earlier(const double *control, er_crossing crossing, er_crossing *first, bool *has_first)
{
    double beyond[ER_CONTROL];
    for (int k = 0; k < ER_CONTROL; k++)
        beyond[k] = crossing.outward * (control[k] - crossing.boundary);
    crossing.fraction = first_rise(beyond, 0.0, 1.0);
    if (crossing.fraction > 0.0 && (!*has_first || crossing.fraction < first->fraction)) {
        *first = crossing;
        *has_first = true;
    }
}

/* That of what has these values at the start, the nodes and the end of a step. */
static void take_passage(const double values[ER_CONTROL], er_crossing crossing, er_crossing *first, bool *has_first)
{
    double control[ER_CONTROL] = {0.0};
    for (int c = 0; c < ER_CONTROL; c++)
        for (int j = 0; j < ER_CONTROL; j++)
            control[c] += er_gauss_bernstein_from_value[c][j] * values[j];
    take_earlier(control, crossing, first, has_first);
}

/* A coordinate's polynomial over a step: its Bernstein coefficients, which it lies between. */
typedef struct {
    double control[ER_CONTROL], lowest, highest;
} course;

static void bound_course(course *x)
{
    x->highest = -INFINITY, x->lowest = INFINITY;
    for (int c = 0; c < ER_CONTROL; c++) {
        x->highest = x->control[c] > x->highest ? x->control[c] : x->highest;
        x->lowest = x->control[c] < x->lowest ? x->control[c] : x->lowest;
    }
}

static void find_course(double h, double x0, double v0, const er_lanes acceleration, course *x)
{
    for (int c = 0; c < ER_CONTROL; c++) {
        const double *weight = er_gauss_bernstein[c];
        double bend = 0.0;
        for (int j = 0; j < ER_STAGES; j++)
            bend += weight[2 + j] * acceleration[j];
        x->control[c] = weight[0] * x0 + h * (weight[1] * v0 + h * bend);
    }
    bound_course(x);
}

/* Adds what has these values at the start, the nodes and the end of a step, times a factor. */
static void add_values(course *x, double factor, const double values[ER_CONTROL])
{
    for (int c = 0; c < ER_CONTROL; c++)
        for (int j = 0; j < ER_CONTROL; j++)
            x->control[c] += factor * er_gauss_bernstein_from_value[c][j] * values[j];
    bound_course(x);
}

/* How far an entry of x, or a motor, goes in a step at most, and by how much its rate changes; infinite where it is
 * not known so simply.  The polynomials that are 1 at one stage and 0 at the others are below 2 in a step: integrated
 * once they are below 2, and twice below 1. */
typedef struct {
    double rate, far, faster; /* at the start [rad/s]; [rad], [rad/s] */
} reach;

static reach find_farthest(const er_run *r, int k, const er_state *state, const er_step *step)
{
    const er_robot *robot = r->system->robot;
    int d = r->motors > 0 ? robot->motor_of[k] : -1, i = d < 0 ? 0 : robot->motor[d].joint;
    double h = step->length, sum = 0.0, rate = k < r->m ? state->v[k] : state->motors.rate[d];
    const double *accelerations = k < r->m ? step->acceleration[k] : r->work->stages.qdd[i];
    double sign = k < r->m ? -1.0 : 1.0;
    if (k < r->m && d >= 0 && er_has_gear_error(robot, i))
        return (reach){rate, INFINITY, INFINITY};
    if (d < 0)
        sum = fabs(accelerations[0]) + fabs(accelerations[1]) + fabs(accelerations[2]) + fabs(accelerations[3]);
    for (int l = 0; d >= 0 && l < ER_STAGES; l++)
        sum += fabs(accelerations[l] + sign * step->motor_acceleration[d][l]);
    return (reach){rate, h * (fabs(rate) + h * sum), 2.0 * h * sum};
}

/* That of an entry of x, counted from its motor where that moves. */
static void find_wind_up(const er_run *r, int k, const er_state *state, const er_step *step, course *x)
{
    const er_robot *robot = r->system->robot;
    er_gear_error error = {0.0, 0.0, 0.0, 0.0};
    er_lanes acceleration;
    int motor = r->motors > 0 ? robot->motor_of[k] : -1;
    memcpy(acceleration, step->acceleration[k], sizeof acceleration);
    for (int l = 0; motor >= 0 && l < ER_STAGES; l++)
        acceleration[l] -= step->motor_acceleration[motor][l];
    if (motor >= 0 && robot->errors > 0) /* y - p, less the error */
        error = er_gear_error_at(robot, robot->motor[motor].joint, state->motors.angle[motor]);
    find_course(step->length, state->x[k] + error.value,
                state->v[k] + (motor < 0 ? 0.0 : error.slope * state->motors.rate[motor]), (const double *)acceleration,
                x);
    if (motor >= 0 && robot->errors > 0) {
        const er_motor_work *work = &r->work->motors;
        double values[ER_CONTROL];
        values[0] = work->start_error[motor];
        memcpy(values + 1, work->stage_error[motor], sizeof work->stage_error[motor]);
        values[ER_DEGREE] = work->end_error[motor];
        add_values(x, -1.0, values);
    }
}

/* That of a motor: of p, and of its command at the nodes. */
static void find_motor_course(const er_run *r, int d, const er_step *step, course *x)
{
    const er_motor_work *work = &r->work->motors;
    int i = r->system->robot->motor[d].joint;
    double command[ER_CONTROL];
    find_course(step->length, work->p[d], work->pv[d], step->motor_acceleration[d], x);
    command[0] = work->command[d];
    memcpy(command + 1, r->work->stages.q[i], ER_STAGES * sizeof *command);
    command[ER_DEGREE] = r->work->end.q[i][0];
    add_values(x, 1.0, command);
}

/* The same of its rate, raised to the degree of the coordinate. */
static void find_course_rate(const course *x, double h, double *rate)
{
    for (int c = 0; c < ER_CONTROL; c++) {
        double before = c > 0 ? x->control[c] - x->control[c - 1] : 0.0;
        double after = c < ER_DEGREE ? x->control[c + 1] - x->control[c] : 0.0;
        rate[c] = (c * before + (ER_DEGREE - c) * after) / h;
    }
}

/* Whether values of this course round too much to tell its rate over the step: a line between its ends does. */
static bool is_sliver(const course *x, double h, double least)
{
    return ER_DEGREE * DBL_EPSILON * fmax(fabs(x->lowest), fabs(x->highest)) > least * h;
}

static void find_line(double start, double end, double *rate)
{
    for (int c = 0; c < ER_CONTROL; c++)
        rate[c] = start + (end - start) * c / ER_DEGREE;
}

/* That of a motor: of p, and of its command's rate at the nodes, for angles round too much to be told apart. */
static void find_motor_rate(const er_run *r, const er_state *state, int d, const er_step *step, double least,
                            double *rate)
{
    const er_motor_work *work = &r->work->motors;
    int i = r->system->robot->motor[d].joint;
    double start = state->motors.rate[d], end = step->motors.rate[d], command[ER_CONTROL];
    course p;
    find_course(step->length, work->p[d], work->pv[d], step->motor_acceleration[d], &p);
    find_course_rate(&p, step->length, rate);
    command[0] = start - work->pv[d];
    memcpy(command + 1, r->work->stages.qd[i], ER_STAGES * sizeof *command);
    command[ER_DEGREE] = r->work->end.qd[i][0];
    for (int c = 0; c < ER_CONTROL; c++)
        for (int j = 0; j < ER_CONTROL; j++)
            rate[c] += er_gauss_bernstein_from_value[c][j] * command[j];
    if (is_sliver(&p, step->length, least))
        find_line(start, end, rate);
}

/* Where an entry of x leaves its part of a torque curve. */
static void find_backlash_edges(const er_run *r, const er_state *state, const er_step *step, int k, er_crossing *first,
                       bool *has_first)
{
    double edge[2], far = find_farthest(r, k, state, step).far;
    int region = state->region[k];
    course x;
    er_gear_edges(r->system->gears, r->settings, k, region, r->means->tolerance, edge);
    if (state->x[k] - far > edge[0] && state->x[k] + far < edge[1])
        return;
    find_wind_up(r, k, state, step, &x);
    for (int side = 0; side < 2; side++) {
        int outward = side == 1 ? 1 : -1;
        if (side == 1 ? x.highest > edge[1] : x.lowest < edge[0])
            take_earlier(x.control,
                         (er_crossing){.at = ER_AT_EDGE, .coordinate = k, .boundary = edge[side], .outward = outward, .region = region == 0 ? outward : 0},
                         first, has_first);
    }
}

/* Where elements that stick begin to slip. */
static void find_slips(const er_run *r, const er_state *state, int k, double far, const course *x, er_crossing *first,
                       bool *has_first)
{
    const er_robot *robot = r->system->robot;
    const er_stops *stops = &state->stops;
    for (int j = robot->first_element[k]; j < robot->first_element[k + 1]; j++) {
        double way = robot->element[j].angle + er_stop_slack(robot, j, r->means->tolerance);
        if (stops->slipping[j] != 0 || fabs(stops->elongation[j]) + far < way)
            continue;
        for (int outward = -1; outward <= 1; outward += 2) {
            double edge = x->control[0] - stops->elongation[j] + outward * way;
            if (outward > 0 ? x->highest > edge : x->lowest < edge)
                take_earlier(x->control,
                             (er_crossing){.at = ER_AT_SLIP, .coordinate = k, .element = j, .boundary = edge, .outward = outward},
                             first, has_first);
        }
    }
}

/* What happens to the elements of hysteresis or friction of a coordinate. */
static void find_changes(const er_run *r, const er_state *state, const er_step *step, int k, er_crossing *first,
                         bool *has_first)
{
    const er_robot *robot = r->system->robot;
    const er_stops *stops = &state->stops;
    const reach most = find_farthest(r, k, state, step);
    int slips = -1;
    bool may_slip = false, may_reverse;
    course x;
    for (int j = robot->first_element[k]; j < robot->first_element[k + 1]; j++) {
        may_slip |= stops->slipping[j] == 0 && fabs(stops->elongation[j]) + most.far >= robot->element[j].angle;
        if (stops->slipping[j] != 0)
            slips = j;
    }
    may_reverse = slips >= 0 && !(stops->slipping[slips] * most.rate > most.faster);
    if (!may_slip && !may_reverse)
        return;
    if (k >= r->m)
        find_motor_course(r, k - r->m, step, &x);
    else
        find_wind_up(r, k, state, step, &x);
    if (may_slip)
        find_slips(r, state, k, most.far, &x, first, has_first);
    if (may_reverse) {
        double rate[ER_CONTROL], least = er_reversal_slack(robot, k, r->means->tolerance);
        int outward = -stops->slipping[slips];
        if (k < r->m && is_sliver(&x, step->length, least))
            find_line(state->v[k], step->v[k], rate);
        else if (k < r->m)
            find_course_rate(&x, step->length, rate);
        else
            find_motor_rate(r, state, k - r->m, step, least, rate);
        take_earlier(rate,
                     (er_crossing){.at = ER_AT_REVERSAL, .coordinate = k, .element = slips, .boundary = outward * least, .outward = outward},
                     first, has_first);
    }
}

/* Where a servo that has a torque limit comes to obey another law. */
static void find_servo_limits(const er_run *r, const er_state *state, int d, er_crossing *first, bool *has_first)
{
    const er_motor *motor = &r->system->robot->motor[d];
    const er_servo_course *course = &r->work->motors.course[d];
    const er_servo_law law = state->motors.law[d];
    const int side = law.side;
    const er_robot *robot = r->system->robot;
    const double slack = er_servo_slack(robot, d, r->means->tolerance);
    const double rate_slack = er_servo_rate_slack(robot, r->means->tolerance);
    er_crossing crossing = {.at = ER_AT_LIMIT, .coordinate = r->m + d};
    if (law.integral == ER_KEEPS) {
        double waiting[ER_CONTROL], growing[ER_CONTROL];
        for (int c = 0; c < ER_CONTROL; c++) {
            waiting[c] = motor->rate_gain * course->turning[c];
            growing[c] = waiting[c] + motor->integral_gain * course->rate_error[c];
        }
        crossing.at = ER_AT_RELEASE;
        crossing.outward = side, crossing.law = (er_servo_law){side, ER_WAITS};
        take_passage(waiting, crossing, first, has_first);
        crossing.outward = -side, crossing.law = (er_servo_law){0, ER_GROWS};
        take_passage(growing, crossing, first, has_first);
        return;
    }
    for (int outward = -1; outward <= 1; outward += 2) {
        crossing.outward = outward;
        crossing.boundary = (side == 0 ? outward : side) * motor->torque_limit + outward * slack;
        if (outward != side)
            take_passage(course->demand, crossing, first, has_first);
    }
    if (side == 0)
        return;
    crossing.at = ER_AT_TURN;
    crossing.outward = law.integral == ER_WAITS ? -side : side;
    crossing.boundary = crossing.outward * rate_slack;
    crossing.law = (er_servo_law){side, law.integral == ER_WAITS ? ER_GROWS : ER_WAITS};
    take_passage(course->rate_error, crossing, first, has_first);
}

bool er_first_crossing(const er_run *r, const er_state *state, const er_step *step, er_crossing *first)
{
    const er_system *system = r->system;
    bool has_first = false;
    for (int k = 0; k < r->m; k++)
        if (er_gear_switches(system->gears, k))
            find_backlash_edges(r, state, step, k, first, &has_first);
    for (int k = 0; system->robot->elements + r->motors > 0 && k < r->m + r->motors; k++)
        if (system->robot->first_element[k] < system->robot->first_element[k + 1] &&
            !er_stops_idle(system->robot, system->gears->slip_torque, k))
            find_changes(r, state, step, k, first, &has_first);
    for (int d = 0; system->drive == ER_SERVO && d < r->motors; d++)
        if (system->robot->motor[d].torque_limit < INFINITY)
            find_servo_limits(r, state, d, first, &has_first);
    return has_first;
}

bool er_earlier_contact(bool touching, const double depth[ER_CONTROL], bool has_first, er_crossing *first)
{
    take_passage(depth,
                 (er_crossing){.at = ER_AT_CONTACT, .boundary = touching ? 0.0 : ER_CONTACT_SLACK, .outward = touching ? -1 : 1, .region = !touching},
                 first, &has_first);
    return has_first;
}
