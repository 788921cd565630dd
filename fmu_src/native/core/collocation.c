#include "step.h"

#include <math.h>
#include <string.h>

#include "balancer.h"
#include "transmission.h"

/* One pass is enough where the last rate of convergence, enlarged by the first number, says so; each
 * step that does so enlarges the rate by the second, so that it is measured again before long. */
#define RATE_SAFETY 10.0
#define RATE_AGEING 1.5
#define SMALLEST_RATE 1e-6

enum { MOST = ER_MAX_ANGLES };

/* What is there already is kept: drives often stand still. */
static void refer_to(int joints, const er_nodes *end, er_reference *reference)
{
    for (int i = 0; i < joints; i++) {
        double q = end->q[i][0];
        bool same = q == reference->angle[i] &&
                    (reference->sine[i] != 0.0 || reference->cosine[i] != 0.0);
        if (same)
            continue;
        reference->angle[i] = q;
        reference->sine[i] = sin(q);
        reference->cosine[i] = cos(q);
    }
}

/* The chain goes with what the gears make of drives that follow their commands. */
static void transmit_nodes(const er_run *r, er_nodes *nodes)
{
    const er_robot *robot = r->system->robot;
    for (int i = 0; i < robot->joints; i++) {
        bool moves_itself = r->motors > 0 && robot->joint_motor[i] >= 0;
        if (!er_has_gear_error(robot, i) || moves_itself)
            continue;
        for (int l = 0; l < ER_LANES; l++)
            er_transmit(robot, i, &nodes->q[i][l], &nodes->qd[i][l], &nodes->qdd[i][l]);
    }
}

/* Commands at the times of nodes. */
static void command_nodes(const er_run *r, const er_lanes time, er_nodes *nodes)
{
    const er_system *system = r->system;
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS];
    for (int l = 0; l < ER_LANES; l++)
        nodes->elapsed[l] = time[l] - system->start;
    if (system->drives->trajectory == NULL) {
        r->means->kernel.drive(system->robot->joints, system->drives->powers, nodes);
        return;
    }
    for (int l = 0; l < ER_LANES; l++) {
        if (l == 0 || time[l] != time[l - 1])
            er_drives_at(system->drives, time[l], q, qd, qdd);
        for (int i = 0; i < system->robot->joints; i++) {
            nodes->q[i][l] = q[i];
            nodes->qd[i][l] = qd[i];
            nodes->qdd[i][l] = qdd[i];
        }
    }
}

/* Drives at the times of nodes. */
static void drive_nodes(const er_run *r, const er_lanes time, er_nodes *nodes)
{
    command_nodes(r, time, nodes);
    if (r->system->robot->errors > 0)
        transmit_nodes(r, nodes);
}

/* Drives at the stages and the end of a step, and the sines that their changes are counted from. */
static void drive_step(const er_run *r, double time, double h)
{
    er_workspace *w = r->work;
    er_lanes stages, end;
    for (int l = 0; l < ER_LANES; l++) {
        stages[l] = time + h * er_gauss_node[l];
        end[l] = time + h;
    }
    drive_nodes(r, stages, &w->stages);
    drive_nodes(r, end, &w->end);
    refer_to(r->system->robot->joints, &w->end, &w->reference);
}

void er_stage_motion(const er_run *r, const er_nodes *nodes, const er_lanes *acceleration)
{
    er_workspace *w = r->work;
    r->means->kernel.move(r->system->robot, nodes, &w->reference, (const er_lanes *)w->x,
                          (const er_lanes *)w->v, acceleration, &w->motion);
}

void er_stage_gap(const er_run *r, const er_nodes *nodes, int states)
{
    er_workspace *w = r->work;
    const er_anchor *anchor = &r->system->load.anchor;
    r->means->kernel.reach(r->system->robot, &w->motion, states, w->gap);
    for (int c = 0; c < 3; c++)
        for (int l = 0; l < states; l++)
            w->gap[c][l] = anchor->position[c] + nodes->elapsed[l] * anchor->velocity[c] -
                           w->gap[c][l];
}

/* Angles and rates of the chain at one of the nodes. */
static void find_angles(const er_run *r, const er_nodes *nodes, int l, double *theta, double *rate)
{
    const er_robot *robot = r->system->robot;
    const er_workspace *w = r->work;
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], x[MOST], v[MOST];
    for (int i = 0; i < robot->joints; i++) {
        q[i] = nodes->q[i][l];
        qd[i] = nodes->qd[i][l];
    }
    for (int k = 0; k < r->m; k++) {
        x[k] = w->x[k][l];
        v[k] = w->v[k][l];
    }
    er_angles(robot, q, x, theta);
    er_angles(robot, qd, v, rate);
}

