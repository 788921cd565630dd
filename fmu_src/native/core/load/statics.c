#include "statics.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "anchored_statics.h"

/* A step longer than this [rad] is no deflection any more. */
#define LONGEST_STEP 3.14159265358979

enum { MOST = ER_MAX_ANGLES };

/* An equilibrium in the making; one entry per elastic coordinate. */
typedef struct {
    const er_robot *robot;
    const er_gears *gears;
    const er_history *history;
    const double *gravity, *wrench, *q;
    int m;
    double *x;
    double torque[MOST];           /* that must be carried [N m] */
    double softening[MOST * MOST]; /* its gradient [N m/rad] */
    int region[MOST];
    bool neutral[MOST];
    double factors[MOST * MOST];
    int pivot[MOST];
    er_placement placement;
} search;

static void place_search(search *s, const double *x)
{
    double theta[MOST];
    er_angles(s->robot, s->q, x, theta);
    er_place_bodies(s->robot, theta, &s->placement);
    er_static_torque(s->robot, &s->placement, s->gravity, s->wrench, s->torque);
    er_balance_torque(s->robot, s->q, x, s->torque);
}

/* Half width of the backlash, minus infinity for coordinates without. */
static double backlash_or_none(const search *s, int k)
{
    return er_gear_switches(s->gears, k) ? er_gear_half_width(s->gears, k) : -INFINITY;
}

static double softening_of(const search *s, int k)
{
    return s->softening[k * s->m + k];
}

static void begin_search(search *s)
{
    place_search(s, NULL);
    for (int k = 0; k < s->m; k++) {
        bool switching = er_gear_switches(s->gears, k);
        s->neutral[k] = switching && fabs(s->torque[k]) < s->robot->settings.neutral_torque;
        s->x[k] = s->neutral[k] ? 0.0 : er_gear_deflection(s->gears, k, s->torque[k]);
        s->region[k] = s->neutral[k] ? 0 : er_gear_region(s->gears, k, s->x[k]);
    }
}

/* Inside its backlash only the load holds a gear, and one that it hardly holds would be sent round the world
 * by Newton's method, and the other joints along with it: its step is limited.
 *
 * A piece of a spline that is flatter than the load's gradient s would send it back, away from the flank
 * that the load drives the gear to.  Where a load t + s x, t >= 0, rests on the flank
 * k (x - B/2)^2 / (2 B) of a rounded backlash, that is steeper than 2 s. */
static double slope_for_step(const search *s, int k)
{
    double slope = er_gear_slope(s->gears, k, s->region[k], s->x[k]);
    double longest = s->robot->settings.across_backlash * backlash_or_none(s, k);
    if (s->region[k] == 0)
        slope = fmax(fabs(s->torque[k]) / longest + softening_of(s, k), 0.0);
    return er_gear_is_bent(s->gears, k) ? fmax(slope, 2.0 * softening_of(s, k)) : slope;
}

/* Whether the matrix of a step serves the next: no slope changes by itself. */
static bool is_straight(const search *s)
{
    bool straight = true;
    for (int k = 0; k < s->m; k++)
        straight &= !er_gear_is_bent(s->gears, k) && (s->region[k] != 0 || s->neutral[k]);
    return straight;
}

/* Factors of slope - softening; neutral coordinates do not move.  False if singular. */
static bool factorise_slopes(search *s)
{
    int m = s->m;
    er_static_torque_gradient(s->robot, &s->placement, s->gravity, s->wrench, s->softening);
    er_balance_gradient(s->robot, s->q, s->x, s->softening);
    for (int i = 0; i < m; i++) {
        for (int j = 0; j < m; j++)
            s->factors[i * m + j] = s->neutral[i] ? 0.0 : -s->softening[i * m + j];
        s->factors[i * m + i] += s->neutral[i] ? 1.0 : slope_for_step(s, i);
    }
    return er_lu_factor(m, s->factors, s->pivot);
}

/* One Newton step; returns the largest move [rad]. */
static double take_newton_step(search *s)
{
    double step[MOST], largest = 0.0;
    for (int k = 0; k < s->m; k++)
        step[k] = s->neutral[k] ? 0.0
                                : s->torque[k] -
                                      er_gear_torque(s->gears, k, s->region[k], s->x[k]);
    er_lu_solve(s->m, s->factors, s->pivot, step);
    for (int k = 0; k < s->m; k++) {
        s->x[k] += step[k];
        largest = fabs(step[k]) <= largest ? largest : fabs(step[k]); /* NaN stays */
    }
    return largest;
}

/* Takes the branches on which the iterate lies; false if they are the same. */
static bool change_regions(search *s)
{
    bool changed = false;
    for (int k = 0; k < s->m; k++) {
        double width = backlash_or_none(s, k);
        int before = s->region[k], after = before;
        if (s->neutral[k] || !(before * s->x[k] < width))
            continue;
        /* In the gap only the load acts.  Where it drives the gear away from rest, the gear falls
         * through to the other flank. */
        if (before != 0)
            after = softening_of(s, k) < 0.0 ? 0 : -before;
        else if (fabs(s->x[k]) > width)
            after = s->x[k] > 0.0 ? 1 : -1;
        s->region[k] = after;
        changed |= after != before;
    }
    return changed;
}

/* Lets gears go that are loaded in the middle of their backlash now that the others have given way; false
 * if there are none. */
