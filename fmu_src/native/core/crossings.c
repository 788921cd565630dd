/* Where a step leaves the region in which a coordinate obeys one smooth law, or a contact begins or ends, and
 * what the columns of sensitivities lack where it ends there.
 */
#include "sensitivity.h"

#include <math.h>
#include <string.h>

#include "linear.h"

/* A passage is located to this part of a step. */
#define LOCATED 1e-12

/* Bernstein coefficients of the left and right half of a polynomial (de Casteljau). */
static void halve(const double *whole, double *left, double *right)
{
    double work[ER_CONTROL];
    memcpy(work, whole, sizeof work);
    for (int round = 0; round < ER_CONTROL; round++) {
        left[round] = work[0];
        right[ER_DEGREE - round] = work[ER_DEGREE - round];
        for (int k = 0; k < ER_DEGREE - round; k++)
            work[k] = 0.5 * (work[k] + work[k + 1]);
    }
}

static bool all_below_or_above(const double *b)
{
    bool below = false, above = false;
    for (int k = 0; k < ER_CONTROL; k++) {
        below |= b[k] <= 0.0;
        above |= b[k] > 0.0;
    }
    return !(below && above);
}

/* The smallest s at which a polynomial, given by its Bernstein coefficients on [start, start +
 * width], rises through zero; a negative number if it does not. */
static double first_rise(const double *b, double start, double width)
{
    double left[ER_CONTROL], right[ER_CONTROL], found;
    if (all_below_or_above(b))
        return -1.0;
    if (width < LOCATED)
        return b[0] <= 0.0 && b[ER_DEGREE] > 0.0 ? start + width : -1.0;
    halve(b, left, right);
    found = first_rise(left, start, 0.5 * width);
    return found >= 0.0 ? found : first_rise(right, start + 0.5 * width, 0.5 * width);
}

static void take_earlier(const double *control, int coordinate, double boundary, int outward,
                         int region, er_crossing *first, bool *found)
{
    double beyond[ER_CONTROL], fraction;
    for (int k = 0; k < ER_CONTROL; k++)
        beyond[k] = outward * (control[k] - boundary);
    fraction = first_rise(beyond, 0.0, 1.0);
    if (fraction > 0.0 && (!*found || fraction < first->fraction)) {
        *first = (er_crossing){coordinate, boundary, outward, region == 0 ? outward : 0, fraction};
        *found = true;
    }
}

bool er_first_crossing(const er_gears *gears, const er_settings *settings, const int *region,
                       double tolerance, double h, const double *x, const double *v,
                       const er_lanes *acceleration, er_crossing *first)
{
    bool found = false;
    for (int k = 0; k < gears->count; k++) {
        double control[ER_CONTROL], edge[2];
        double highest = -INFINITY, lowest = INFINITY;
        if (!er_gear_switches(gears, k))
            continue;
        for (int c = 0; c < ER_CONTROL; c++) {
            const double *weight = er_gauss_bernstein[c];
            double bend = 0.0;
            for (int j = 0; j < ER_STAGES; j++)
                bend += weight[2 + j] * acceleration[k][j];
            control[c] = weight[0] * x[k] + h * (weight[1] * v[k] + h * bend);
            highest = control[c] > highest ? control[c] : highest;
            lowest = control[c] < lowest ? control[c] : lowest;
        }
        er_gear_edges(gears, settings, k, region[k], tolerance, edge);
        /* The polynomial lies between its coefficients. */
        if (highest > edge[1])
            take_earlier(control, k, edge[1], 1, region[k], first, &found);
        if (lowest < edge[0])
            take_earlier(control, k, edge[0], -1, region[k], first, &found);
    }
    return found;
}

bool er_earlier_contact(bool touching, const double depth[ER_CONTROL], bool found, er_crossing *first)
{
    double control[ER_CONTROL], boundary = touching ? 0.0 : ER_CONTACT_SLACK;
    for (int c = 0; c < ER_CONTROL; c++) {
        control[c] = 0.0;
        for (int j = 0; j < ER_CONTROL; j++)
            control[c] += er_gauss_bernstein_from_value[c][j] * depth[j];
    }
    take_earlier(control, ER_DEPTH, boundary, touching ? -1 : 1, touching, first, &found);
    if (found && first->coordinate == ER_DEPTH)
        first->region = !touching;
    return found;
}

/* A contact begins as a gear passes its backlash: the step ends a little behind the plane and knows nothing of
 * the force N on the way there, a time d / d' long.  What is missing is
 *
 *     dx' += M^-1 J_c^T (F / d') dd,
 *
 * with the change dd of the depth.  Where it lifts off the step ends at the plane, and nothing is missing. */
