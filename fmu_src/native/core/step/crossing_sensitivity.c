/* What the columns of sensitivities lack where a step ends at a change of law. */
#include "crossing_sensitivity.h"

#include <math.h>
#include <string.h>

#include "motor_step.h"
#include "stage.h"

/* Angles of the chain at the end of a step. */
static void find_chain_end(const er_run *r, const er_step *step, double *theta)
{
    const er_robot *robot = r->system->robot;
    double y[ER_MAX_ANGLES];
    memcpy(y, step->x, (size_t)r->m * sizeof *y);
    for (int d = 0; d < r->motors; d++)
        y[robot->motor[d].coordinate] += step->motors.p[d] + r->work->motors.end_error[d];
    er_angles(robot, r->work->reference.angle, y, theta); /* the drives at the step's end */
}

/* Turns torques on the elastic coordinates at the end of a step into their accelerations; false if the mass matrix is
 * singular, which is the columns' reason then. */
static bool accelerate_chain(er_sensitivity *s, const er_run *r, const er_step *step, double *torque)
{
    const er_robot *robot = r->system->robot;
    double theta[ER_MAX_ANGLES], mass[ER_MAX_ANGLES * ER_MAX_ANGLES];
    int pivot[ER_MAX_ANGLES];
    find_chain_end(r, step, theta);
    er_place_bodies(robot, theta, &r->work->placement);
    er_mass_matrix(robot, &r->work->placement, mass);
    if (!er_lu_factor(r->m, mass, pivot)) {
        s->reason = "the mass matrix is singular";
        return false;
    }
    er_lu_solve(r->m, mass, pivot, torque);
    return true;
}

/* Angle of a drive at the end of a step [rad]. */
static double drive_at_end(const er_run *r, const er_step *step, int joint)
{
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS];
    er_drives_at(r->system->drives, r->work->end.elapsed[0] + r->system->start, q, qd, qdd);
    for (int d = 0; d < r->motors; d++)
        q[r->system->robot->motor[d].joint] = step->motors.angle[d];
    return q[joint];
}

/* A contact begins as a gear passes its backlash: the step ends a little behind the plane and knows nothing of
 * the force N on the way there, a time d / d' long.  What is missing is
 *
 *     dx' += M^-1 J_c^T (F / d') dd,
 *
 * with the change dd of the depth.  Where it lifts off the step ends at the plane, and nothing is missing. */
void er_sensitivity_contact(er_sensitivity *s, const er_run *r, const er_state *state, const er_step *step,
                            const er_crossing *crossing)
{
    const er_robot *robot = r->system->robot;
    const er_contact_motion *motion = r->work->contact;
    int m = r->m;
    double response[ER_MAX_ANGLES], approach = er_end_approach(r, step);
    if (crossing->outward < 0 || !(approach > 0.0))
        return;
    for (int k = 0; k < m; k++)
        response[k] = er_dot(motion->lever[robot->elastic_angle[k]], motion->wrench) / approach;
    if (!accelerate_chain(s, r, step, response))
        return;
    for (int column = s->first; column < s->first + s->count; column++) {
        er_share share = er_share_of(s, robot, column, state->time - s->start);
        double still[ER_MAX_ANGLES] = {0.0}, drives[ER_MAX_JOINTS] = {0.0}, change[ER_MAX_ANGLES];
        er_touch along;
        if (share.joint >= 0)
            drives[share.joint] = share.q;
        for (int d = 0; d < r->motors; d++)
            drives[robot->motor[d].joint] = s->motors[column].angle[d];
        for (int i = 0; robot->errors > 0 && i < robot->joints; i++)
            drives[i] *= 1.0 + er_gear_error_at(robot, i, drive_at_end(r, step, i)).slope;
        er_angles(robot, drives, s->x[column], change);
        er_contact_place_along(robot, &r->system->load, motion, change, still, &share.load, &along);
        for (int k = 0; k < m; k++)
            s->v[column][k] += response[k] * along.depth;
    }
}

/* Friction that a gear's torque adds to that of its motor as it slips [N m]. */
static double load_friction(const er_run *r, const er_state *state, int d)
{
    const er_motor *motor = &r->system->robot->motor[d];
    int k = motor->coordinate;
    if (motor->load_friction == 0.0)
        return 0.0;
    return motor->load_friction * fabs(er_wind_up_torque(r, state, k, state->x[k], state->v[k]));
}

/* What elements that begin to slip had of changes of their elongations [N m]. */
static double find_released(const er_run *r, const er_state *state, const er_crossing *crossing,
                            const double *elongation)
{
    const er_robot *robot = r->system->robot;
    double sum = 0.0;
    int d = crossing->coordinate - r->m;
    for (int j = robot->first_element[crossing->coordinate]; j < robot->first_element[crossing->coordinate + 1]; j++)
        if (er_stops_slips_too(robot, &state->stops, j, crossing->element, crossing->outward))
            sum += er_element_stiffness(robot, r->system->gears->slip_torque, j) * elongation[j];
    if (d < 0)
        return sum;
    /* Of a motor's friction as much as Stribeck leaves, and what its gear's torque adds. */
    return er_stribeck_part(&robot->motor[d], state->motors.rate[d]) * sum +
           load_friction(r, state, d) / robot->motor[d].slip_angle * elongation[robot->elements + d];
}

/* The torque is continuous where a coordinate x_k passes the edge of its backlash, or where an element of its
 * hysteresis begins to slip, only its slope jumps. So x'' is the same under both laws there, a shift of the moment of
 * the passage changes x and x' to second order only, and the sensitivities are continuous.
 *
 * The step, however, ends a little beyond the edge and has kept the old law's slope on the way there. With the time t
 * since the edge and the jump J of the torque at x_k, what is missing is
 *
 *     dx' -= M^-1 e_k (J t / beyond) dx_k,    beyond = x_k' t - x_k'' t^2 / 2,
 *
 * dx_k that of the elongation for an element.  As it sticks again nothing jumps, and the place where it does is where
 * x_k does not move. */
