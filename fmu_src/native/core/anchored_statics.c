/* Rest is where an energy is least: of flanks, weight, contact spring and contact.  Newton's method walks
 * down to it, with a search along a step that leads beyond the valley.  A gear in its play, which has no
 * place of its own there under a given force, rests against the spring.
 * elastic_robot/spring_statics.py is the same in Python.
 */
#include "statics.h"

#include <float.h>
#include <string.h>

#include "descent.h"
#include "contact_motion.h"
#include "linear.h"

/* Passes of Newton's method before there is no equilibrium. */
#define MOST_PASSES 200
/* What is no deflection any more [rad]. */
#define LONGEST_WAY 3.14159265358979
/* A gear that carries more than this many times what it loses across its play has one flank to rest on. */
#define CERTAIN 3.0
/* A flank is nearer to the anchor than the other by this at least [m]; less is rounding. */
#define NEARER 1e-12
/* Rounding of the spring's force, over stiffness and distance from the base. */
#define ROUNDING (8.0 * DBL_EPSILON)

enum { MOST = ER_MAX_ANGLES };

/* What counts as nothing: rounding of a stiff spring's torque may be more than a gear feels. */
static void find_negligible(er_descent *s)
{
    const er_anchor *anchor = &s->load->anchor;
    double reach = er_largest(3, anchor->position) + er_largest(3, s->placement.tool_position);
    s->negligible = s->robot->settings.neutral_torque +
                    ROUNDING * (er_largest(ER_SYMMETRIC, anchor->stiffness) + s->load->contact.stiffness) *
                        reach * reach;
}

/* The deflection under the load of the undeflected robot, on flanks and spring; a gear that neither force
 * and weight nor the spring can hold anywhere stays in the middle of its play. */
static bool begin(er_descent *s)
{
    double stiffness[MOST * MOST] = {0.0}, given[MOST], support[ER_SYMMETRIC];
    double least = s->robot->settings.neutral_torque;
    int m = s->m, pivot[MOST];
    memset(s->x, 0, sizeof s->x);
    er_descent_place(s, s->x);
    find_negligible(s);
    er_static_torque(s->robot, &s->placement, s->gravity, s->load->wrench, given);
    er_load_support(s->load, s->placement.tool_position, support);
    er_add_support(s->robot, &s->placement, support, stiffness);
    memcpy(s->x, s->torque, sizeof s->x);
    for (int k = 0; k < m; k++) {
        s->neutral[k] = er_gear_switches(s->gears, k) && fabs(given[k]) < least &&
                        stiffness[k * m + k] * er_gear_play(s->gears, k) < least;
        stiffness[k * m + k] += er_gear_flank_slope(s->gears, k, 0.0);
    }
    if (!er_lu_factor(m, stiffness, pivot))
        return false;
    er_lu_solve(m, stiffness, pivot, s->x);
    for (int k = 0; k < m; k++) {
        double side = s->x[k] > 0.0 ? 1.0 : s->x[k] < 0.0 ? -1.0 : 0.0;
        s->x[k] = s->neutral[k] ? 0.0 : s->x[k] + side * er_gear_play(s->gears, k);
    }
    return true;
}

/* Lets gears go that are loaded in the middle of their play now that the others have given way; false
 * if there are none. */
static bool release_loaded(er_descent *s)
{
    bool released = false;
    for (int k = 0; k < s->m; k++)
        if (s->neutral[k] && fabs(s->residual[k]) >= s->negligible) {
            s->neutral[k] = false;
            released = true;
        }
    return released;
}

static double left(const er_descent *s)
{
    double largest = 0.0;
    for (int k = 0; k < s->m; k++)
        if (!s->neutral[k] && !(fabs(s->residual[k]) <= largest))
            largest = fabs(s->residual[k]);
    return largest;
}

/* Goes downhill from x to rest; false if there is none. */
static bool descend(er_descent *s)
{
    er_descent_place(s, s->x);
    for (int pass = 0; pass < MOST_PASSES; pass++) {
        double step[MOST], part, before = left(s), after;
        if (!er_descent_step(s, step))
            return false;
        part = er_descent_part(s, step);
        for (int k = 0; k < s->m; k++)
            s->x[k] += part * step[k];
        if (!(er_largest(s->m, s->x) < LONGEST_WAY))
            return false;
        after = left(s);
        /* Where it does not fall any more that is rounding, or the edge of a play. */
        if (((part == 1.0 && er_largest(s->m, step) < s->robot->settings.equilibrium_step) ||
             (after <= s->negligible && after >= 0.5 * before)) &&
            !release_loaded(s))
            return true;
    }
    return false;
}

/* From the TCP to the anchor, or without a spring to the plane of the contact [m]. */
static double distance(const er_descent *s)
{
    double gap[3];
    er_anchor_gap(&s->load->anchor, 0.0, s->placement.tool_position, gap);
    if (!er_anchor_holds(&s->load->anchor))
        return fabs(er_contact_touch(&s->load->contact, gap).depth);
    return sqrt(er_dot(gap, gap));
}

/* Whether a gear might rest on its other flank too: driven on all through its play. */
static bool is_undecided(const er_descent *s, int k)
{
    double driven = s->gradient[k * s->m + k];
    return er_gear_switches(s->gears, k) && er_descent_region(s, k) != 0 && driven > 0.0 &&
           fabs(s->torque[k]) < CERTAIN * 2.0 * er_gear_play(s->gears, k) * driven;
}

/* Where a gear that the spring does not support could rest on either flank, takes the one with the TCP
 * nearer to the anchor: a contact is touched there. */
static void take_nearer_flanks(er_descent *s, const bool *neutral)
{
    bool undecided[MOST];
    er_descent_gradient(s);
    for (int k = 0; k < s->m; k++)
        undecided[k] = is_undecided(s, k);
    for (int k = 0; k < s->m; k++)
        if (undecided[k]) {
            er_descent other = *s;
            memcpy(other.neutral, neutral, sizeof other.neutral);
            other.x[k] = -other.x[k];
            if (descend(&other) && other.x[k] * s->x[k] < 0.0 && distance(&other) < distance(s) - NEARER)
                *s = other;
        }
}

bool er_anchored_equilibrium(const er_robot *robot, const er_gears *gears, const double gravity[3],
                             const double *q, const er_load *load, double *x)
{
    er_descent s;
    bool neutral[MOST];
    s.robot = robot, s.gears = gears, s.gravity = gravity, s.load = load, s.q = q;
    s.m = robot->elastics;
    if (!begin(&s))
        return false;
    memcpy(neutral, s.neutral, sizeof neutral);
    if (!descend(&s))
        return false;
    take_nearer_flanks(&s, neutral);
    memcpy(x, s.x, (size_t)s.m * sizeof *x);
    return true;
}
