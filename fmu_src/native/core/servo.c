/* Servos in a step: the laws that they obey at their torque limits, and what makes them obey another. */
#include "step.h"
#include "transmission.h"

#include <math.h>

/* What a servo does at a moment: w [rad/s], w' [rad/s^2], Kp w + z [N m]. */
typedef struct {
    double wanted, turning, asked;
} moment;

/* w' of a servo [rad/s^2], from p' and the accelerations of p and of the command. */
static double find_turning(const er_motor *motor, double pv, double pa, double command_acceleration)
{
    return er_servo_wanted(motor, pv, pa, command_acceleration);
}

/* Acceleration of a motor in a state under a torque [rad/s^2], as its equation has it. */
static double find_acceleration(const er_run *r, const er_state *state, int d, double torque)
{
    const er_robot *robot = r->system->robot;
    const er_motor *motor = &robot->motor[d];
    const er_motor_work *work = &r->work->motors;
    int k = motor->coordinate;
    double gear = er_wind_up_torque(r, state, k, state->x[k], state->v[k]), slope;
    double winds = 1.0 + er_gear_error_at(robot, motor->joint, state->motors.angle[d]).slope;
    double friction = er_motor_friction(motor, r->system->gears->slip_torque[r->m + d], gear, work->held[d],
                                        state->motors.rate[d], &slope);
    return (torque + winds * gear - friction) / motor->inertia;
}

/* That of a servo in a state, of which w->motors holds the motors' start. */
static moment find_moment(const er_run *r, const er_state *state, int d)
{
    const er_motor *motor = &r->system->robot->motor[d];
    const er_motor_work *work = &r->work->motors;
    double command_acceleration = work->command_acceleration[d], acceleration;
    moment now;
    now.wanted = er_servo_wanted(motor, work->p[d], work->pv[d], state->motors.rate[d] - work->pv[d]);
    now.asked = er_servo_asked(motor, now.wanted, state->motors.integral[d]);
    acceleration = find_acceleration(r, state, d, er_servo_limited(motor, now.asked));
    now.turning = find_turning(motor, work->pv[d], acceleration - command_acceleration, command_acceleration);
    return now;
}

double er_servo_growth(const er_motor *motor, er_servo_law law, double wanted, double turning)
{
    return law.integral == ER_GROWS   ? motor->integral_gain * wanted
           : law.integral == ER_KEEPS ? -motor->rate_gain * turning
                                      : 0.0;
}

double er_servo_slack(const er_run *r, int d)
{
    const er_settings *settings = r->settings;
    const er_motor *motor = &r->system->robot->motor[d];
    double step = settings->longest_step;
    return fmin(settings->slack * r->means->tolerance * motor->inertia / (step * step),
                settings->slack_of_width * motor->torque_limit);
}

double er_servo_rate_slack(const er_run *r)
{
    return r->settings->slack * r->means->tolerance / r->settings->first_step;
}

/* The law from a moment on.  At the limit an integral that grows may ask for more and one that waits for less: it then
 * keeps the torque there (Filippov's solution). */
static er_servo_law find_law(const er_run *r, int d, const moment *now)
{
    const er_motor *motor = &r->system->robot->motor[d];
    const int side = now->asked < 0.0 ? -1 : 1;
    const double beyond = fabs(now->asked) - motor->torque_limit, slack = er_servo_slack(r, d);
    const double waiting = side * motor->rate_gain * now->turning;
    const double growing = waiting + side * motor->integral_gain * now->wanted;
    if (side * now->wanted > 0.0 && fabs(beyond) <= 2.0 * slack && waiting < 0.0 && growing > 0.0)
        return (er_servo_law){side, ER_KEEPS};
    if (beyond > 0.5 * slack)
        return (er_servo_law){side, side * now->wanted > 0.0 ? ER_WAITS : ER_GROWS};
    return (er_servo_law){0, ER_GROWS};
}