void er_stage_contact(const er_run *r, const er_nodes *nodes, int states)
{
    double theta[MOST], rate[MOST];
    for (int l = 0; l < states; l++) {
        find_angles(r, nodes, l, theta, rate);
        er_contact_move(r->system->robot, &r->system->load, nodes->elapsed[l], theta, rate,
                        &r->work->contact[l]);
    }
}

const er_lanes *er_stage_pull(const er_run *r, const er_nodes *nodes, int states, bool touching)
{
    er_workspace *w = r->work;
    const er_load *load = &r->system->load;
    if (!r->system->anchored && !r->system->changing && !touching)
        return NULL;
    for (int l = 0; l < states; l++) {
        double pull[3] = {0.0, 0.0, 0.0};
        if (r->system->anchored) {
            const double gap[3] = {w->gap[0][l], w->gap[1][l], w->gap[2][l]};
            er_anchor_times(load->anchor.stiffness, gap, pull);
        }
        for (int k = 0; k < 6; k++)
            w->pull[k][l] = nodes->elapsed[l] * load->rate[k] + (k < 3 ? pull[k] : 0.0) +
                            (touching ? w->contact[l].wrench[k] : 0.0);
    }
    return (const er_lanes *)w->pull;
}

/* The laws that coordinates obey through a step: slope (x - zero), to which curved flanks and elements of
 * hysteresis are added. */
typedef struct {
    double slope[MOST], zero[MOST]; /* [N m/rad, rad] */
    double held[MOST], stuck[MOST]; /* held + stuck x, of the elements [N m, N m/rad] */
    int bent, which[MOST], region[MOST]; /* coordinates on a curved flank, and it */
    bool touching;                  /* the contact presses */
} step_laws;

static void find_laws(const er_run *r, const er_state *state, step_laws *laws)
{
    const er_gears *gears = r->system->gears;
    laws->touching = r->system->contacting && state->touching == 1;
    laws->bent = 0;
    for (int k = 0; k < r->m; k++) {
        er_branch branch = er_gear_branch(gears, k, state->region[k]);
        laws->slope[k] = branch.slope;
        laws->zero[k] = branch.zero;
        if (!branch.straight) {
            laws->region[laws->bent] = state->region[k];
            laws->which[laws->bent++] = k;
        }
    }
    if (r->system->robot->elements > 0) {
        memset(laws->stuck, 0, sizeof laws->stuck);
        er_stops_stiffness(r->system->robot, gears->slip_torque, &state->stops, laws->stuck);
        for (int k = 0; k < r->m; k++)
            laws->held[k] = er_elements_torque(r->system->robot, k, gears->slip_torque[k], state->stops.elongation) -
                            laws->stuck[k] * state->x[k];
    }
}

/* Takes a balancer's torque off what its gear carries. */
static void balance(const er_run *r, const er_balancer *balancer, const er_nodes *nodes, int states)
{
    er_workspace *w = r->work;
    int k = balancer->coordinate, i = r->system->robot->elastic_joint[k];
    for (int l = 0; l < states; l++)
        w->residual[k][l] -= er_balance_at(balancer, nodes->q[i][l] + w->x[k][l]).torque;
}

/* Residuals at the nodes from w->x, w->v and the accelerations, into w->residual [N m]; where motors move, w->x and
 * w->v are wind-ups from then on. */
