#include "stepper.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A coordinate changes its law this part of the tolerance beyond the boundary. */
#define SLACK 1e-2
/* A step that ends on a boundary may miss it by this part of the slack. */
#define LANDING 0.1
/* In landing, Newton's method may leave this part of the miss. */
#define LANDING_ITERATION 0.1
/* Shortest step relative to the longest, before the integration is given up. */
#define SHORTEST 1e-9
/* So is one that takes more steps than these and those for each of the longest in it. */
#define MOST_STEPS 5000
#define MOST_STEPS_PER_LONGEST 200
/* The matrices of a step serve steps that differ by this ratio. */
#define SAME_LENGTH 0.02
/* A step may exceed the proposed length by this ratio where that takes it to its target. */
#define STRETCH 1.05
#define MAX_PASSES 8
/* One pass is enough where the last rate of convergence, enlarged by the first number, says so; each
 * step that does so enlarges the rate by the second, so that it is measured again before long. */
#define RATE_SAFETY 10.0
#define RATE_AGEING 1.5
#define SMALLEST_RATE 1e-6
/* A step that takes more passes than this has its matrices rebuilt for the next. */
#define USUAL_PASSES 2
#define MAX_LANDINGS 20
/* The error estimate of a step of length h falls as h^6: h^2 times the defect, of order 4. */
#define ERROR_EXPONENT (1.0 / 6.0)
/* A step's length may grow by this ratio at once; a gain below the other is not worth new matrices. */
#define FASTEST_GROWTH 3.0
#define SMALLEST_GROWTH 1.2
#define SAFETY 0.9

enum { MOST = ER_MAX_ANGLES };

/* The parts of an integration that its functions share. */
typedef struct {
    const er_system *system;
    const er_settings *settings;
    er_workspace *work;
    int m;
} run;

void er_state_start(er_state *state, const er_robot *robot, const er_curve *curve,
                    const er_settings *settings, double time)
{
    state->time = time;
    state->step = settings->first;
    state->predictor_step = 0.0;
    state->rate = 1.0;
    memset(state->predictor, 0, sizeof state->predictor);
    for (int k = 0; k < robot->elastics; k++)
        state->region[k] = er_curve_region(curve, k, state->x[k]);
}

/* Drives at the nodes and the end of a step, and the sines that their changes are counted from. */
static void drive_step(const run *r, double time, double h)
{
    const er_robot *robot = r->system->robot;
    er_workspace *w = r->work;
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS];
    for (int l = 0; l < ER_STAGES; l++) {
        er_drives_at(&r->system->drives, time + h * er_gauss_node[l], q, qd, qdd);
        for (int i = 0; i < robot->joints; i++) {
            w->stages.q[i][l] = q[i];
            w->stages.qd[i][l] = qd[i];
            w->stages.qdd[i][l] = qdd[i];
        }
    }
    er_drives_at(&r->system->drives, time + h, q, qd, qdd);
    for (int i = 0; i < robot->joints; i++) {
        for (int l = 0; l < ER_LANES; l++) {
            w->end.q[i][l] = q[i];
            w->end.qd[i][l] = qd[i];
            w->end.qdd[i][l] = qdd[i];
        }
        w->reference[i] = q[i];
    }
    for (int i = 0; i < robot->angles; i++) {
        int drive = robot->rotation[i].drive;
        w->reference_sine[i] = drive < 0 ? 0.0 : sin(q[drive]);
        w->reference_cosine[i] = drive < 0 ? 1.0 : cos(q[drive]);
    }
}