/* Whether a law goes on from a moment. */
static bool holds(const er_run *r, int d, er_servo_law law, const moment *now)
{
    const er_motor *motor = &r->system->robot->motor[d];
    const double slack = er_servo_slack(r, d), rate_slack = er_servo_rate_slack(r);
    const double onwards = law.side * now->wanted, beyond = law.side * now->asked - motor->torque_limit;
    if (law.side == 0)
        return fabs(now->asked) <= motor->torque_limit + slack;
    if (law.integral == ER_KEEPS)
        return false; /* found again from where it stands */
    return beyond >= -slack && (law.integral == ER_WAITS ? onwards >= -rate_slack : onwards <= rate_slack);
}

/* Lets a servo obey a law from a moment on. */
static void obey(const er_run *r, er_state *state, int d, er_servo_law law, const moment *now)
{
    const er_motor *motor = &r->system->robot->motor[d];
    state->motors.law[d] = law;
    if (law.integral == ER_KEEPS)
        state->motors.integral[d] = law.side * motor->torque_limit - motor->rate_gain * now->wanted;
}

static bool is_limited(const er_run *r, int d)
{
    return r->system->drive == ER_SERVO && r->system->robot->motor[d].torque_limit < INFINITY;
}

bool er_servos_settle(const er_run *r, er_state *state)
{
    bool begun = false, changed = false;
    for (int d = 0; d < r->motors; d++) {
        const er_servo_law before = state->motors.law[d];
        er_servo_law law = before;
        moment now;
        if (!is_limited(r, d))
            continue;
        if (!begun)
            er_motors_begin(r, state);
        begun = true;
        now = find_moment(r, state, d);
        if (!holds(r, d, law, &now))
            law = find_law(r, d, &now);
        obey(r, state, d, law, &now);
        changed |= law.side != before.side || law.integral != before.integral;
    }
    return changed;
}

void er_servo_cross(const er_run *r, er_state *state, const er_crossing *crossing)
{
    int d = crossing->coordinate - r->m;
    moment now;
    er_motors_begin(r, state);
    now = find_moment(r, state, d);
    obey(r, state, d, crossing->at == ER_AT_LIMIT ? find_law(r, d, &now) : crossing->law, &now);
}

void er_servo_end(const er_run *r, const er_state *state, er_step *step, int d, double wanted)
{
    const er_motor *motor = &r->system->robot->motor[d];
    const er_nodes *nodes = &r->work->stages;
    const er_servo_law law = r->work->motors.law[d];
    const double *qdd = nodes->qdd[motor->joint];
    er_motor_work *work = &r->work->motors;
    er_motor_end *end = &step->motors;
    er_servo_course *course = &work->course[d];
    moment start;
    for (int l = 0; law.integral == ER_GROWS && l < ER_STAGES; l++)
        end->integral[d] += step->length * er_gauss_end_rate[l] * motor->integral_gain * work->wanted[d][l];
    if (law.integral == ER_KEEPS)
        end->integral[d] = law.side * motor->torque_limit - motor->rate_gain * wanted;
    if (!is_limited(r, d))
        return;
    start = find_moment(r, state, d);
    course->wanted[0] = start.wanted;
    course->turning[0] = start.turning;
    course->asked[0] = start.asked;
    for (int l = 0; l < ER_STAGES; l++) {
        course->wanted[1 + l] = work->wanted[d][l];
        course->turning[1 + l] = find_turning(motor, work->stage_pv[d][l], step->motor_acceleration[d][l], qdd[l]);
        course->asked[1 + l] = er_servo_asked(motor, work->wanted[d][l], work->integral[d][l]);
    }
    course->wanted[ER_DEGREE] = wanted;
    course->turning[ER_DEGREE] = find_turning(motor, end->pv[d], end->pa[d], end->acceleration[d] - end->pa[d]);
    course->asked[ER_DEGREE] = er_servo_asked(motor, wanted, end->integral[d]);
}
