/* The collocation equations of a step: the laws in it, their residuals, Newton's method. */
#include "newton_iteration.h"

#include <math.h>
#include <string.h>

#include "motor_step.h"
#include "newton_matrix.h"
#include "stage.h"

/* One pass is enough where the last rate of convergence, enlarged by the first number, says so; each
 * step that does so enlarges the rate by the second, so that it is measured again before long. */
#define RATE_SAFETY 10.0
#define RATE_AGEING 1.5
#define SMALLEST_RATE 1e-6

enum { MOST = ER_MAX_ANGLES };

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
static void take_off_balancer(const er_run *r, const er_balancer *balancer, const er_nodes *nodes, int states,
                              er_lanes *residual)
{
    int k = balancer->coordinate, i = r->system->robot->elastic_joint[k];
    for (int l = 0; l < states; l++)
        residual[k][l] -= er_balance_at(balancer, nodes->q[i][l] + r->work->x[k][l]).torque;
}

/* Residuals [N m] of chain and gears at the nodes from w->x, w->v and the accelerations. */
static void find_residual(const er_run *r, const er_nodes *nodes, const er_lanes *acceleration, const step_laws *laws,
                          int states, er_lanes *residual)
{
    const er_system *system = r->system;
    const er_robot *robot = system->robot;
    er_workspace *w = r->work;
    const er_lanes *x = (const er_lanes *)w->x, *v = (const er_lanes *)w->v;
    er_stage_motion(r, nodes, acceleration);
    if (system->anchored)
        er_stage_gap(r, nodes, states);
    if (laws->touching)
        er_stage_contact(r, nodes, states);
    r->means->kernel.loads(robot, &w->motion, states, system->parameters->gravity,
                           system->loaded ? system->load.wrench : NULL,
                           er_stage_pull(r, nodes, states, laws->touching), residual);
    for (int b = 0; b < robot->balancers; b++)
        take_off_balancer(r, &robot->balancer[b], nodes, states, residual);
    if (r->motors > 0) {
        r->means->kernel.motor_wind_up(robot, r->motors, nodes, states, x, v, (const er_lanes *)residual, &w->motors);
        x = (const er_lanes *)w->motors.wind_up;
        v = (const er_lanes *)w->motors.wind_up_rate;
    }
    r->means->kernel.carry(r->m, states, laws->slope, laws->zero, system->gears->damping, x, v, residual);
    for (int b = 0; b < laws->bent; b++) {
        int k = laws->which[b];
        for (int l = 0; l < states; l++)
            residual[k][l] += er_gear_torque(system->gears, k, laws->region[b], x[k][l]);
    }
    for (int k = 0; robot->elements > 0 && k < r->m; k++)
        for (int l = 0; l < states; l++)
            residual[k][l] += laws->held[k] + laws->stuck[k] * x[k][l];
}

static void fill_motor_residual(const er_run *r, const er_nodes *nodes, const er_lanes *acceleration)
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
    double defect[MOST], motor_error = 0.0;
    kernel->spread(r->m, step->x, w->x);
    kernel->spread(r->m, step->v, w->v);
    kernel->spread(r->m, step->a, acceleration);
    find_residual(r, &w->end, (const er_lanes *)acceleration, laws, 1, w->residual);
    for (int k = 0; k < r->m; k++)
        defect[k] = w->residual[k][0];
    if (r->motors > 0) {
        kernel->spread(r->motors, step->motors.pa, of_motors);
        fill_motor_residual(r, &w->end, (const er_lanes *)of_motors);
        motor_error = er_motors_defect(r, defect);
    }
    return step->length * step->length * fmax(kernel->filter(r->m, w->inverse, defect), motor_error);
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
    er_drive_step(r, state->time, h);
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
        find_residual(r, &w->stages, (const er_lanes *)step->acceleration, &laws, ER_STAGES, w->residual);
        if (r->motors > 0) {
            fill_motor_residual(r, &w->stages, (const er_lanes *)step->motor_acceleration);
            kernel->motor_before(r->system->robot, r->motors, (const er_lanes *)step->acceleration, w->residual,
                                 &w->motors);
        }
        size = kernel->improve(r->m, w->inverse, (const er_lanes *)w->residual, step->acceleration);
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
        er_step_depths(r, state, &from, step);
    if (r->motors > 0)
        er_motors_end(r, state, step);
    step->error = estimate_error(r, &laws, step);
    er_motors_wind_up(r, step);
    return step->error < INFINITY;
}