static void find_residual(const er_run *r, const er_nodes *nodes, const er_lanes *acceleration,
                          const step_laws *laws, int states)
{
    const er_system *system = r->system;
    const er_robot *robot = system->robot;
    er_workspace *w = r->work;
    er_stage_motion(r, nodes, acceleration);
    if (system->anchored)
        er_stage_gap(r, nodes, states);
    if (laws->touching)
        er_stage_contact(r, nodes, states);
    r->means->kernel.loads(robot, &w->motion, states, system->parameters->gravity,
                           system->loaded ? system->load.wrench : NULL,
                           er_stage_pull(r, nodes, states, laws->touching), w->residual);
    for (int b = 0; b < robot->balancers; b++)
        balance(r, &robot->balancer[b], nodes, states);
    if (r->motors > 0)
        r->means->kernel.motor_wind_up(robot, r->motors, nodes, states, w->x, w->v, (const er_lanes *)w->residual,
                                       &w->motors);
    r->means->kernel.carry(r->m, states, laws->slope, laws->zero, system->gears->damping,
                           (const er_lanes *)w->x, (const er_lanes *)w->v, w->residual);
    for (int b = 0; b < laws->bent; b++) {
        int k = laws->which[b];
        for (int l = 0; l < states; l++)
            w->residual[k][l] += er_gear_torque(system->gears, k, laws->region[b], w->x[k][l]);
    }
    for (int k = 0; robot->elements > 0 && k < r->m; k++)
        for (int l = 0; l < states; l++)
            w->residual[k][l] += laws->held[k] + laws->stuck[k] * w->x[k][l];
}

static void find_motor_residual(const er_run *r, const er_nodes *nodes, const er_lanes *acceleration)
{
    const er_system *system = r->system;
    r->means->kernel.motor_residual(system->robot, r->motors, system->gears->slip_torque + r->m,
                                    system->drive == ER_SERVO ? NULL : system->torque, nodes, acceleration,
                                    (const er_lanes *)r->work->residual, &r->work->motors);
}

static void place_end(const er_run *r, const double *x, const double *v, er_step *step)
{
    size_t bytes = (size_t)r->m * sizeof *step->x;
    memcpy(step->x, x, bytes);
    memcpy(step->v, v, bytes);
    r->means->kernel.finish(r->m, step->length, (const er_lanes *)step->acceleration, step->x, step->v);
    for (int k = 0; k < r->m; k++) {
        step->a[k] = 0.0;
        for (int j = 0; j < ER_STAGES; j++)
            step->a[k] += er_gauss_end_acceleration[j] * step->acceleration[k][j];
    }
}

/* The defect of the polynomial at the step's end, filtered by the matrix of an implicit step (as in
 * Hairer and Wanner 1996, sec. IV.8) and scaled to a length of x. */
static double estimate_error(const er_run *r, const step_laws *laws, const er_step *step)
{
    er_workspace *w = r->work;
    const er_kernel *kernel = &r->means->kernel;
    ER_ALIGNED er_lanes acceleration[MOST], of_motors[ER_MAX_JOINTS];
    double defect[MOST], own = 0.0;
    kernel->spread(r->m, step->x, w->x);
    kernel->spread(r->m, step->v, w->v);
    kernel->spread(r->m, step->a, acceleration);
    find_residual(r, &w->end, (const er_lanes *)acceleration, laws, 1);
    for (int k = 0; k < r->m; k++)
        defect[k] = w->residual[k][0];
    if (r->motors > 0) {
        kernel->spread(r->motors, step->motors.pa, of_motors);
        find_motor_residual(r, &w->end, (const er_lanes *)of_motors);
        own = er_motors_defect(r, defect);
    }
    return step->length * step->length * fmax(kernel->filter(r->m, w->inverse, defect), own);
}

/* Depths of the contact at nodes, from w->x. */
static void find_depth(const er_run *r, const er_nodes *nodes, int states, double *depth)
{
    const er_robot *robot = r->system->robot;
    const er_load *load = &r->system->load;
    double theta[MOST], rate[MOST], place[3], rotation[9], gap[3];
    for (int l = 0; l < states; l++) {
        find_angles(r, nodes, l, theta, rate);
        er_place_tool(robot, theta, place, rotation);
        er_anchor_gap(&load->anchor, nodes->elapsed[l], place, gap);
        depth[l] = er_contact_touch(&load->contact, gap).depth;
    }
}

er_start er_chain_start(const er_run *r, const er_state *state)
{
    if (r->motors == 0)
        return (er_start){state->x, state->v};
    er_motors_begin(r, state);
    return (er_start){r->work->motors.x, r->work->motors.v};
}

/* Counts the end of a step from the motors. */
static void wind_up_end(const er_run *r, er_step *step)
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

double er_contact_depth(const er_run *r, const er_state *state)
{
    er_workspace *w = r->work;
    er_lanes time;
    double depth;
    for (int l = 0; l < ER_LANES; l++)
        time[l] = state->time;
    drive_nodes(r, time, &w->start);
    r->means->kernel.spread(r->m, er_chain_start(r, state).x, w->x);
    find_depth(r, &w->start, 1, &depth);
    return depth;
}

