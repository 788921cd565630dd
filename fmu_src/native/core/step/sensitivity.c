#include "sensitivity.h"

#include <math.h>
#include <string.h>

#include "crossing_sensitivity.h"
#include "motor_step.h"
#include "stage.h"

/* Columns are solved to this part of their stage accelerations. */
#define ACCURACY 1e-11
/* Or, where hardly anything follows the input, to this part of what follows a torque of 1 N m, or of
 * the drive's own motion over a longest step: there rounding is all that is left. */
#define NEGLIGIBLE 1e-14
#define MAX_PASSES 40
/* Most columns are done by then, without asking what is negligible. */
#define USUAL_PASSES 3

void er_sensitivity_start(er_sensitivity *s, const er_robot *robot, er_cause first, er_cause last, double start)
{
    s->first = er_first_column(robot, first);
    s->count = er_first_column(robot, (er_cause)(last + 1)) - s->first;
    s->start = start;
    s->still = true;
    s->reason = NULL;
    s->accuracy = ACCURACY;
    s->passes = 0;
    memset(s->x[s->first], 0, (size_t)s->count * sizeof *s->x);
    memset(s->v[s->first], 0, (size_t)s->count * sizeof *s->v);
    if (er_all_elements(robot) > 0)
        memset(s->elongation[s->first], 0, (size_t)s->count * sizeof *s->elongation);
    if (robot->motors > 0)
        memset(&s->motors[s->first], 0, (size_t)s->count * sizeof *s->motors);
}

/* What balancers, and errors of drives that follow their commands, need of the stages; w->x is of the chain. */
static void prepare_gears(er_sensitivity *s, const er_run *r, const er_state *state, double h)
{
    const er_robot *robot = r->system->robot;
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS];
    for (int l = 0; l < ER_STAGES; l++) {
        for (int b = 0; b < robot->balancers; b++) {
            int k = robot->balancer[b].coordinate;
            double angle = r->work->stages.q[robot->elastic_joint[k]][l] + r->work->x[k][l];
            s->balance[b][l] = er_balance_at(&robot->balancer[b], angle).slope;
        }
        if (robot->errors == 0)
            continue;
        er_drives_at(r->system->drives, state->time + h * er_gauss_node[l], q, qd, qdd);
        for (int i = 0; i < robot->joints; i++)
            s->transmission[i][l] = er_transmission_at(robot, i, q[i], qd[i], qdd[i]);
        for (int d = 0; d < r->motors; d++)
            s->transmission[robot->motor[d].joint][l].error = (er_gear_error){0.0, 0.0, 0.0, 0.0};
    }
}

/* The motion at the stages of a solved step, and what the tangents need of it. */
static void prepare_step(er_sensitivity *s, const er_run *r, const er_state *state, const er_step *step)
{
    const er_system *system = r->system;
    er_workspace *w = r->work;
    const er_start from = er_chain_start(r, state);
    s->response = 0.0;
    r->means->kernel.stages(r->m, step->length, from.x, from.v, (const er_lanes *)step->acceleration, w->x, w->v);
    if (r->motors > 0)
        r->means->kernel.motor_stages(r->system->robot, r->motors, step->length, &w->stages,
                                      (const er_lanes *)step->motor_acceleration, &w->motors);
    er_stage_motion(r, &w->stages, (const er_lanes *)step->acceleration);
    if (system->anchored || (s->first + s->count > er_first_column(system->robot, ER_BY_SPRING) &&
                             s->first < er_first_column(system->robot, ER_BY_CONTACT)))
        er_stage_gap(r, &w->stages, ER_STAGES);
    s->touching = system->contacting && state->touching == 1;
    if (s->touching)
        er_stage_contact(r, &w->stages, ER_STAGES);
    r->means->kernel.link(system->robot, &w->motion, system->parameters->gravity,
                          system->loaded ? system->load.wrench : NULL,
                          er_stage_pull(r, &w->stages, ER_STAGES, s->touching), &s->links);
    if (system->robot->balancers > 0 || system->robot->errors > 0)
        prepare_gears(s, r, state, step->length);
    if (r->motors > 0)
        r->means->kernel.motor_wind_up(r->system->robot, r->motors, &w->stages, ER_STAGES, (const er_lanes *)w->x,
                                       (const er_lanes *)w->v, (const er_lanes *)w->residual, &w->motors);
    memset(s->stuck, 0, sizeof s->stuck);
    er_stops_stiffness(system->robot, system->gears->slip_torque, &state->stops, s->stuck);
    for (int k = 0; k < r->m; k++)
        for (int l = 0; l < ER_STAGES; l++)
            s->slope[k][l] = er_gear_slope(system->gears, k, state->region[k], er_wind_up(r)[k][l]) + s->stuck[k];
}

