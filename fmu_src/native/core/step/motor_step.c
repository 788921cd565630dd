/* The motors in a step of the chain: eliminated from its equations, solved beside it; and their servos, the laws that
 * they obey at their torque limits, and what makes them obey another. */
#include "motor_step.h"

#include <math.h>
#include <string.h>

/* Where x and x' of a state are counted from the commands, as the chain moves: w->motors.x and .v. */
static void begin_motors(const er_run *r, const er_state *state)
{
    const er_robot *robot = r->system->robot;
    er_motor_work *work = &r->work->motors;
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS];
    er_drives_at(r->system->drives, state->time, q, qd, qdd);
    memcpy(work->x, state->x, sizeof work->x);
    memcpy(work->v, state->v, sizeof work->v);
    for (int d = 0; d < r->motors; d++) {
        const er_motor *motor = &robot->motor[d];
        const er_gear_error error = er_gear_error_at(robot, motor->joint, state->motors.angle[d]);
        int j = robot->elements + d;
        work->angle[d] = state->motors.angle[d];
        work->start_integral[d] = state->motors.integral[d];
        work->law[d] = state->motors.law[d];
        work->held[d] = state->stops.elongation[j] / robot->element[j].angle;
        work->stuck[d] = state->stops.slipping[j] == 0 ? 1.0 / robot->element[j].angle : 0.0;
        work->command[d] = q[motor->joint];
        work->command_acceleration[d] = qdd[motor->joint];
        work->p[d] = state->motors.angle[d] - q[motor->joint];
        work->start_error[d] = error.value;
        work->pv[d] = state->motors.rate[d] - qd[motor->joint];
        work->x[motor->coordinate] += work->p[d] + error.value;
        work->v[motor->coordinate] += work->pv[d] + error.slope * state->motors.rate[d];
    }
}

er_start er_chain_start(const er_run *r, const er_state *state)
{
    if (r->motors == 0)
        return (er_start){state->x, state->v};
    begin_motors(r, state);
    return (er_start){r->work->motors.x, r->work->motors.v};
}

void er_motors_wind_up(const er_run *r, er_step *step)
{
    for (int d = 0; d < r->motors; d++) {
        const er_motor *motor = &r->system->robot->motor[d];
        const er_motor_end *end = &step->motors;
        er_gear_error error = er_gear_error_at(r->system->robot, motor->joint, end->angle[d]);
        int k = motor->coordinate;
        step->x[k] -= end->p[d] + error.value;
        step->v[k] -= end->pv[d] + error.slope * end->rate[d];
        step->a[k] -= end->pa[d] + error.slope * end->acceleration[d] + error.bend * end->rate[d] * end->rate[d];
    }
}

double er_wind_up_torque(const er_run *r, const er_state *state, int k, double x, double v)
{
    const er_gears *gears = r->system->gears;
    double stuck[ER_MAX_ANGLES] = {0.0};
    double torque = er_gear_torque(gears, k, state->region[k], x) + gears->damping[k] * v;
    if (r->system->robot->elements > 0) {
        er_stops_stiffness(r->system->robot, gears->slip_torque, &state->stops, stuck);
        torque += er_elements_torque(r->system->robot, k, gears->slip_torque[k], state->stops.elongation) +
                  stuck[k] * (x - state->x[k]);
    }
    return torque;
}

static er_motor_slopes find_slopes(const er_run *r, const er_state *state, int d)
{
    const er_motor *motor = &r->system->robot->motor[d];
    const er_motor_work *work = &r->work->motors;
    double slip_torque = r->system->gears->slip_torque[r->m + d], by_angle = work->stuck[d], by_rate;
    double part = er_friction_part(work, d, state->motors.angle[d]);
    int k = motor->coordinate;
    er_motor_slopes slopes;
    er_motor_friction(motor, slip_torque, 0.0, part, state->motors.rate[d], &by_rate);
    slopes = (er_motor_slopes){by_rate, slip_torque * by_angle, 0.0, 1.0, 1.0};
    if (er_motor_is_loaded(r->system->robot, d)) {
        double torque = er_wind_up_torque(r, state, k, state->x[k], state->v[k]);
        er_gear_error error = er_gear_error_at(r->system->robot, motor->joint, state->motors.angle[d]);
        slopes.winds += error.slope;
        slopes.feels = slopes.winds - copysign(motor->load_friction, torque) * part;
        slopes.stiffness += motor->load_friction * fabs(torque) * by_angle - error.bend * torque;
    }
    if (r->system->drive != ER_SERVO || work->law[d].side != 0)
        return slopes;
    slopes.damping += motor->rate_gain;
    slopes.stiffness += motor->rate_gain * motor->position_gain + motor->integral_gain;
    slopes.jerk = motor->integral_gain * motor->position_gain;
    return slopes;
}