/* Residuals at the nodes from w->x, w->v and the accelerations, into w->residual [N m]. */
static void find_residual(const run *r, const er_nodes *nodes, const er_lanes *acceleration,
                          const int *region, int states)
{
    const er_system *system = r->system;
    const er_robot *robot = system->robot;
    er_workspace *w = r->work;
    size_t lanes = (size_t)robot->angles * sizeof(er_lanes);
    memset(w->change, 0, lanes);
    memset(w->motion.rate, 0, lanes);
    memset(w->motion.acceleration, 0, lanes);
    for (int d = 0; d < robot->joints; d++) {
        int i = robot->drive_angle[d];
        for (int l = 0; l < ER_LANES; l++) {
            w->change[i][l] = nodes->q[d][l] - w->reference[d];
            w->motion.rate[i][l] = nodes->qd[d][l];
            w->motion.acceleration[i][l] = nodes->qdd[d][l];
        }
    }
    for (int k = 0; k < r->m; k++) {
        int i = robot->elastic_angle[k];
        for (int l = 0; l < ER_LANES; l++) {
            w->change[i][l] += w->x[k][l];
            w->motion.rate[i][l] += w->v[k][l];
            w->motion.acceleration[i][l] += acceleration[k][l];
        }
    }
    r->settings->kernel.turn(robot->angles, w->reference_sine, w->reference_cosine,
                             (const er_lanes *)w->change, &w->motion);
    r->settings->kernel.loads(robot, &w->motion, states, system->parameters->gravity,
                              system->loaded ? system->wrench : NULL, w->residual);
    for (int k = 0; k < r->m; k++)
        for (int l = 0; l < states; l++)
            w->residual[k][l] += er_curve_torque(system->curve, k, region[k], w->x[k][l]) +
                                 system->parameters->damping[k] * w->v[k][l];
}

static void place_end(const run *r, const er_state *state, er_step *step)
{
    double h = step->length;
    for (int k = 0; k < r->m; k++) {
        double rate = 0.0, position = 0.0, acceleration = 0.0;
        for (int j = 0; j < ER_STAGES; j++) {
            rate += er_gauss_end_rate[j] * step->acceleration[k][j];
            position += er_gauss_end_position[j] * step->acceleration[k][j];
            acceleration += er_gauss_end_acceleration[j] * step->acceleration[k][j];
        }
        step->x[k] = state->x[k] + h * (state->v[k] + h * position);
        step->v[k] = state->v[k] + h * rate;
        step->a[k] = acceleration;
    }
}

static void find_mass(const run *r, const double *x)
{
    const er_robot *robot = r->system->robot;
    double q[ER_MAX_JOINTS], theta[MOST];
    for (int i = 0; i < robot->joints; i++)
        q[i] = r->work->stages.q[i][ER_STAGES / 2];
    er_angles(robot, q, x, theta);
    er_place_bodies(robot, theta, &r->work->placement);
    er_mass_matrix(robot, &r->work->placement, r->work->mass);
    r->work->has_mass = true;
}

/* Factors of M + l h D + (l h)^2 K for the eigenvalues l of A1.
 *
 * In the eigenvectors of A1 the stages of the Newton equations are independent of each other. */
static bool factorise(const run *r, const er_state *state, double h)
{
    er_workspace *w = r->work;
    int m = r->m;
    if (!w->has_mass)
        find_mass(r, state->x);
    for (int i = 0; i < m; i++)
        for (int j = 0; j <= i; j++) {
            double mass = w->mass[i * m + j];
            w->factors[i * m + j] = (er_complex_pair){{mass, mass}, {0.0, 0.0}};
        }
    for (int k = 0; k < m; k++) {
        double slope = er_curve_slope(r->system->curve, k, state->region[k], state->x[k]);
        double damping = r->system->parameters->damping[k];
        er_complex_pair *diagonal = &w->factors[k * m + k];
        for (int p = 0; p < ER_PAIRS; p++) {
            double re = h * er_gauss_eigen_re[p], im = h * er_gauss_eigen_im[p];
            diagonal->re[p] += re * damping + (re * re - im * im) * slope;
            diagonal->im[p] += im * damping + 2.0 * re * im * slope;
        }
    }
    w->matrix_step = h;
    return r->settings->kernel.factor(m, w->factors);
}

/* The defect of the polynomial at the step's end, filtered by the matrix of an implicit step (as in
 * Hairer and Wanner 1996, sec. IV.8) and scaled to a length of x. */