/* Derivative of the contact's wrench at a stage along a change of the motion and of the load. */
static void follow_contact(const er_run *r, const er_direction *direction, const er_load *change, int l,
                           double wrench[6])
{
    const er_robot *robot = r->system->robot;
    double theta[ER_MAX_ANGLES], rate[ER_MAX_ANGLES];
    for (int i = 0; i < robot->angles; i++) {
        theta[i] = direction->angle[i][l];
        rate[i] = direction->rate[i][l];
    }
    er_contact_wrench_along(robot, &r->system->load, &r->work->contact[l], theta, rate, change, wrench);
}

/* Derivative of the pull along a change of the motion and of a column's input, into `pull`; NULL where
 * there is none.  The wrench's share does not depend on the time: it is there once for all stages. */
static const er_lanes *find_pull(const er_sensitivity *s, const er_run *r, er_cause cause,
                                 const er_share share[], const er_direction *direction, er_pull pull)
{
    const er_system *system = r->system;
    const er_workspace *w = r->work;
    ER_ALIGNED er_vector shift;
    if (!system->anchored && !s->touching && cause != ER_BY_SPRING && cause != ER_BY_RATE)
        return NULL;
    r->means->kernel.shift(system->robot, &s->links, direction, shift);
    for (int l = 0; l < ER_STAGES; l++) {
        const double gap[3] = {w->gap[0][l], w->gap[1][l], w->gap[2][l]};
        const double shift_of_tcp[3] = {shift[0][l], shift[1][l], shift[2][l]};
        const er_load *load = &share[cause == ER_BY_WRENCH ? 0 : l].load;
        double force[3], contact[6] = {0.0};
        er_anchor_along(&system->load.anchor, gap, &load->anchor, shift_of_tcp, force);
        if (s->touching)
            follow_contact(r, direction, load, l, contact);
        for (int k = 0; k < 6; k++)
            pull[k][l] = (k < 3 ? force[k] : 0.0) + contact[k] +
                         (cause < ER_BY_RATE ? 0.0 : load->wrench[k]);
    }
    return (const er_lanes *)pull;
}

/* Tangent of the stage residuals along a column of x and x' at the start of a step of length h, its stage
 * accelerations and its input [N m]. */
static void build_tangent(const er_sensitivity *s, const er_run *r, const er_state *state, double h, int column,
                         er_cause cause, const er_share share[], const er_lanes *acceleration, er_motor_column *motors,
                         er_lanes *tangent)
{
    const er_robot *robot = r->system->robot;
    const er_kernel *kernel = &r->means->kernel;
    er_direction direction;
    ER_ALIGNED er_pull pull;
    kernel->direct(robot, h, r->motors > 0 ? motors->x : s->x[column], r->motors > 0 ? motors->v : s->v[column],
                   acceleration, s->slope, r->system->gears->damping, &direction, tangent);
    if (r->motors > 0)
        er_motor_column_gears(s, r, state, h, column, motors, tangent);
    for (int l = 0; share[0].joint >= 0 && l < ER_STAGES; l++) {
        int i = robot->drive_angle[share[0].joint];
        double q = share[l].q, qd = share[l].qd, qdd = share[l].qdd;
        if (robot->errors > 0)
            er_transmit_along(&s->transmission[share[0].joint][l], &q, &qd, &qdd);
        direction.angle[i][l] += q;
        direction.rate[i][l] += qd;
        direction.acceleration[i][l] += qdd;
    }
    for (int b = 0; b < robot->balancers; b++) {
        int k = robot->balancer[b].coordinate;
        for (int l = 0; l < ER_STAGES; l++)
            tangent[k][l] -= s->balance[b][l] * direction.angle[robot->elastic_angle[k]][l];
    }
    kernel->tangent(robot, &s->links, &direction, cause == ER_BY_WRENCH ? share[0].load.wrench : NULL,
                    find_pull(s, r, cause, share, &direction, pull), tangent);
}

static double unit_response(er_sensitivity *s, const er_run *r)
{
    double unit[ER_MAX_ANGLES];
    for (int k = 0; k < r->m; k++)
        unit[k] = 1.0;
    if (s->response == 0.0)
        s->response = r->means->kernel.filter(r->m, r->work->inverse, unit);
    return s->response;
}