static void multiply_complex(double a_re, double a_im, double b_re, double b_im, double *re, double *im)
{
    *re = a_re * b_re - a_im * b_im;
    *im = a_re * b_im + a_im * b_re;
}

void er_motors_linearise(const er_run *r, const er_state *state)
{
    for (int d = 0; d < r->motors; d++)
        r->work->motors.slopes[d] = find_slopes(r, state, d);
}

void er_motors_eliminate(const er_run *r, er_complex_pair *matrix)
{
    er_motor_work *work = &r->work->motors;
    const er_linearisation *at = &r->work->linearisation;
    for (int d = 0; d < r->motors; d++) {
        const er_motor *motor = &r->system->robot->motor[d];
        const er_motor_slopes slopes = work->slopes[d];
        const double both = slopes.winds * slopes.feels;
        int k = motor->coordinate;
        double damping = r->system->gears->damping[k];
        for (int p = 0; p < ER_PAIRS; p++) {
            double re = at->length * er_gauss_eigen_re[p], im = at->length * er_gauss_eigen_im[p];
            double re2, im2, re3, im3, g_re, g_im, a_re, a_im, size, lost_re, lost_im;
            multiply_complex(re, im, re, im, &re2, &im2);
            multiply_complex(re, im, re2, im2, &re3, &im3);
            g_re = re * damping + re2 * at->slope[k];
            g_im = im * damping + im2 * at->slope[k];
            a_re = motor->inertia + re * slopes.damping + re2 * slopes.stiffness + re3 * slopes.jerk + both * g_re;
            a_im = im * slopes.damping + im2 * slopes.stiffness + im3 * slopes.jerk + both * g_im;
            size = a_re * a_re + a_im * a_im;
            work->gear[d][p] = slopes.feels * g_re, work->gear[d][ER_PAIRS + p] = slopes.feels * g_im;
            work->yields[d][p] = a_re / size, work->yields[d][ER_PAIRS + p] = -a_im / size;
            multiply_complex(g_re, g_im, slopes.winds * a_re / size, -slopes.winds * a_im / size, &work->share[d][p],
                     &work->share[d][ER_PAIRS + p]);
            multiply_complex(g_re, g_im, work->share[d][p], work->share[d][ER_PAIRS + p], &lost_re, &lost_im);
            matrix[k * r->m + k].re[p] -= slopes.feels * lost_re;
            matrix[k * r->m + k].im[p] -= slopes.feels * lost_im;
        }
    }
}

double er_motors_defect(const er_run *r, double *defect)
{
    const er_motor_work *work = &r->work->motors;
    double largest = 0.0;
    for (int d = 0; d < r->motors; d++) {
        double residual = work->residual[d][0];
        defect[r->system->robot->motor[d].coordinate] += work->share[d][0] * residual;
        largest = fmax(largest, fabs(residual) * hypot(work->yields[d][0], work->yields[d][ER_PAIRS]));
    }
    return largest;
}

/* What a servo does at a moment: w [rad/s], w' [rad/s^2], Kp w + z [N m]. */
typedef struct {
    double rate_error, turning, demand;
} moment;

/* w' of a servo [rad/s^2], from p' and the accelerations of p and of the command. */
static double find_turning(const er_motor *motor, double pv, double pa, double command_acceleration)
{
    return er_servo_rate_error(motor, pv, pa, command_acceleration);
}

