/* The motors in a step of the chain: eliminated from its equations, solved beside it. */
#include "step.h"
#include "transmission.h"

#include <math.h>
#include <string.h>

void er_motors_begin(const er_run *r, const er_state *state)
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
        double wanted;
        step->motors.pa[d] = 0.0;
        for (int j = 0; j < ER_STAGES; j++)
            step->motors.pa[d] += er_gauss_end_acceleration[j] * step->motor_acceleration[d][j];
        step->motors.angle[d] = w->end.q[motor->joint][0] + step->motors.p[d];
        step->motors.rate[d] = w->end.qd[motor->joint][0] + step->motors.pv[d];
        step->motors.acceleration[d] = w->end.qdd[motor->joint][0] + step->motors.pa[d];
        work->end_error[d] =
            er_gear_error_at(r->system->robot, motor->joint, step->motors.angle[d]).value;
        step->motors.integral[d] = work->start_integral[d];
        wanted = er_servo_wanted(motor, step->motors.p[d], step->motors.pv[d],
                                 step->motors.rate[d] - step->motors.pv[d]);
        if (r->system->drive == ER_SERVO)
            er_servo_end(r, state, step, d, wanted);
        work->stage_p[d][0] = step->motors.p[d];
        work->stage_pv[d][0] = step->motors.pv[d];
        work->wanted[d][0] = wanted;
        work->integral[d][0] = step->motors.integral[d];
    }
}

er_start er_chain_start(const er_run *r, const er_state *state)
{
    if (r->motors == 0)
        return (er_start){state->x, state->v};
    er_motors_begin(r, state);
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

static void multiply(double a_re, double a_im, double b_re, double b_im, double *re, double *im)
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
            multiply(re, im, re, im, &re2, &im2);
            multiply(re, im, re2, im2, &re3, &im3);
            g_re = re * damping + re2 * at->slope[k];
            g_im = im * damping + im2 * at->slope[k];
            a_re = motor->inertia + re * slopes.damping + re2 * slopes.stiffness + re3 * slopes.jerk + both * g_re;
            a_im = im * slopes.damping + im2 * slopes.stiffness + im3 * slopes.jerk + both * g_im;
            size = a_re * a_re + a_im * a_im;
            work->gear[d][p] = slopes.feels * g_re, work->gear[d][ER_PAIRS + p] = slopes.feels * g_im;
            work->yields[d][p] = a_re / size, work->yields[d][ER_PAIRS + p] = -a_im / size;
            multiply(g_re, g_im, slopes.winds * a_re / size, -slopes.winds * a_im / size, &work->share[d][p],
                     &work->share[d][ER_PAIRS + p]);
            multiply(g_re, g_im, work->share[d][p], work->share[d][ER_PAIRS + p], &lost_re, &lost_im);
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
        double own = work->residual[d][0];
        defect[r->system->robot->motor[d].coordinate] += work->share[d][0] * own;
        largest = fmax(largest, fabs(own) * hypot(work->yields[d][0], work->yields[d][ER_PAIRS]));
    }
    return largest;
}
