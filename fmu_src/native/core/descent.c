#include "descent.h"

#include <string.h>

#include "contact_motion.h"
#include "linear.h"

/* Longest step of a coordinate [rad]. */
#define LONGEST_STEP 0.5
/* A step ends where the torque along it is this part of the one at its start, or before: the floor. */
#define LEFT 0.1
/* Tries to find the floor along a step. */
#define MOST_TRIES 60
/* Slopes that are added, over those of the flanks, until the energy's curvature is positive: powers of
 * two, close to each other, since one that is far too large leads off a saddle in tiny steps. */
#define LEAST_SHIFT (-40)
#define MOST_SHIFT 14

enum { MOST = ER_MAX_ANGLES };

void er_descent_place(er_descent *s, const double *x)
{
    double theta[MOST], wrench[6];
    er_angles(s->robot, s->q, x, theta);
    er_place_bodies(s->robot, theta, &s->placement);
    er_load_wrench(s->load, s->placement.tool_position, wrench);
    er_static_torque(s->robot, &s->placement, s->gravity, wrench, s->torque);
    for (int k = 0; k < s->m; k++)
        s->residual[k] =
            s->torque[k] - er_gear_torque(s->gears, k, er_gear_region(s->gears, k, x[k]), x[k]);
}

void er_descent_gradient(er_descent *s)
{
    double wrench[6], stiffness[ER_SYMMETRIC], support[MOST * MOST] = {0.0};
    er_load_wrench(s->load, s->placement.tool_position, wrench);
    er_static_torque_gradient(s->robot, &s->placement, s->gravity, wrench, s->gradient);
    er_load_support(s->load, s->placement.tool_position, stiffness);
    er_add_support(s->robot, &s->placement, stiffness, support);
    for (int i = 0; i < s->m * s->m; i++)
        s->gradient[i] -= support[i];
}

/* Whether the energy that a matrix is the curvature of rises in all directions: Cholesky's method. */
static bool is_positive(int m, const double *matrix)
{
    double root[MOST * MOST];
    for (int i = 0; i < m; i++)
        for (int j = 0; j <= i; j++) {
            double sum = 0.5 * (matrix[i * m + j] + matrix[j * m + i]);
            for (int k = 0; k < j; k++)
                sum -= root[i * m + k] * root[j * m + k];
            if (i == j && !(sum > 0.0))
                return false;
            root[i * m + j] = i == j ? sqrt(sum) : sum / root[j * m + j];
        }
    return true;
}

/* Newton's matrix with a shift.  Inside its play a gear is held by the load alone.  A slope that sends it
 * at most to the other end of the play, and vanishes with what is left to balance, keeps it from being
 * thrown out; one that the load drives on crosses its play. */
static void find_matrix(const er_descent *s, double shift, double *matrix)
{
    int m = s->m;
    for (int k = 0; k < m; k++) {
        double slope = er_gear_slope(s->gears, k, er_descent_region(s, k), s->x[k]);
        double flank = er_gear_flank_slope(s->gears, k, 0.0); /* a rounded one is flat at its foot */
        if (er_descent_region(s, k) == 0) {
            slope += s->neutral[k] ? 0.0 : fabs(s->residual[k]) / (2.0 * er_gear_play(s->gears, k));
            slope += shift > 0.0 ? fmax(s->gradient[k * m + k], 0.0) : 0.0;
        }
        for (int j = 0; j < m; j++)
            matrix[k * m + j] = s->neutral[k] || s->neutral[j] ? 0.0 : -s->gradient[k * m + j];
        matrix[k * m + k] += s->neutral[k] ? 1.0 : slope + shift * flank;
    }
}

bool er_descent_step(er_descent *s, double *step)
{
    double matrix[MOST * MOST], largest;
    int m = s->m, pivot[MOST];
    int power = LEAST_SHIFT;
    er_descent_gradient(s);
    find_matrix(s, 0.0, matrix);
    while (!is_positive(m, matrix)) {
        if (power > MOST_SHIFT)
            return false;
        find_matrix(s, ldexp(1.0, power++), matrix);
    }
    for (int i = 0; i < m; i++)
        step[i] = s->neutral[i] ? 0.0 : s->residual[i];
    if (!er_lu_factor(m, matrix, pivot))
        return false;
    er_lu_solve(m, matrix, pivot, step);
    largest = er_largest(m, step);
    for (int i = 0; largest > LONGEST_STEP && i < m; i++)
        step[i] *= LONGEST_STEP / largest;
    return true;
}

/* The torque along a step, where a part of it leads: the energy's fall.  Leaves the residual there. */
static double downhill(er_descent *s, const double *step, double part)
{
    double x[MOST], sum = 0.0;
    for (int k = 0; k < s->m; k++)
        x[k] = s->x[k] + part * step[k];
    er_descent_place(s, x);
    for (int k = 0; k < s->m; k++)
        sum += s->residual[k] * step[k];
    return sum;
}

/* The parts of a step, rising, at which gears leave or take up their flanks; returns their number. */
static int find_edges(const er_descent *s, const double *step, double edge[2 * MOST])
{
    int count = 0;
    for (int i = 0; i < 2 * s->m; i++) {
        int k = i / 2, place = count;
        double part = ((i % 2 == 0 ? -1.0 : 1.0) * er_gear_play(s->gears, k) - s->x[k]) / step[k];
        if (!er_gear_switches(s->gears, k) || !(part > 0.0 && part < 1.0))
            continue;
        for (; place > 0 && edge[place - 1] > part; place--)
            edge[place] = edge[place - 1];
        edge[place] = part;
        count++;
    }
    return count;
}

double er_descent_part(er_descent *s, const double *step)
{
    double low = 0.0, high = 1.0, at_low = 0.0, at_high, part = 1.0, at, start, edge[2 * MOST];
    int edges, side = 0;
    for (int k = 0; k < s->m; k++)
        at_low += s->residual[k] * step[k];
    start = at_low;
    at_high = downhill(s, step, 1.0);
    if (er_largest(s->m, step) < s->robot->settings.equilibrium_step || !(at_high < -LEFT * start))
        return 1.0;
    /* Between two of these places the torque along the step is nearly straight. */
    edges = find_edges(s, step, edge);
    for (int k = 0; k < edges; k++) {
        at = downhill(s, step, edge[k]);
        if (at < 0.0) {
            high = edge[k], at_high = at;
            break;
        }
        low = edge[k], at_low = at;
    }
    for (int tries = 0; tries < MOST_TRIES; tries++) {
        part = low + (high - low) * at_low / (at_low - at_high);
        at = downhill(s, step, part);
        if (fabs(at) <= LEFT * start)
            break;
        /* False position; the value at an end that stays counts half (Dowell and Jarratt 1971). */
        if (at > 0.0) {
            low = part, at_low = at;
            at_high *= side > 0 ? 0.5 : 1.0;
            side = 1;
        } else {
            high = part, at_high = at;
            at_low *= side < 0 ? 0.5 : 1.0;
            side = -1;
        }
    }
    return part;
}