/* Acceleration of a motor in a state under a torque [rad/s^2], as its equation has it. */
static double motor_acceleration_under(const er_run *r, const er_state *state, int d, double torque)
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
    now.rate_error = er_servo_rate_error(motor, work->p[d], work->pv[d], state->motors.rate[d] - work->pv[d]);
    now.demand = er_servo_demand(motor, now.rate_error, state->motors.integral[d]);
    acceleration = motor_acceleration_under(r, state, d, er_servo_limited(motor, now.demand));
    now.turning = find_turning(motor, work->pv[d], acceleration - command_acceleration, command_acceleration);
    return now;
}

double er_servo_growth(const er_motor *motor, er_servo_law law, double rate_error, double turning)
{
    return law.integral == ER_GROWS   ? motor->integral_gain * rate_error
           : law.integral == ER_KEEPS ? -motor->rate_gain * turning
                                      : 0.0;
}

double er_servo_slack(const er_robot *robot, int d, double tolerance)
{
    const er_settings *settings = &robot->settings;
    const er_motor *motor = &robot->motor[d];
    double step = settings->longest_step;
    return fmin(settings->slack * tolerance * motor->inertia / (step * step),
                settings->slack_of_width * motor->torque_limit);
}

double er_servo_rate_slack(const er_robot *robot, double tolerance)
{
    return robot->settings.slack * tolerance / robot->settings.first_step;
}

/* The law from a moment on.  At the limit an integral that grows may ask for more and one that waits for less: it then
 * keeps the torque there (Filippov's solution). */
static er_servo_law find_law(const er_run *r, int d, const moment *now)
{
    const er_motor *motor = &r->system->robot->motor[d];
    const int side = now->demand < 0.0 ? -1 : 1;
    const double beyond = fabs(now->demand) - motor->torque_limit, slack = er_servo_slack(r->system->robot, d, r->means->tolerance);
    const double waiting = side * motor->rate_gain * now->turning;
    const double growing = waiting + side * motor->integral_gain * now->rate_error;
    if (side * now->rate_error > 0.0 && fabs(beyond) <= 2.0 * slack && waiting < 0.0 && growing > 0.0)
        return (er_servo_law){side, ER_KEEPS};
    if (beyond > 0.5 * slack)
        return (er_servo_law){side, side * now->rate_error > 0.0 ? ER_WAITS : ER_GROWS};
    return (er_servo_law){0, ER_GROWS};
}

/* Whether a law goes on from a moment. */
static bool law_holds(const er_run *r, int d, er_servo_law law, const moment *now)
{
    const er_motor *motor = &r->system->robot->motor[d];
    const double slack = er_servo_slack(r->system->robot, d, r->means->tolerance), rate_slack = er_servo_rate_slack(r->system->robot, r->means->tolerance);
    const double onwards = law.side * now->rate_error, beyond = law.side * now->demand - motor->torque_limit;
    if (law.side == 0)
        return fabs(now->demand) <= motor->torque_limit + slack;
    if (law.integral == ER_KEEPS)
        return false; /* found again from where it stands */
    return beyond >= -slack && (law.integral == ER_WAITS ? onwards >= -rate_slack : onwards <= rate_slack);
}

/* Lets a servo obey a law from a moment on. */
static void obey_law(const er_run *r, er_state *state, int d, er_servo_law law, const moment *now)
{
    const er_motor *motor = &r->system->robot->motor[d];
    state->motors.law[d] = law;
    if (law.integral == ER_KEEPS)
        state->motors.integral[d] = law.side * motor->torque_limit - motor->rate_gain * now->rate_error;
}

static bool is_limited(const er_run *r, int d)
{
    return r->system->drive == ER_SERVO && r->system->robot->motor[d].torque_limit < INFINITY;
}

bool er_servos_settle(const er_run *r, er_state *state)
{
    bool has_begun = false, changed = false;
    for (int d = 0; d < r->motors; d++) {
        const er_servo_law before = state->motors.law[d];
        er_servo_law law = before;
        moment now;
        if (!is_limited(r, d))
            continue;
        if (!has_begun)
            begin_motors(r, state);
        has_begun = true;
        now = find_moment(r, state, d);
        if (!law_holds(r, d, law, &now))
            law = find_law(r, d, &now);
        obey_law(r, state, d, law, &now);
        changed |= law.side != before.side || law.integral != before.integral;
    }
    return changed;
}