static bool release_loaded_flanks(search *s)
{
    bool released = false;
    for (int k = 0; k < s->m; k++)
        if (s->neutral[k] && fabs(s->torque[k]) >= s->robot->settings.neutral_torque) {
            s->neutral[k] = false;
            s->x[k] = er_gear_deflection(s->gears, k, s->torque[k]);
            s->region[k] = er_gear_region(s->gears, k, s->x[k]);
            released = true;
        }
    return released;
}

/* Takes the flank with less torque for gears that could rest on either; false if they are there. */
static bool take_lighter_flanks(search *s)
{
    bool changed = false;
    for (int k = 0; k < s->m; k++) {
        double width = s->neutral[k] ? 0.0 : fmax(backlash_or_none(s, k), 0.0);
        double across = s->torque[k] - 2.0 * width * s->region[k] * softening_of(s, k);
        if (width > 0.0 && s->region[k] * across < 0.0 && fabs(across) < fabs(s->torque[k])) {
            s->region[k] = -s->region[k];
            changed = true;
        }
    }
    return changed;
}

static bool iterate_to_rest(search *s)
{
    const er_settings *settings = &s->robot->settings;
    bool fresh = false, settled = false;
    double last = INFINITY;
    for (int pass = 0; pass < settings->most_equilibrium_passes; pass++) {
        double largest;
        place_search(s, s->x);
        if (!fresh && !factorise_slopes(s))
            return false;
        fresh = true;
        largest = take_newton_step(s);
        if (!(largest < LONGEST_STEP))
            return false;
        if (change_regions(s)) {
            fresh = false;
        } else if (largest < settings->equilibrium_step) {
            if (release_loaded_flanks(s)) {
                fresh = false;
                continue;
            }
            if (settled || !take_lighter_flanks(s))
                return true;
            fresh = false;
            settled = true;
        } else if (largest > settings->slow_equilibrium * last || !is_straight(s)) {
            fresh = false;
        }
        last = largest;
    }
    return false;
}

/* Whether a robot can bend so far. */
static bool can_bend(const search *s)
{
    for (int k = 0; k < s->m; k++)
        if (!(fabs(s->x[k]) <= s->robot->settings.most_deflection))
            return false;
    return true;
}

static void list_numbers(char *text, size_t room, const char *format, int count, const double *values)
{
    size_t length = 0;
    text[0] = '\0';
    for (int k = 0; k < count && length + 32 < room; k++) {
        length += (size_t)snprintf(text + length, room - length, "%s", k > 0 ? ", " : "");
        length += (size_t)snprintf(text + length, room - length, format, values[k]);
    }
}

/* At rest without a contact: on a spring or elements of hysteresis, or free, where the way downhill leads out of a ring of branches
 * that follow each other. */
static bool rest_apart(search *s, const er_load *load)
{
    if (!er_anchor_holds(&load->anchor) && s->robot->elements == 0) {
        begin_search(s);
        if (iterate_to_rest(s))
            return true;
    }
    return er_anchored_equilibrium(s->robot, s->gears, s->history, s->gravity, s->q, load, s->x);
}

/* A contact that is not touched without it changes nothing. */
static bool rest_under_load(search *s, const er_load *load)
{
    er_load apart = *load;
    double gap[3];
    if (!er_contact_holds(&load->contact))
        return rest_apart(s, load);
    apart.contact.stiffness = 0.0;
    if (rest_apart(s, &apart) && can_bend(s)) {
        place_search(s, s->x);
        er_anchor_gap(&load->anchor, 0.0, s->placement.tool_position, gap);
        if (!(er_contact_touch(&load->contact, gap).depth > 0.0))
            return true;
    }
    return er_anchored_equilibrium(s->robot, s->gears, s->history, s->gravity, s->q, load, s->x);
}

bool er_equilibrium(const er_robot *robot, const er_gears *gears, const er_history *history,
                    const double gravity[3], const double *q, const er_load *load, double *x, er_failure *failure)
{
    search s;
    char posture[400], wrench[200], stiffness[200], anchor[100], spring[400] = "", contact[64] = "";
    s.robot = robot, s.gears = gears, s.gravity = gravity, s.wrench = load->wrench, s.q = q, s.x = x;
    s.history = history;
    s.m = robot->elastics;
    if (s.m == 0)
        return true;
    if (rest_under_load(&s, load) && can_bend(&s))
        return true;
    list_numbers(posture, sizeof posture, "%.4g", robot->joints, q);
    list_numbers(wrench, sizeof wrench, "%.6g", 6, load->wrench);
    list_numbers(stiffness, sizeof stiffness, "%.6g", ER_SYMMETRIC, load->anchor.stiffness);
    list_numbers(anchor, sizeof anchor, "%.6g", 3, load->anchor.position);
    if (er_contact_holds(&load->contact))
        snprintf(contact, sizeof contact, " and a contact of %.6g N/m", load->contact.stiffness);
    if (er_anchor_holds(&load->anchor))
        snprintf(spring, sizeof spring, " and a spring of [%s] N/m anchored at [%s] m", stiffness, anchor);
    return er_fail(failure, "no static equilibrium found at q = [%s] rad under the wrench [%s] N,"
                   " N m%s%s; the joints are too soft for this load", posture, wrench, spring, contact);
}