/* Stage accelerations that count as none in a column [rad/s^2 per its unit]. */
static double negligible_size(er_sensitivity *s, const er_run *r, er_cause cause, const er_share *share)
{
    /* What a command changes of a motor's way is the difference of two such changes, under its stiff friction. */
    double time = r->motors > 0 ? r->settings->first_step : r->settings->longest_step, force = 1.0;
    if (share->joint >= 0)
        return NEGLIGIBLE * (fabs(share->q) / (time * time) + fabs(share->qd) / time + fabs(share->qdd));
    if (cause == ER_BY_ANCHOR || cause == ER_BY_ANCHOR_VELOCITY || cause == ER_BY_SPRING) {
        const double last[3] = {r->work->gap[0][ER_STAGES - 1], r->work->gap[1][ER_STAGES - 1],
                                r->work->gap[2][ER_STAGES - 1]};
        const double still[3] = {0.0, 0.0, 0.0};
        double pull[3];
        er_anchor_along(&r->system->load.anchor, last, &share->load.anchor, still, pull);
        force = sqrt(er_dot(pull, pull));
    }
    return force * NEGLIGIBLE * unit_response(s, r);
}

/* What a parameter itself changes in the residuals of the stages [N m]. */
static void find_parameter(const er_run *r, const er_state *state, int column, er_cause cause, er_lanes *load)
{
    const er_robot *robot = r->system->robot;
    const er_lanes *x = er_wind_up(r), *v = er_wind_up_rate(r);
    er_parameters change;
    er_motion still;
    double stuck[ER_MAX_ANGLES] = {0.0};
    memset(&change, 0, sizeof change);
    er_parameter_along(robot, column, 1.0, &change);
    memset(load, 0, (size_t)r->m * sizeof *load);
    if (cause == ER_BY_GRAVITY) {
        still = r->work->motion;
        memset(still.rate, 0, sizeof still.rate);
        memset(still.acceleration, 0, sizeof still.acceleration);
        r->means->kernel.loads(robot, &still, ER_STAGES, change.gravity, NULL, NULL, load);
        return;
    }
    er_stops_stiffness(robot, change.hysteresis, &state->stops, stuck);
    for (int k = 0; k < r->m; k++) {
        double held = er_elements_torque(robot, k, change.hysteresis[k], state->stops.elongation);
        for (int l = 0; l < ER_STAGES; l++)
            load[k][l] = change.damping[k] * v[k][l] +
                         er_gear_along(r->system->gears, k, state->region[k], x[k][l],
                                       change.stiffness[k], change.backlash[k]) +
                         held + stuck[k] * (x[k][l] - state->x[k]);
    }
}

/* What elongations at the step's start change in the gears' torques at the stages, and a parameter but gravity [N m];
 * false where that is nothing. */
static bool find_gear_load(const er_sensitivity *s, const er_run *r, const er_state *state, int column, er_cause cause,
                     er_lanes *load)
{
    const er_robot *robot = r->system->robot;
    bool is_any = cause > ER_BY_GRAVITY;
    if (!is_any && robot->elements == 0 && r->motors == 0)
        return false;
    if (is_any)
        find_parameter(r, state, column, cause, load);
    else
        memset(load, 0, (size_t)r->m * sizeof *load);
    for (int k = 0; robot->elements > 0 && k < r->m; k++) {
        double held = er_elements_torque(robot, k, r->system->gears->slip_torque[k], s->elongation[column]) -
                      s->stuck[k] * s->x[column][k];
        for (int l = 0; l < ER_STAGES; l++)
            load[k][l] += held;
    }
    return true;
}

static void add_load(int m, er_lanes *tangent, bool is_any, const er_lanes *load)
{
    for (int k = 0; is_any && k < m; k++)
        for (int l = 0; l < ER_STAGES; l++)
            tangent[k][l] += load[k][l];
}

/* Solves the linearised collocation equations
 *
 *     M_i da_i + D_i dv_i + K_i dx_i + dr_i/du = 0,
 *     dx_i = dx_0 + c_i h dv_0 + h^2 sum_j A2_ij da_j,    dv_i = dv_0 + h sum_j A1_ij da_j
 *
 * by the step's own matrices, which belong to its start, and refines with the exact tangent of the
 * residual at its stages.  False if that does not converge. */