static void pass_boundary(er_sensitivity *s, const er_run *r, const er_state *state, const er_step *step,
                          const er_crossing *crossing, double edge, double beyond, double jump)
{
    const er_system *system = r->system;
    int m = r->m, k = crossing->coordinate, motor = r->motors > 0 ? system->robot->motor_of[k] : -1;
    bool slips = crossing->at == ER_AT_SLIP, of_motor = slips && k >= m;
    double rate, bend, per_beyond, torque, winds = 1.0;
    double response[ER_MAX_ANGLES] = {0.0};
    rate = crossing->outward * (of_motor ? step->motors.rate[k - m] : step->v[k]);
    bend = crossing->outward * (of_motor ? step->motors.acceleration[k - m] : step->a[k]);
    per_beyond = 2.0 / (rate + sqrt(fmax(rate * rate - 2.0 * bend * beyond, 0.0)));
    if (!(per_beyond > 0.0 && per_beyond < INFINITY))
        return;
    torque = jump * per_beyond * crossing->outward;
    if (!of_motor) {
        response[k] = torque;
        if (!accelerate_chain(s, r, step, response))
            return;
    }
    if (motor >= 0)
        winds += er_gear_error_at(system->robot, system->robot->motor[motor].joint, step->motors.angle[motor]).slope;
    for (int column = s->first; column < s->first + s->count; column++) {
        bool moves = column == er_first_column(system->robot, ER_BY_BACKLASH) + k; /* the edge, with the backlash */
        double beyond_change, rotor = 0.0;
        if (slips)
            beyond_change = find_released(r, state, crossing, s->elongation[column]);
        else
            beyond_change = s->x[column][k] - (moves ? er_gear_per_backlash(system->gears, k, edge) : 0.0);
        if (motor >= 0) /* the gear turns it the other way, its own friction as a link */
            rotor = (of_motor ? -torque : winds * torque) * beyond_change / system->robot->motor[motor].inertia;
        for (int i = 0; i < m; i++)
            s->v[column][i] -= response[i] * beyond_change;
        if (motor >= 0) {
            s->motors[column].rate[motor] += rotor;
            s->v[column][system->robot->motor[motor].coordinate] -= winds * rotor;
        }
    }
}

void er_sensitivity_edge(er_sensitivity *s, const er_run *r, const er_state *state, const er_step *step,
                         const er_crossing *crossing)
{
    const er_gears *gears = r->system->gears;
    const int k = crossing->coordinate;
    double edge = copysign(er_gear_half_width(gears, k), crossing->boundary);
    double jump = er_gear_torque(gears, k, crossing->region, step->x[k]) -
                  er_gear_torque(gears, k, state->region[k], step->x[k]);
    pass_boundary(s, r, state, step, crossing, edge, crossing->outward * (step->x[k] - edge), jump);
}

void er_sensitivity_release(er_sensitivity *s, const er_run *r, const er_state *state, const er_step *step,
                            const er_crossing *crossing)
{
    double edge = crossing->outward * r->system->robot->element[crossing->element].angle;
    double beyond = crossing->outward * (state->stops.elongation[crossing->element] - edge);
    pass_boundary(s, r, state, step, crossing, edge, beyond, -crossing->outward * beyond); /* of 1 N m/rad */
}

/* The torque is continuous where it reaches its limit or leaves it, z' is not: what a column shifts that moment by, dt
 * = -da / a' of what is asked for, changes z by the difference of its rates.  The step ends a time t beyond, in which
 * the motor turned by the law before: dq' += k da t / J is missing, k 1 where the torque is left to the servo again, -1
 * where the limit holds it. */
void er_sensitivity_limit(er_sensitivity *s, const er_run *r, const er_state *state, const er_step *step,
                          const er_crossing *crossing)
{
    const int d = crossing->coordinate - r->m;
    const er_robot *robot = r->system->robot;
    const er_motor *motor = &robot->motor[d];
    const er_motor_end *end = &step->motors;
    const er_servo_course *course = &r->work->motors.course[d];
    const er_servo_law before = state->motors.law[d], after = er_servo_beyond(r, state, crossing);
    const int side = before.side != 0 ? before.side : after.side;
    double rate_error = course->rate_error[ER_DEGREE], turning = course->turning[ER_DEGREE];
    double growth = er_servo_growth(motor, before, rate_error, turning);
    double rate = motor->rate_gain * turning + growth, lost = growth - er_servo_growth(motor, after, rate_error, turning);
    double late = (course->demand[ER_DEGREE] - side * motor->torque_limit) / rate;
    double follows = (after.side == 0) - (before.side == 0);
    double winds = 1.0 + er_gear_error_at(robot, motor->joint, end->angle[d]).slope;
    if (rate == 0.0)
        return;
    for (int column = s->first; column < s->first + s->count; column++) {
        er_motor_change *change = &s->motors[column];
        er_drive_change at = er_column_command(s, r, d, column, state->time);
        double p = change->angle[d] - at.q, pv = change->rate[d] - at.qd;
        double demand = er_servo_demand(motor, er_servo_rate_error(motor, p, pv, at.qd), change->integral[d]);
        double rotor = follows * demand * late / motor->inertia;
        change->integral[d] -= lost * demand / rate;
        change->rate[d] += rotor;
        s->v[column][motor->coordinate] -= winds * rotor;
    }
}

void er_sensitivity_slip(er_sensitivity *s, int element)
{
    for (int column = s->first; column < s->first + s->count; column++)
        s->elongation[column][element] = 0.0;
}
