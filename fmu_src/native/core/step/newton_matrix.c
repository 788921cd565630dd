#include "newton_matrix.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "motor_step.h"

/* A mass matrix serves steps that differ by this much in every drive [rad]. */
#define SAME_POSTURE 0.005
/* Matrices serve while a contact's stiffness and damping differ by this part of their largest entries. */
#define SAME_CONTACT 0.05

static bool is_near(int joints, const double *a, const double *b)
{
    bool near = true;
    for (int i = 0; i < joints; i++)
        near &= fabs(a[i] - b[i]) <= SAME_POSTURE;
    return near;
}

static void build_mass(const er_run *r)
{
    const er_robot *robot = r->system->robot;
    er_workspace *w = r->work;
    double theta[ER_MAX_ANGLES];
    er_angles(robot, w->linearisation.q, w->linearisation.x, theta);
    er_place_bodies(robot, theta, &w->placement);
    er_mass_matrix(robot, &w->placement, w->mass);
    for (int k = 0; k < r->m; k++) {
        memcpy(w->lever[k], w->placement.lever[robot->elastic_angle[k]], sizeof w->lever[k]);
        memcpy(w->axis[k], w->placement.axis[robot->elastic_angle[k]], sizeof w->axis[k]);
    }
}

/* Adds J_p^T K J_p of spring and contact, which the tool leans on, to the stiffness in the matrix. */
static void add_support(const er_run *r)
{
    er_workspace *w = r->work;
    const er_linearisation *at = &w->linearisation;
    double h2 = at->length * at->length, squared_re[ER_PAIRS], squared_im[ER_PAIRS];
    double support[ER_SYMMETRIC];
    for (int k = 0; k < ER_SYMMETRIC; k++)
        support[k] = at->anchor[k] + at->contact[k];
    for (int p = 0; p < ER_PAIRS; p++) {
        double re = er_gauss_eigen_re[p], im = er_gauss_eigen_im[p];
        squared_re[p] = h2 * (re * re - im * im);
        squared_im[p] = h2 * 2.0 * re * im;
    }
    for (int i = 0; i < r->m; i++) {
        double pull[3];
        er_anchor_times(support, w->lever[i], pull);
        for (int j = 0; j <= i; j++) {
            double stiffness = er_dot(pull, w->lever[j]);
            er_complex_pair *entry = &w->matrix[i * r->m + j];
            for (int p = 0; p < ER_PAIRS; p++) {
                entry->re[p] += squared_re[p] * stiffness;
                entry->im[p] += squared_im[p] * stiffness;
            }
        }
    }
}

/* Adds J_c^T D J_c of a contact, at the sphere's lowest point, to the damping in the matrix. */
static void add_damper(const er_run *r)
{
    er_workspace *w = r->work;
    const er_linearisation *at = &w->linearisation;
    double lever[ER_MAX_ANGLES][3], pull[3];
    for (int i = 0; i < r->m; i++) {
        er_cross(w->axis[i], at->offset, lever[i]);
        for (int c = 0; c < 3; c++)
            lever[i][c] += w->lever[i][c];
        er_anchor_times(at->damper, lever[i], pull);
        for (int j = 0; j <= i; j++) {
            double damping = at->length * er_dot(pull, lever[j]);
            er_complex_pair *entry = &w->matrix[i * r->m + j];
            for (int p = 0; p < ER_PAIRS; p++) {
                entry->re[p] += er_gauss_eigen_re[p] * damping;
                entry->im[p] += er_gauss_eigen_im[p] * damping;
            }
        }
    }
}

static bool is_any(const double values[ER_SYMMETRIC])
{
    bool any = false;
    for (int k = 0; k < ER_SYMMETRIC; k++)
        any |= values[k] != 0.0;
    return any;
}

/* In the eigenvectors of A1 the stages of the Newton equations are independent of each other. */
static bool invert_matrix(const er_run *r)
{
    er_workspace *w = r->work;
    const er_linearisation *at = &w->linearisation;
    int m = r->m;
    for (int i = 0; i < m; i++)
        for (int j = 0; j <= i; j++) {
            double mass = w->mass[i * m + j];
            w->matrix[i * m + j] = (er_complex_pair){{mass, mass}, {0.0, 0.0}};
        }
    for (int k = 0; k < m; k++) {
        double damping = r->system->gears->damping[k];
        er_complex_pair *diagonal = &w->matrix[k * m + k];
        for (int p = 0; p < ER_PAIRS; p++) {
            double re = at->length * er_gauss_eigen_re[p], im = at->length * er_gauss_eigen_im[p];
            diagonal->re[p] += re * damping + (re * re - im * im) * at->slope[k];
            diagonal->im[p] += im * damping + 2.0 * re * im * at->slope[k];
        }
    }
    if (r->motors > 0)
        er_motors_eliminate(r, w->matrix);
    if (is_any(at->anchor) || is_any(at->contact))
        add_support(r);
    if (is_any(at->damper))
        add_damper(r);
    return r->means->kernel.invert(m, w->matrix, w->inverse);
}