static bool solve_column(er_sensitivity *s, const er_run *r, const er_state *state, double h, int column,
                  er_lanes *acceleration, er_motor_column *motors)
{
    const er_kernel *kernel = &r->means->kernel;
    ER_ALIGNED er_lanes tangent[ER_MAX_ANGLES], gear_load[ER_MAX_ANGLES], weight[ER_MAX_ANGLES];
    er_share share[ER_STAGES];
    int entry;
    er_cause cause = er_cause_of(r->system->robot, column, &entry);
    bool has_gear_load = find_gear_load(s, r, state, column, cause, gear_load);
    const bool has_weight = cause == ER_BY_GRAVITY;
    int shares = cause == ER_BY_WRENCH ? 1 : ER_STAGES;
    double last = 0.0, limit = 0.0;
    for (int l = 0; l < shares; l++)
        share[l] = er_share_of(s, r->system->robot, column, state->time + h * er_gauss_node[l] - s->start);
    if (has_weight)
        find_parameter(r, state, column, cause, weight);
    memset(acceleration, 0, (size_t)r->m * sizeof *acceleration);
    for (int pass = 1; pass <= MAX_PASSES; pass++) {
        double size, rate;
        if (pass == 1 && s->still && cause == ER_BY_WRENCH && r->motors == 0) {
            memset(tangent, 0, (size_t)r->m * sizeof *tangent);
            kernel->tangent(r->system->robot, &s->links, NULL, share[0].load.wrench, NULL, tangent);
        } else {
            build_tangent(s, r, state, h, column, cause, share, (const er_lanes *)acceleration, motors, tangent);
            add_load(r->m, tangent, has_gear_load, (const er_lanes *)gear_load);
            add_load(r->m, tangent, has_weight, (const er_lanes *)weight);
        }
        if (r->motors > 0) {
            er_motor_column_residual(s, r, state, h, column, motors, (const er_lanes *)gear_load);
            kernel->motor_before(r->system->robot, r->motors, (const er_lanes *)acceleration, tangent,
                                 &r->work->motors);
        }
        size = kernel->improve(r->m, r->work->inverse, (const er_lanes *)tangent, acceleration);
        if (r->motors > 0)
            size = sqrt(size * size + kernel->motor_after(r->system->robot, r->motors, (const er_lanes *)acceleration,
                                                          &r->work->motors, motors->acceleration));
        if (pass == 1) /* the length of the first solution is nearly that of the last */
            limit = s->accuracy * size;
        if (pass == USUAL_PASSES + 1)
            limit = fmax(limit, negligible_size(s, r, cause, &share[shares - 1]));
        rate = pass > 1 && last > 0.0 ? size / last : 1.0;
        s->passes = pass > s->passes ? pass : s->passes;
        /* What a linearly converging iteration leaves (Hairer and Wanner 1996, IV.8). */
        if (size <= limit || (rate < 1.0 && size * rate <= limit * (1.0 - rate)))
            return true;
        if (!(size < INFINITY))
            return false;
        last = size;
    }
    return false;
}

void er_sensitivity_follow(er_sensitivity *s, const er_run *r, const er_state *state, const er_step *step)
{
    const er_kernel *kernel = &r->means->kernel;
    ER_ALIGNED er_lanes acceleration[ER_MAX_ANGLES];
    const bool has_stops = er_all_elements(r->system->robot) > 0;
    double before[ER_MAX_ANGLES];
    er_motor_column motors;
    if (s->reason != NULL)
        return;
    prepare_step(s, r, state, step);
    for (int column = s->first; column < s->first + s->count; column++) {
        if (r->motors > 0)
            er_motor_column_begin(s, r, state, column, &motors);
        if (!solve_column(s, r, state, step->length, column, acceleration, &motors)) {
            s->reason = "the linearised step does not converge";
            return;
        }
        if (has_stops)
            memcpy(before, s->x[column], sizeof before);
        if (r->motors > 0) {
            memcpy(s->x[column], motors.x, sizeof motors.x);
            memcpy(s->v[column], motors.v, sizeof motors.v);
        }
        kernel->finish(r->m, step->length, (const er_lanes *)acceleration, s->x[column], s->v[column]);
        if (r->motors > 0)
            er_motor_column_end(s, r, state, step, column, &motors);
        if (has_stops)
            er_stops_follow(r->system->robot, &state->stops, before, s->x[column], s->elongation[column]);
    }
    s->still = false;
}