double er_end_approach(const er_run *r, const er_step *step)
{
    er_workspace *w = r->work;
    r->means->kernel.spread(r->m, step->x, w->x);
    r->means->kernel.spread(r->m, step->v, w->v);
    for (int d = 0; d < r->motors; d++) { /* from wind-ups to the chain */
        const er_motor *motor = &r->system->robot->motor[d];
        er_gear_error error = er_gear_error_at(r->system->robot, motor->joint, step->motors.angle[d]);
        w->x[motor->coordinate][0] += step->motors.p[d] + error.value;
        w->v[motor->coordinate][0] += step->motors.pv[d] + error.slope * step->motors.rate[d];
    }
    er_stage_contact(r, &w->end, 1);
    return er_contact_approach(&w->contact[0].touch);
}

/* Depths of the contact along a solved step. */
static void find_depths(const er_run *r, const er_state *state, const er_start *from, er_step *step)
{
    er_workspace *w = r->work;
    const er_kernel *kernel = &r->means->kernel;
    step->depth[0] = er_contact_depth(r, state);
    kernel->stages(r->m, step->length, from->x, from->v, (const er_lanes *)step->acceleration, w->x,
                   w->v);
    find_depth(r, &w->stages, ER_STAGES, step->depth + 1);
    kernel->spread(r->m, step->x, w->x);
    find_depth(r, &w->end, 1, step->depth + ER_DEGREE);
}

bool er_solve_step(const er_run *r, const er_state *state, double h, double accuracy, er_step *step)
{
    er_workspace *w = r->work;
    const er_kernel *kernel = &r->means->kernel;
    /* An error of the acceleration shifts x by its h^2-fold at once, and by its h-fold times the
     * time scale of the motion later; the longest step stands for the latter. */
    double target = accuracy / (h * fmax(h, r->settings->longest_step)), last = 0.0;
    bool converged = false;
    step_laws laws;
    const er_start from = er_chain_start(r, state);
    step->length = h;
    drive_step(r, state->time, h);
    find_laws(r, state, &laws);
    if (laws.touching) {
        kernel->stages(r->m, h, from.x, from.v, (const er_lanes *)step->acceleration, w->x, w->v);
        er_stage_contact(r, &w->stages, ER_STAGES);
    }
    if (!er_linearise(r, state, h))
        return false;
    for (step->passes = 1; step->passes <= r->settings->most_passes && !converged; step->passes++) {
        double size, rate = RATE_SAFETY * state->rate;
        kernel->stages(r->m, h, from.x, from.v, (const er_lanes *)step->acceleration, w->x, w->v);
        if (r->motors > 0)
            kernel->motor_stages(r->system->robot, r->motors, h, &w->stages,
                                 (const er_lanes *)step->motor_acceleration, &w->motors);
        find_residual(r, &w->stages, (const er_lanes *)step->acceleration, &laws, ER_STAGES);
        if (r->motors > 0) {
            find_motor_residual(r, &w->stages, (const er_lanes *)step->motor_acceleration);
            kernel->motor_before(r->system->robot, r->motors, (const er_lanes *)step->acceleration, w->residual,
                                 &w->motors);
        }
        size = kernel->improve(r->m, w->inverse, (const er_lanes *)w->residual,
                               step->acceleration);
        if (r->motors > 0)
            size = sqrt(size * size + kernel->motor_after(r->system->robot, r->motors,
                                                          (const er_lanes *)step->acceleration, &w->motors,
                                                          step->motor_acceleration));
        if (step->passes == 1) {
            step->rate = RATE_AGEING * state->rate;
        } else {
            rate = last > 0.0 ? size / last : 0.0;
            step->rate = fmax(rate, SMALLEST_RATE);
        }
        /* Error left after a linearly converging iteration (Hairer and Wanner 1996, IV.8). */
        converged = size * rate <= target * (1.0 - rate) || (step->passes > 1 && size <= target);
        if (!converged && step->passes > 1 && !(rate < 1.0))
            return false;
        last = size;
    }
    if (!converged)
        return false;
    step->passes--;
    place_end(r, from.x, from.v, step);
    if (r->system->contacting)
        find_depths(r, state, &from, step);
    if (r->motors > 0)
        er_motors_end(r, state, step);
    step->error = estimate_error(r, &laws, step);
    wind_up_end(r, step);
    return step->error < INFINITY;
}