/* Matrices of the contact, in the middle of the step as it was guessed; none where it is not touched. */
typedef struct {
    double stiffness[ER_SYMMETRIC], damping[ER_SYMMETRIC], offset[3];
} yielding;

static const yielding *find_yielding(const er_run *r, const er_state *state, yielding *now)
{
    static const yielding none;
    const er_contact_motion *motion = &r->work->contact[ER_STAGES / 2];
    if (!r->system->contacting || state->touching != 1)
        return &none;
    er_contact_matrices(&r->system->load.contact, &motion->touch, now->stiffness, now->damping);
    memcpy(now->offset, motion->offset, sizeof now->offset);
    return now;
}

static bool is_alike(const double *a, const double *b)
{
    double largest = 0.0, apart = 0.0;
    for (int k = 0; k < ER_SYMMETRIC; k++) {
        largest = fmax(largest, fabs(b[k]));
        apart = fmax(apart, fabs(a[k] - b[k]));
    }
    return apart <= SAME_CONTACT * largest;
}

/* Whether the inverses are those of the present spring and, nearly, of the present contact. */
static bool is_held(const er_system *system, const er_linearisation *at, const yielding *now)
{
    if (memcmp(at->anchor, system->load.anchor.stiffness, sizeof at->anchor) != 0)
        return false;
    return !system->contacting ||
           (is_alike(at->contact, now->stiffness) && is_alike(at->damper, now->damping) &&
            memcmp(at->offset, now->offset, sizeof at->offset) == 0);
}

bool er_linearise(const er_run *r, const er_state *state, double h)
{
    const er_system *system = r->system;
    er_workspace *w = r->work;
    er_linearisation *at = &w->linearisation;
    double q[ER_MAX_JOINTS];
    yielding present;
    const yielding *now = find_yielding(r, state, &present);
    for (int i = 0; i < system->robot->joints; i++)
        q[i] = w->stages.q[i][ER_STAGES / 2];
    for (int d = 0; d < r->motors; d++)
        q[system->robot->motor[d].joint] += w->motors.p[d];
    if (at->has_mass && is_near(system->robot->joints, q, at->q)) {
        if (fabs(at->length - h) <= r->settings->same_length * h && is_held(system, at, now))
            return true;
    } else {
        memcpy(at->q, q, (size_t)system->robot->joints * sizeof *q);
        memcpy(at->x, state->x, (size_t)r->m * sizeof *at->x);
        at->has_mass = true;
        build_mass(r);
    }
    for (int k = 0; k < r->m; k++)
        at->slope[k] = er_gear_slope(system->gears, k, state->region[k], state->x[k]);
    er_stops_stiffness(system->robot, system->gears->slip_torque, &state->stops, at->slope);
    memcpy(at->anchor, system->load.anchor.stiffness, sizeof at->anchor);
    memcpy(at->contact, now->stiffness, sizeof at->contact);
    memcpy(at->damper, now->damping, sizeof at->damper);
    memcpy(at->offset, now->offset, sizeof at->offset);
    at->length = h;
    er_motors_linearise(r, state);
    if (invert_matrix(r))
        return true;
    er_relinearise(w);
    return false;
}

static bool is_same_linearisation(const er_run *r, const er_linearisation *a, const er_linearisation *b)
{
    size_t joints = (size_t)r->system->robot->joints, m = (size_t)r->m;
    size_t first = offsetof(er_linearisation, anchor); /* of what spring and contact have, the last of all */
    return a->has_mass == b->has_mass && a->length == b->length &&
           memcmp(a->q, b->q, joints * sizeof *a->q) == 0 &&
           memcmp(a->x, b->x, m * sizeof *a->x) == 0 &&
           memcmp(a->slope, b->slope, m * sizeof *a->slope) == 0 &&
           memcmp((const char *)a + first, (const char *)b + first, sizeof *a - first) == 0;
}

void er_linearise_as(const er_run *r, const er_state *state)
{
    er_workspace *w = r->work;
    const er_linearisation *linearisation = &state->linearisation;
    size_t bytes = (size_t)r->motors * sizeof *w->motors.slopes;
    if (is_same_linearisation(r, linearisation, &w->linearisation) &&
        memcmp(w->motors.slopes, state->motors.slopes, bytes) == 0)
        return;
    memcpy(w->motors.slopes, state->motors.slopes, bytes);
    w->linearisation = *linearisation;
    if (w->linearisation.has_mass)
        build_mass(r);
    if (w->linearisation.length > 0.0)
        invert_matrix(r); /* which succeeded when they were first made */
}

void er_relinearise(er_workspace *work)
{
    work->linearisation.has_mass = false;
    work->linearisation.length = 0.0;
}