static void cross_contact(er_sensitivity *s, const er_run *r, const er_state *state, const er_step *step)
{
    const er_robot *robot = r->system->robot;
    er_workspace *w = r->work;
    const er_contact_motion *motion = w->contact;
    int m = r->m, pivot[ER_MAX_ANGLES];
    double theta[ER_MAX_ANGLES], mass[ER_MAX_ANGLES * ER_MAX_ANGLES], response[ER_MAX_ANGLES];
    double approach = er_end_approach(r, step);
    if (!(approach > 0.0))
        return;
    er_angles(robot, w->reference.angle, step->x, theta);
    er_place_bodies(robot, theta, &w->placement);
    er_mass_matrix(robot, &w->placement, mass);
    if (!er_lu_factor(m, mass, pivot)) {
        s->reason = "the mass matrix is singular";
        return;
    }
    for (int k = 0; k < m; k++)
        response[k] = er_dot(motion->lever[robot->elastic_angle[k]], motion->wrench) / approach;
    er_lu_solve(m, mass, pivot, response);
    for (int column = s->first; column < s->first + s->count; column++) {
        er_share share = er_share_of(s, robot, column, state->time + step->length - s->start);
        double still[ER_MAX_ANGLES] = {0.0}, change[ER_MAX_ANGLES];
        er_touch along;
        er_angles(robot, still, s->x[column], change);
        if (share.joint >= 0)
            change[robot->drive_angle[share.joint]] += share.q;
        er_contact_place_along(robot, &r->system->load, motion, change, still, &share.load, &along);
        for (int k = 0; k < m; k++)
            s->v[column][k] += response[k] * along.depth;
    }
}

/* The torque is continuous where a coordinate x_k passes the edge of its backlash, only its slope jumps.
 * So x'' is the same under both laws there, a shift of the moment of the passage changes x and x' to
 * second order only, and the sensitivities are continuous.
 *
 * The step, however, ends a little beyond the edge and has kept the old law's slope on the way there.
 * With the time t since the edge and the jump J of the torque at x_k, what is missing is
 *
 *     dx' -= M^-1 e_k (J t / beyond) dx_k,    beyond = x_k' t - x_k'' t^2 / 2.
 */
void er_sensitivity_cross(er_sensitivity *s, const er_run *r, const er_state *state,
                          const er_step *step, const er_crossing *crossing)
{
    const er_system *system = r->system;
    int m = r->m, k = crossing->coordinate, pivot[ER_MAX_ANGLES];
    double jump, edge, beyond, rate, bend, per_beyond;
    double theta[ER_MAX_ANGLES], mass[ER_MAX_ANGLES * ER_MAX_ANGLES];
    double response[ER_MAX_ANGLES] = {0.0};
    if (s->reason != NULL)
        return;
    if (k == ER_DEPTH) {
        if (crossing->outward > 0)
            cross_contact(s, r, state, step);
        return;
    }
    jump = er_gear_torque(system->gears, k, crossing->region, step->x[k]) -
           er_gear_torque(system->gears, k, state->region[k], step->x[k]);
    edge = copysign(er_gear_half_width(system->gears, k), crossing->boundary);
    beyond = crossing->outward * (step->x[k] - edge);
    rate = crossing->outward * step->v[k], bend = crossing->outward * step->a[k];
    per_beyond = 2.0 / (rate + sqrt(fmax(rate * rate - 2.0 * bend * beyond, 0.0)));
    if (!(per_beyond > 0.0 && per_beyond < INFINITY))
        return;
    er_angles(system->robot, r->work->reference.angle, step->x, theta); /* the drives at the step's end */
    er_place_bodies(system->robot, theta, &r->work->placement);
    er_mass_matrix(system->robot, &r->work->placement, mass);
    if (!er_lu_factor(m, mass, pivot)) {
        s->reason = "the mass matrix is singular";
        return;
    }
    response[k] = jump * per_beyond * crossing->outward;
    er_lu_solve(m, mass, pivot, response);
    for (int column = s->first; column < s->first + s->count; column++) {
        bool moves = column == er_first_column(system->robot, ER_BY_BACKLASH) + k; /* the edge, with the backlash */
        double beyond_change = s->x[column][k] - (moves ? er_gear_per_backlash(system->gears, k, edge) : 0.0);
        for (int i = 0; i < m; i++)
            s->v[column][i] -= response[i] * beyond_change;
    }
}
