/* Rest is where an energy is least: of flanks, elements of hysteresis, weight, contact spring and contact.
 * Newton's method walks down to it, with a search along a step that leads beyond the valley.  A gear in its
 * backlash, which has no place of its own there under a given force, rests against the spring.
 * elastic_robot/statics.py minimises the same energy in Python.
 */
#include "anchored_statics.h"

#include <float.h>
#include <math.h>
#include <string.h>


/* Passes of Newton's method before there is no equilibrium. */
#define MOST_PASSES 200
/* What is no deflection any more [rad]. */
#define LONGEST_WAY 3.14159265358979
/* A gear that carries more than this many times what it loses across its backlash has one flank to rest on. */
#define CERTAIN 3.0
/* A flank is nearer to the anchor than the other by this at least [m]; less is rounding. */
#define NEARER 1e-12
/* Rounding of the spring's force, over stiffness and distance from the base. */
#define ROUNDING (8.0 * DBL_EPSILON)
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

enum { MOST = ER_MAX_ANGLES,
       MOST_EDGES = 2 * (ER_MAX_ANGLES + ER_MAX_ELEMENTS) };

/* An equilibrium in the making; one entry per elastic coordinate. */
typedef struct {
    const er_robot *robot;
    const er_gears *gears;
    const er_history *history;
    const double *gravity, *q;
    const er_load *load;
    int m;
    double negligible; /* residual [N m]: rounding of a stiff spring's torque may be more than a gear feels */
    bool neutral[ER_MAX_ANGLES];                    /* hardly held: in the middle of its backlash */
    double x[ER_MAX_ANGLES];                        /* [rad] */
    double torque[ER_MAX_ANGLES];                   /* that must be carried [N m] */
    double residual[ER_MAX_ANGLES];                 /* that minus the curve's and the elements' [N m] */
    double gradient[ER_MAX_ANGLES * ER_MAX_ANGLES]; /* of the torque [N m/rad] */
    er_placement placement;                         /* where all this is */
    double wrench[6];                               /* there, of spring and contact too [N, N m] */
} descent;

static int region_of(const descent *s, int k)
{
    return er_gear_region(s->gears, k, s->x[k]);
}

/* Largest absolute value; NaN where there is one. */
static double largest_of(int count, const double *values)
{
    double largest = 0.0;
    for (int k = 0; k < count; k++)
        largest = fabs(values[k]) <= largest ? largest : fabs(values[k]);
    return largest;
}

/* Torque and residual at x. */
static void place_descent(descent *s, const double *x)
{
    double theta[MOST], slope;
    er_angles(s->robot, s->q, x, theta);
    er_place_bodies(s->robot, theta, &s->placement);
    er_load_wrench(s->load, s->placement.tool_position, s->wrench);
    er_static_torque(s->robot, &s->placement, s->gravity, s->wrench, s->torque);
    er_balance_torque(s->robot, s->q, x, s->torque);
    for (int k = 0; k < s->m; k++)
        s->residual[k] = s->torque[k] - er_gear_torque(s->gears, k, er_gear_region(s->gears, k, x[k]), x[k]) -
                         er_rest_torque(s->robot, s->gears->slip_torque, s->history, k, x[k], &slope);
}

/* Gradient of the torque there. */
static void update_gradient(descent *s)
{
    double support[MOST * MOST] = {0.0};
    er_static_torque_gradient(s->robot, &s->placement, s->gravity, s->wrench, s->gradient);
    er_balance_gradient(s->robot, s->q, s->x, s->gradient);
    er_load_support_chain(s->load, s->robot, &s->placement, support);
    for (int i = 0; i < s->m * s->m; i++)
        s->gradient[i] -= support[i];
}

/* Newton's matrix with a shift.  Inside its backlash a gear is held by the load alone.  A slope that sends it
 * at most to the other end of the backlash, and vanishes with what is left to balance, keeps it from being
 * thrown out; one that the load drives on crosses its backlash. */
static void fill_newton_matrix(const descent *s, double shift, double *matrix)
{
    int m = s->m;
    for (int k = 0; k < m; k++) {
        double slope = er_gear_slope(s->gears, k, region_of(s, k), s->x[k]), stuck;
        double flank = er_gear_flank_slope(s->gears, k, 0.0); /* a rounded one is flat at its foot */
        er_rest_torque(s->robot, s->gears->slip_torque, s->history, k, s->x[k], &stuck);
        slope += stuck;
        if (region_of(s, k) == 0) {
            slope += s->neutral[k] ? 0.0 : fabs(s->residual[k]) / (2.0 * er_gear_half_width(s->gears, k));
            slope += shift > 0.0 ? fmax(s->gradient[k * m + k], 0.0) : 0.0;
        }
        for (int j = 0; j < m; j++)
            matrix[k * m + j] = s->neutral[k] || s->neutral[j] ? 0.0 : -s->gradient[k * m + j];
        matrix[k * m + k] += s->neutral[k] ? 1.0 : slope + shift * flank;
    }
}

