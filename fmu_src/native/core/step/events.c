#include "events.h"

#include "crossing_sensitivity.h"
#include "motor_step.h"
#include "stage.h"

/* Number of the motor that a coordinate is, or below 0. */
static int motor_of(const er_run *r, const er_crossing *crossing)
{
    return crossing->coordinate - r->m;
}

static double find_position(const er_run *r, const er_crossing *crossing, const er_step *step, double *rate)
{
    int k = crossing->coordinate, d = motor_of(r, crossing);
    *rate = d >= 0 ? step->motors.rate[d] : step->v[k];
    return d >= 0 ? step->motors.angle[d] : step->x[k];
}

static double find_rate(const er_run *r, const er_crossing *crossing, const er_step *step, double *rate)
{
    int k = crossing->coordinate, d = motor_of(r, crossing);
    *rate = d >= 0 ? step->motors.acceleration[d] : step->a[k];
    return d >= 0 ? step->motors.rate[d] : step->v[k];
}

static double find_depth(const er_run *r, const er_crossing *crossing, const er_step *step, double *rate)
{
    (void)crossing;
    *rate = er_end_approach(r, step);
    return step->depth[ER_DEGREE];
}

static double find_demand(const er_run *r, const er_crossing *crossing, const er_step *step, double *rate)
{
    const int d = motor_of(r, crossing);
    const er_motor *motor = &r->system->robot->motor[d];
    const er_servo_course *course = &r->work->motors.course[d];
    (void)step;
    *rate = motor->rate_gain * course->turning[ER_DEGREE] +
            er_servo_growth(motor, r->work->motors.law[d], course->rate_error[ER_DEGREE], course->turning[ER_DEGREE]);
    return course->demand[ER_DEGREE];
}

static double find_rate_error(const er_run *r, const er_crossing *crossing, const er_step *step, double *rate)
{
    const er_servo_course *course = &r->work->motors.course[motor_of(r, crossing)];
    (void)step;
    *rate = course->turning[ER_DEGREE];
    return course->rate_error[ER_DEGREE];
}

static double gear_slack(const er_robot *robot, const er_gears *gears, double tolerance, int coordinate, int element)
{
    (void)element;
    return er_gear_slack(gears, &robot->settings, coordinate, tolerance);
}

static double slip_slack(const er_robot *robot, const er_gears *gears, double tolerance, int coordinate, int element)
{
    (void)gears, (void)coordinate;
    return er_stop_slack(robot, element, tolerance);
}

static double reversal_slack(const er_robot *robot, const er_gears *gears, double tolerance, int coordinate, int element)
{
    (void)gears, (void)element;
    return er_reversal_slack(robot, coordinate, tolerance);
}

static double contact_slack(const er_robot *robot, const er_gears *gears, double tolerance, int coordinate, int element)
{
    (void)robot, (void)gears, (void)tolerance, (void)coordinate, (void)element;
    return ER_CONTACT_SLACK;
}

static double limit_slack(const er_robot *robot, const er_gears *gears, double tolerance, int coordinate, int element)
{
    (void)gears, (void)element;
    return er_servo_slack(robot, coordinate - robot->elastics, tolerance);
}

static double turn_slack(const er_robot *robot, const er_gears *gears, double tolerance, int coordinate, int element)
{
    (void)gears, (void)coordinate, (void)element;
    return er_servo_rate_slack(robot, tolerance);
}

/* Both laws have the same z' there. */
static double release_slack(const er_robot *robot, const er_gears *gears, double tolerance, int coordinate, int element)
{
    (void)robot, (void)gears, (void)tolerance, (void)coordinate, (void)element;
    return INFINITY;
}

static double for_position(const er_run *r, const er_crossing *crossing, double allowed)
{
    (void)crossing;
    return r->settings->landing_iteration * allowed;
}

/* x' is less exact than x by the longest step (er_solve_step). */
static double for_rate(const er_run *r, const er_crossing *crossing, double allowed)
{
    return for_position(r, crossing, allowed) * r->settings->longest_step;
}

static double for_torque(const er_run *r, const er_crossing *crossing, double allowed)
{
    return for_rate(r, crossing, allowed) / r->system->robot->motor[motor_of(r, crossing)].rate_gain;
}

static double as_usual(const er_run *r, const er_crossing *crossing, double allowed)
{
    (void)crossing, (void)allowed;
    return r->means->iteration * r->means->tolerance;
}

static void enter_region(const er_run *r, er_state *state, const er_crossing *crossing)
{
    (void)r;
    state->region[crossing->coordinate] = crossing->region;
}

void er_slip_element(const er_run *r, er_state *state, int element, int direction)
{
    if (r->work->sensitivity != NULL)
        er_sensitivity_slip(r->work->sensitivity, element);
    er_stops_slip(r->system->robot, &state->stops, element, direction);
}

static void slip_elements(const er_run *r, er_state *state, const er_crossing *crossing)
{
    const er_robot *robot = r->system->robot;
    int k = crossing->coordinate;
    for (int j = robot->first_element[k]; j < robot->first_element[k + 1]; j++)
        if (er_stops_slips_too(robot, &state->stops, j, crossing->element, crossing->outward))
            er_slip_element(r, state, j, crossing->outward);
}

static void stick_elements(const er_run *r, er_state *state, const er_crossing *crossing)
{
    er_stops_stick(r->system->robot, &state->stops, crossing->coordinate);
}

static void touch_or_lift(const er_run *r, er_state *state, const er_crossing *crossing)
{
    (void)r;
    state->touching = crossing->region;
}

const er_event er_events[ER_EVENTS] = {
    [ER_AT_EDGE] = {find_position, gear_slack, for_position, enter_region, er_sensitivity_edge},
    [ER_AT_SLIP] = {find_position, slip_slack, for_position, slip_elements, er_sensitivity_release},
    [ER_AT_REVERSAL] = {find_rate, reversal_slack, for_rate, stick_elements, NULL},
    [ER_AT_CONTACT] = {find_depth, contact_slack, for_position, touch_or_lift, er_sensitivity_contact},
    [ER_AT_LIMIT] = {find_demand, limit_slack, for_torque, er_servo_cross, er_sensitivity_limit},
    [ER_AT_TURN] = {find_rate_error, turn_slack, for_rate, er_servo_cross, NULL},
    [ER_AT_RELEASE] = {find_position, release_slack, as_usual, er_servo_cross, NULL},
};