static er_servo_law law_beyond(const er_run *r, int d, const er_crossing *crossing, const moment *now)
{
    return crossing->at == ER_AT_LIMIT ? find_law(r, d, now) : crossing->law;
}

er_servo_law er_servo_beyond(const er_run *r, const er_state *state, const er_crossing *crossing)
{
    const int d = crossing->coordinate - r->m;
    moment now;
    begin_motors(r, state);
    now = find_moment(r, state, d);
    return law_beyond(r, d, crossing, &now);
}

void er_servo_cross(const er_run *r, er_state *state, const er_crossing *crossing)
{
    const int d = crossing->coordinate - r->m;
    moment now;
    begin_motors(r, state);
    now = find_moment(r, state, d);
    obey_law(r, state, d, law_beyond(r, d, crossing, &now), &now);
}

/* z at the end of a step, where w is known, and the course of a servo that has a torque limit. */
static void end_servo(const er_run *r, const er_state *state, er_step *step, int d, double rate_error)
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
        end->integral[d] += step->length * er_gauss_end_rate[l] * motor->integral_gain * work->rate_error[d][l];
    if (law.integral == ER_KEEPS)
        end->integral[d] = law.side * motor->torque_limit - motor->rate_gain * rate_error;
    if (!is_limited(r, d))
        return;
    start = find_moment(r, state, d);
    course->rate_error[0] = start.rate_error;
    course->turning[0] = start.turning;
    course->demand[0] = start.demand;
    for (int l = 0; l < ER_STAGES; l++) {
        course->rate_error[1 + l] = work->rate_error[d][l];
        course->turning[1 + l] = find_turning(motor, work->stage_pv[d][l], step->motor_acceleration[d][l], qdd[l]);
        course->demand[1 + l] = er_servo_demand(motor, work->rate_error[d][l], work->integral[d][l]);
    }
    course->rate_error[ER_DEGREE] = rate_error;
    course->turning[ER_DEGREE] = find_turning(motor, end->pv[d], end->pa[d], end->acceleration[d] - end->pa[d]);
    course->demand[ER_DEGREE] = er_servo_demand(motor, rate_error, end->integral[d]);
}

void er_motors_end(const er_run *r, const er_state *state, er_step *step)
{
    const er_workspace *w = r->work;
    er_motor_work *work = &r->work->motors;
    double h = step->length;
    r->means->kernel.motor_stages(r->system->robot, r->motors, h, &w->stages,
                                  (const er_lanes *)step->motor_acceleration, work);
    if (r->system->robot->errors > 0)
        memcpy(work->stage_error, work->error, sizeof work->stage_error);
    memcpy(step->motors.p, work->p, sizeof step->motors.p);
    memcpy(step->motors.pv, work->pv, sizeof step->motors.pv);
    r->means->kernel.finish(r->motors, h, (const er_lanes *)step->motor_acceleration, step->motors.p, step->motors.pv);
    for (int d = 0; d < r->motors; d++) {
        const er_motor *motor = &r->system->robot->motor[d];
        double rate_error;
        step->motors.pa[d] = 0.0;
        for (int j = 0; j < ER_STAGES; j++)
            step->motors.pa[d] += er_gauss_end_acceleration[j] * step->motor_acceleration[d][j];
        step->motors.angle[d] = w->end.q[motor->joint][0] + step->motors.p[d];
        step->motors.rate[d] = w->end.qd[motor->joint][0] + step->motors.pv[d];
        step->motors.acceleration[d] = w->end.qdd[motor->joint][0] + step->motors.pa[d];
        work->end_error[d] =
            er_gear_error_at(r->system->robot, motor->joint, step->motors.angle[d]).value;
        step->motors.integral[d] = work->start_integral[d];
        rate_error = er_servo_rate_error(motor, step->motors.p[d], step->motors.pv[d],
                                 step->motors.rate[d] - step->motors.pv[d]);
        if (r->system->drive == ER_SERVO)
            end_servo(r, state, step, d, rate_error);
        work->stage_p[d][0] = step->motors.p[d];
        work->stage_pv[d][0] = step->motors.pv[d];
        work->rate_error[d][0] = rate_error;
        work->integral[d][0] = step->motors.integral[d];
    }
}