/* Newton's step towards less energy [rad]; false if the energy has no floor. */
static bool plan_step(descent *s, double *step)
{
    double matrix[MOST * MOST], largest;
    int m = s->m, pivot[MOST];
    int power = LEAST_SHIFT;
    update_gradient(s);
    fill_newton_matrix(s, 0.0, matrix);
    while (!er_is_positive(m, matrix)) { /* the energy rises in all directions */
        if (power > MOST_SHIFT)
            return false;
        fill_newton_matrix(s, ldexp(1.0, power++), matrix);
    }
    for (int i = 0; i < m; i++)
        step[i] = s->neutral[i] ? 0.0 : s->residual[i];
    if (!er_lu_factor(m, matrix, pivot))
        return false;
    er_lu_solve(m, matrix, pivot, step);
    largest = largest_of(m, step);
    for (int i = 0; largest > LONGEST_STEP && i < m; i++)
        step[i] *= LONGEST_STEP / largest;
    return true;
}

/* The torque along a step, where a part of it leads: the energy's fall.  Leaves the residual there. */
static double slope_along_step(descent *s, const double *step, double part)
{
    double x[MOST], sum = 0.0;
    for (int k = 0; k < s->m; k++)
        x[k] = s->x[k] + part * step[k];
    place_descent(s, x);
    for (int k = 0; k < s->m; k++)
        sum += s->residual[k] * step[k];
    return sum;
}

/* Puts a part of a step into the list of those that rise, if it is inside. */
static void insert_part(double part, double *edge, int *count)
{
    int place = *count;
    if (!(part > 0.0 && part < 1.0))
        return;
    for (; place > 0 && edge[place - 1] > part; place--)
        edge[place] = edge[place - 1];
    edge[place] = part;
    ++*count;
}

/* The parts of a step, rising, at which gears leave or take up their flanks and elements begin to slip or stick;
 * returns their number. */
static int list_edges(const descent *s, const double *step, double edge[MOST_EDGES])
{
    int count = 0;
    for (int i = 0; i < 2 * s->m; i++) {
        int k = i / 2;
        if (er_gear_switches(s->gears, k))
            insert_part(((i % 2 == 0 ? -1.0 : 1.0) * er_gear_half_width(s->gears, k) - s->x[k]) / step[k], edge, &count);
    }
    for (int i = 0; i < 2 * s->robot->elements; i++) {
        const er_element *element = &s->robot->element[i / 2];
        int k = element->coordinate;
        double start = s->history->x[k] - s->history->elongation[i / 2];
        insert_part((start + (i % 2 == 0 ? -1.0 : 1.0) * element->angle - s->x[k]) / step[k], edge, &count);
    }
    return count;
}