static double estimate_error(const run *r, const er_state *state, const er_step *step)
{
    er_workspace *w = r->work;
    ER_ALIGNED er_lanes acceleration[MOST];
    double defect[MOST];
    for (int k = 0; k < r->m; k++)
        for (int l = 0; l < ER_LANES; l++) {
            w->x[k][l] = step->x[k];
            w->v[k][l] = step->v[k];
            acceleration[k][l] = step->a[k];
        }
    find_residual(r, &w->end, (const er_lanes *)acceleration, state->region, 1);
    for (int k = 0; k < r->m; k++)
        defect[k] = w->residual[k][0];
    return step->length * step->length * r->settings->kernel.filter(r->m, w->factors, defect);
}

/* Solves the collocation equations of a step from the accelerations in it; false if that fails.
 * `accuracy` is the error that the iteration may leave in x [rad]. */
static bool solve(const run *r, const er_state *state, double h, double accuracy, er_step *step)
{
    er_workspace *w = r->work;
    const er_kernel *kernel = &r->settings->kernel;
    /* An error of the acceleration shifts x by its h^2-fold at once, and by its h-fold times the
     * time scale of the motion later; the longest step stands for the latter. */
    double target = accuracy / (h * fmax(h, r->settings->longest)), last = 0.0;
    bool converged = false;
    step->length = h;
    drive_step(r, state->time, h);
    if (!(fabs(w->matrix_step - h) <= SAME_LENGTH * h) && !factorise(r, state, h)) {
        w->matrix_step = 0.0;
        return false;
    }
    for (step->passes = 1; step->passes <= MAX_PASSES && !converged; step->passes++) {
        double size, rate = RATE_SAFETY * state->rate;
        kernel->stages(r->m, h, state->x, state->v, (const er_lanes *)step->acceleration, w->x,
                       w->v);
        find_residual(r, &w->stages, (const er_lanes *)step->acceleration, state->region,
                      ER_STAGES);
        size = kernel->improve(r->m, w->factors, (const er_lanes *)w->residual,
                               step->acceleration);
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
    place_end(r, state, step);
    step->error = estimate_error(r, state, step);
    return step->error < INFINITY;
}

/* Stage accelerations at other nodes of a step's polynomial. */
static void interpolate(int m, double start, double ratio, const er_lanes *known, er_lanes *out)
{
    double weight[ER_STAGES][ER_STAGES];
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

/* Stage accelerations to start from: the last step's polynomial, continued. */
static void guess(const run *r, const er_state *state, double h, er_step *step)
{
    if (state->predictor_step > 0.0)
        interpolate(r->m, 1.0, h / state->predictor_step, (const er_lanes *)state->predictor,
                    step->acceleration);
    else
        memset(step->acceleration, 0, (size_t)r->m * sizeof *step->acceleration);
}

/* Shortens a solved step until it ends on the boundary it crosses, in w->landed. */
static bool land(const run *r, const er_state *state, const er_step *step,
                 const er_crossing *crossing)
{
    er_step *landed = &r->work->landed;
    int k = crossing->coordinate;
    double h = crossing->fraction * step->length, from = step->length;
    double allowed = LANDING * er_crossing_slack(r->system->curve, k,
                                                 SLACK * r->settings->tolerance);
    memcpy(landed->acceleration, step->acceleration, sizeof landed->acceleration);
    for (int trial = 0; trial < MAX_LANDINGS; trial++) {
        double beyond, rate;
        interpolate(r->m, 0.0, h / from, (const er_lanes *)landed->acceleration,
                    landed->acceleration);
        if (!solve(r, state, h, LANDING_ITERATION * allowed, landed))
            return false;
        beyond = crossing->outward * (landed->x[k] - crossing->boundary);
        rate = crossing->outward * landed->v[k];
        if (fabs(beyond) <= allowed)
            return landed->error <= r->settings->tolerance;
        if (!(rate > 0.0))
            return false;
        from = h;
        h -= fmin(fmax(beyond / rate, -h), 0.5 * h);
    }
    return false;
}

static void take_end(const run *r, er_state *state, const er_step *step)
{
    memcpy(state->x, step->x, (size_t)r->m * sizeof *state->x);
    memcpy(state->v, step->v, (size_t)r->m * sizeof *state->v);
    state->predictor_step = step->length;
    state->rate = fmin(step->rate, 1.0);
}

static void take_crossing(const run *r, er_state *state, const er_step *step,
                          const er_crossing *crossing)
{
    take_end(r, state, step);
    state->time += step->length;
    state->region[crossing->coordinate] = crossing->region;
    state->step = fmin(r->settings->first, state->step);
    /* The acceleration is continuous across the boundary, its derivative is not. */
    for (int k = 0; k < r->m; k++)
        for (int l = 0; l < ER_STAGES; l++)
            state->predictor[k][l] = step->a[k];
    state->rate = 1.0;
    r->work->matrix_step = 0.0;
}

/* One step, at most to `end`. */
static bool take_step(const run *r, er_state *state, double end, er_failure *failure)
{
    const er_settings *settings = r->settings;
    er_step *step = &r->work->solved;
    double slack = SLACK * settings->tolerance, factor, proposal;
    double target = er_drives_next_kink(&r->system->drives, state->time, end, settings->jump);
    double left = target - state->time, wanted = fmin(state->step, settings->longest);
    /* One step a little longer, or two equal ones, rather than one full and a sliver. */
    double h = left <= STRETCH * wanted ? left : fmin(wanted, 0.5 * left);
    bool reaches_target = h == left;
    er_crossing crossing;

    guess(r, state, h, step);
    for (;;) {
        double shorter;
        if (h < SHORTEST * settings->longest && !reaches_target)
            return er_fail(failure, "the motion at t = %.6g s needs steps below %.1g s; it is"
                           " unstable or the load is not physical", state->time,
                           SHORTEST * settings->longest);
        if (!solve(r, state, h, settings->iteration * settings->tolerance, step)) {
            r->work->matrix_step = 0.0;
            r->work->has_mass = false;
            h *= 0.25;
            guess(r, state, h, step);
        } else {
            factor = SAFETY * pow(settings->tolerance / fmax(step->error, DBL_MIN), ERROR_EXPONENT);
            if (er_first_crossing(r->system->curve, state->region, slack, h, state->x, state->v,
                                  (const er_lanes *)step->acceleration, &crossing)) {
                if (land(r, state, step, &crossing)) {
                    take_crossing(r, state, &r->work->landed, &crossing);
                    return true;
                }
                shorter = 0.5 * crossing.fraction * h;
            } else if (step->error <= settings->tolerance) {
                break;
            } else {
                shorter = h * fmax(0.2, factor);
            }
            interpolate(r->m, 0.0, shorter / h, (const er_lanes *)step->acceleration,
                        step->acceleration);
            h = shorter;
        }
        wanted = h;
        reaches_target = false;
    }
    /* A step cut short by the target says little about the step that the error would allow. */
    proposal = h * fmin(FASTEST_GROWTH, factor);
    if (h < wanted)
        proposal = fmax(proposal, wanted);
    else if (factor < SMALLEST_GROWTH)
        proposal = h * fmin(1.0, factor);
    take_end(r, state, step);
    state->time = reaches_target ? target : state->time + h;
    state->step = fmin(proposal, settings->longest);
    memcpy(state->predictor, step->acceleration, (size_t)r->m * sizeof *state->predictor);
    if (step->passes > USUAL_PASSES) {
        r->work->matrix_step = 0.0;
        r->work->has_mass = false;
    }
    return true;
}

bool er_advance(er_state *state, const er_system *system, const er_settings *settings, double end,
                er_workspace *work, er_failure *failure)
{
    run r = {system, settings, work, system->robot->elastics};
    er_state moved = *state;
    /* What is left after a crossing just before the end may be less than any step. */
    double negligible = fmax(SHORTEST * settings->longest, 8.0 * DBL_EPSILON * fabs(end));
    double most = MOST_STEPS + MOST_STEPS_PER_LONGEST * (end - state->time) / settings->longest;
    work->matrix_step = 0.0;
    work->has_mass = false;
    for (double steps = 0.0; end - moved.time > negligible; steps++) {
        if (steps > most)
            return er_fail(failure, "the motion from t = %.9g s needs more than %.0f steps to"
                           " %.9g s; it is unstable or the load is not physical", state->time,
                           most, end);
        if (!take_step(&r, &moved, end, failure))
            return false;
    }
    moved.time = end;
    *state = moved;
    return true;
}