/* The part of a step that leads to the valley's floor; the residual there is left. */
static double search_part(descent *s, const double *step)
{
    double low = 0.0, high = 1.0, at_low = 0.0, at_high, part = 1.0, at, start, edge[MOST_EDGES];
    int edges, side = 0;
    for (int k = 0; k < s->m; k++)
        at_low += s->residual[k] * step[k];
    start = at_low;
    at_high = slope_along_step(s, step, 1.0);
    if (largest_of(s->m, step) < s->robot->settings.equilibrium_step || !(at_high < -LEFT * start))
        return 1.0;
    /* Between two of these places the torque along the step is nearly straight. */
    edges = list_edges(s, step, edge);
    for (int k = 0; k < edges; k++) {
        at = slope_along_step(s, step, edge[k]);
        if (at < 0.0) {
            high = edge[k], at_high = at;
            break;
        }
        low = edge[k], at_low = at;
    }
    for (int tries = 0; tries < MOST_TRIES; tries++) {
        part = low + (high - low) * at_low / (at_low - at_high);
        at = slope_along_step(s, step, part);
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

/* The deflection under the load of the undeflected robot, on flanks and spring; a gear that neither force
 * and weight nor the spring can hold anywhere stays in the middle of its backlash. */
static bool begin_descent(descent *s)
{
    double stiffness[MOST * MOST] = {0.0}, given[MOST];
    const er_anchor *anchor = &s->load->anchor;
    double least = s->robot->settings.neutral_torque, reach;
    int m = s->m, pivot[MOST];
    memset(s->x, 0, sizeof s->x);
    place_descent(s, s->x);
    reach = largest_of(3, anchor->position) + largest_of(3, s->placement.tool_position);
    s->negligible = least + ROUNDING * (largest_of(ER_SYMMETRIC, anchor->stiffness) + s->load->contact.stiffness) *
                                reach * reach;
    er_static_torque(s->robot, &s->placement, s->gravity, s->load->wrench, given);
    er_balance_torque(s->robot, s->q, s->x, given);
    er_load_support_chain(s->load, s->robot, &s->placement, stiffness);
    memcpy(s->x, s->torque, sizeof s->x);
    for (int k = 0; k < m; k++) {
        s->neutral[k] = er_gear_switches(s->gears, k) && !(s->gears->slip_torque[k] > 0.0) && fabs(given[k]) < least &&
                        stiffness[k * m + k] * er_gear_half_width(s->gears, k) < least;
        stiffness[k * m + k] += er_gear_flank_slope(s->gears, k, 0.0);
    }
    if (!er_lu_factor(m, stiffness, pivot))
        return false;
    er_lu_solve(m, stiffness, pivot, s->x);
    for (int k = 0; k < m; k++) {
        double side = s->x[k] > 0.0 ? 1.0 : s->x[k] < 0.0 ? -1.0 : 0.0;
        s->x[k] = s->neutral[k] ? 0.0 : s->x[k] + side * er_gear_half_width(s->gears, k);
    }
    return true;
}

/* Lets gears go that are loaded in the middle of their backlash now that the others have given way; false
 * if there are none. */
static bool release_loaded_gears(descent *s)
{
    bool released = false;
    for (int k = 0; k < s->m; k++)
        if (s->neutral[k] && fabs(s->residual[k]) >= s->negligible) {
            s->neutral[k] = false;
            released = true;
        }
    return released;
}

static double largest_residual(const descent *s)
{
    double largest = 0.0;
    for (int k = 0; k < s->m; k++)
        if (!s->neutral[k] && !(fabs(s->residual[k]) <= largest))
            largest = fabs(s->residual[k]);
    return largest;
}

/* Goes downhill from x to rest; false if there is none. */
static bool descend_to_rest(descent *s)
{
    place_descent(s, s->x);
    for (int pass = 0; pass < MOST_PASSES; pass++) {
        double step[MOST], part, before = largest_residual(s), after;
        if (!plan_step(s, step))
            return false;
        part = search_part(s, step);
        for (int k = 0; k < s->m; k++)
            s->x[k] += part * step[k];
        if (!(largest_of(s->m, s->x) < LONGEST_WAY))
            return false;
        after = largest_residual(s);
        /* Where it does not fall any more that is rounding, or the edge of a backlash. */
        if (((part == 1.0 && largest_of(s->m, step) < s->robot->settings.equilibrium_step) ||
             (after <= s->negligible && after >= 0.5 * before)) && !release_loaded_gears(s))
            return true;
    }
    return false;
}

/* From the TCP to the anchor, or without a spring to the plane of the contact [m]. */
static double anchor_distance(const descent *s)
{
    double gap[3];
    er_anchor_gap(&s->load->anchor, 0.0, s->placement.tool_position, gap);
    if (!er_anchor_holds(&s->load->anchor))
        return fabs(er_contact_touch(&s->load->contact, gap).depth);
    return sqrt(er_dot(gap, gap));
}

/* Whether a gear might rest on its other flank too: driven on all through its backlash. */
static bool is_undecided(const descent *s, int k)
{
    double driven = s->gradient[k * s->m + k];
    return er_gear_switches(s->gears, k) && !(s->gears->slip_torque[k] > 0.0) && region_of(s, k) != 0 && driven > 0.0 &&
           fabs(s->torque[k]) < CERTAIN * 2.0 * er_gear_half_width(s->gears, k) * driven;
}

/* Where a gear that the spring does not support could rest on either flank, takes the one with the TCP
 * nearer to the anchor: a contact is touched there. */
static void take_nearer_flanks(descent *s, const bool *neutral)
{
    bool undecided[MOST];
    update_gradient(s);
    for (int k = 0; k < s->m; k++)
        undecided[k] = is_undecided(s, k);
    for (int k = 0; k < s->m; k++)
        if (undecided[k]) {
            descent other = *s;
            memcpy(other.neutral, neutral, sizeof other.neutral);
            other.x[k] = -other.x[k];
            if (descend_to_rest(&other) && other.x[k] * s->x[k] < 0.0 && anchor_distance(&other) < anchor_distance(s) - NEARER)
                *s = other;
        }
}

bool er_anchored_equilibrium(const er_robot *robot, const er_gears *gears, const er_history *history,
                             const double gravity[3], const double *q, const er_load *load, double *x)
{
    descent s;
    bool neutral[MOST];
    s.robot = robot, s.gears = gears, s.gravity = gravity, s.load = load, s.q = q;
    s.m = robot->elastics;
    s.history = history;
    if (!begin_descent(&s))
        return false;
    memcpy(neutral, s.neutral, sizeof neutral);
    if (!descend_to_rest(&s))
        return false;
    take_nearer_flanks(&s, neutral);
    memcpy(x, s.x, (size_t)s.m * sizeof *x);
    return true;
}
