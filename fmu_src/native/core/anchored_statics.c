/* Newton's method with the slopes of the present x and an exact line search where a gear changes its
 * flank; docs/model.md has the rules.  Without memory, as er_equilibrium is. */
#include "anchored_statics.h"

#include <math.h>
#include <string.h>

#include "linear.h"
#include "vector.h"

/* A step longer than this [rad] is no deflection any more. */
#define LONGEST_STEP 3.14159265358979
#define MOST_PASSES 200
/* Newton's method ends when no coordinate moves by more [rad]. */
#define SMALLEST_STEP 1e-13
/* Where a gear rests at the edge of its play, steps lead from side to side of the kink; after so many
 * passes a residual of this size is rest [N m]. */
#define PATIENT_PASSES 60
#define NEGLIGIBLE_TORQUE 1e-6
/* The line search ends at this part of the first slope along the step, or after so many trials. */
#define SEARCHED 0.1
#define MOST_TRIALS 30
/* A gear may rest on its other flank as well if its torque is less than its play and the load's gradient
 * give it across, with room for what the other joints do. */
#define ROOM 6.0

enum { MOST = ER_MAX_ANGLES };

/* An equilibrium in the making; one entry per elastic coordinate. */
typedef struct {
    const er_robot *robot;
    const er_curve *curve;
    const double *gravity, *q;
    const er_load *load;
    int m;
    bool neutral[MOST];            /* not supported and not loaded: stays in the middle of its play */
    double x[MOST];
    double torque[MOST];           /* that must be carried [N m] */
    double residual[MOST];         /* torque minus that of the curve [N m] */
    double softening[MOST * MOST]; /* gradient of the torque of wrench, pull and weight [N m/rad] */
    double support[MOST * MOST];   /* J_p^T K J_p [N m/rad] */
    er_placement placement;
} search;

void er_add_anchor(const er_robot *robot, const er_placement *placement, const er_anchor *anchor,
                   double *matrix)
{
    int m = robot->elastics;
    for (int i = 0; i < m; i++) {
        double pull[3];
        er_anchor_times(anchor->stiffness, placement->lever[robot->elastic_angle[i]], pull);
        for (int j = 0; j < m; j++)
            matrix[i * m + j] += er_dot(pull, placement->lever[robot->elastic_angle[j]]);
    }
}

/* Half width of the play; 0 for coordinates without. */
static double half_width(const search *s, int k)
{
    return er_curve_switches(s->curve, k) ? s->curve->half_width[k] : 0.0;
}

static int region(const search *s, int k, double x)
{
    return er_curve_region(s->curve, k, x);
}

/* Torque and residual at x. */
static void place_at(search *s, const double *x)
{
    double theta[MOST], wrench[6];
    er_angles(s->robot, s->q, x, theta);
    er_place_bodies(s->robot, theta, &s->placement);
    er_load_wrench(s->load, s->placement.tool_position, wrench);
    er_static_torque(s->robot, &s->placement, s->gravity, wrench, s->torque);
    for (int k = 0; k < s->m; k++)
        s->residual[k] = s->neutral[k] ? 0.0
                                       : s->torque[k] - er_curve_torque(s->curve, k,
                                                                        region(s, k, x[k]), x[k]);
}

/* Gradients there. */
static void find_gradients(search *s)
{
    double wrench[6];
    er_load_wrench(s->load, s->placement.tool_position, wrench);
    er_static_torque_gradient(s->robot, &s->placement, s->gravity, wrench, s->softening);
    memset(s->support, 0, (size_t)(s->m * s->m) * sizeof *s->support);
    er_add_anchor(s->robot, &s->placement, &s->load->anchor, s->support);
}

/* A gear that neither load nor spring moves in its play stays in the middle; the others start on the
 * flank that the load pushes them to, bent as flanks and spring let them. */
static bool begin(search *s)
{
    double stiffness[MOST * MOST];
    int m = s->m, pivot[MOST];
    memset(s->x, 0, sizeof s->x);
    memset(s->neutral, 0, sizeof s->neutral);
    place_at(s, s->x);
    find_gradients(s);
    memcpy(stiffness, s->support, sizeof stiffness);
    memcpy(s->x, s->torque, sizeof s->x);
    for (int k = 0; k < m; k++) {
        double least = s->robot->settings.neutral_torque;
        s->neutral[k] = er_curve_switches(s->curve, k) && fabs(s->torque[k]) < least &&
                        s->support[k * m + k] * half_width(s, k) < least;
        stiffness[k * m + k] += er_curve_flank_slope(s->curve, k, 0.0);
    }
    if (!er_lu_factor(m, stiffness, pivot))
        return false;
    er_lu_solve(m, stiffness, pivot, s->x);
    for (int k = 0; k < m; k++)
        s->x[k] = s->neutral[k] ? 0.0 : s->x[k] + (s->x[k] > 0.0 ? 1.0 : -1.0) * half_width(s, k);
    return true;
}

/* In its play a gear has no slope of its own: one that is hardly supported would be sent round the world
 * by Newton's method; so is one at the foot of a rounded flank. */
static double slope_for_step(const search *s, int k)
{
    int at = region(s, k, s->x[k]);
    double slope = er_curve_slope(s->curve, k, at, s->x[k]), limiting;
    if (!er_curve_switches(s->curve, k))
        return slope;
    limiting = fabs(s->residual[k]) / (2.0 * half_width(s, k));
    if (at == 0)
        return limiting + fmax(s->softening[k * s->m + k], 0.0);
    return fmax(slope, fmin(limiting, er_curve_flank_slope(s->curve, k, s->x[k])));
}

/* Newton's step [rad]; false if the matrix is singular. */
static bool find_step(search *s, double *step)
{
    double matrix[MOST * MOST];
    int m = s->m, pivot[MOST];
    for (int i = 0; i < m; i++) {
        for (int j = 0; j < m; j++)
            matrix[i * m + j] =
                s->neutral[i] ? 0.0 : s->support[i * m + j] - s->softening[i * m + j];
        matrix[i * m + i] += s->neutral[i] ? 1.0 : slope_for_step(s, i);
    }
    memcpy(step, s->residual, (size_t)m * sizeof *step);
    if (!er_lu_factor(m, matrix, pivot))
        return false;
    er_lu_solve(m, matrix, pivot, step);
    return true;
}

/* The residual along a step, from x + part step on: minus the slope of the energy. */
static double slope_along(search *s, const double *step, double part)
{
    double x[MOST], sum = 0.0;
    for (int k = 0; k < s->m; k++)
        x[k] = s->x[k] + part * step[k];
    place_at(s, x);
    for (int k = 0; k < s->m; k++)
        sum += s->residual[k] * step[k];
    return sum;
}

/* The part of a step up to which the energy falls. */
static double find_part(search *s, const double *step, double first)
{
    double low = 0.0, high = 1.0, at_low = first, at_high = slope_along(s, step, 1.0), part = 1.0;
    if (!(at_high < -1e-3 * fabs(first)))
        return 1.0;
    for (int trial = 0; trial < MOST_TRIALS; trial++) {
        double at;
        part = low + (high - low) * fmin(fmax(at_low / (at_low - at_high), 0.1), 0.9);
        at = slope_along(s, step, part);
        if (fabs(at) < SEARCHED * fabs(first))
            break;
        if (at > 0.0)
            low = part, at_low = at;
        else
            high = part, at_high = at;
    }
    return part;
}

/* Lets gears go that are loaded in the middle of their play now that the others have given way; false
 * if there are none. */
static bool release_loaded(search *s)
{
    bool released = false;
    for (int k = 0; k < s->m; k++)
        released |= s->neutral[k] && fabs(s->torque[k]) >= s->robot->settings.neutral_torque;
    if (released)
        memset(s->neutral, 0, sizeof s->neutral);
    return released;
}

/* Newton's method from x; false if it finds no rest. */
static bool descend(search *s)
{
    for (int pass = 0; pass < MOST_PASSES; pass++) {
        double step[MOST], largest = 0.0, residual = 0.0, first = 0.0, part = 1.0;
        bool changes = false;
        place_at(s, s->x);
        find_gradients(s);
        if (!find_step(s, step))
            return false;
        for (int k = 0; k < s->m; k++) {
            largest = fabs(step[k]) <= largest ? largest : fabs(step[k]); /* NaN stays */
            residual = fmax(residual, fabs(s->residual[k]));
            first += s->residual[k] * step[k];
            changes |= region(s, k, s->x[k]) != region(s, k, s->x[k] + step[k]);
        }
        if (!(largest < LONGEST_STEP))
            return false;
        if (changes && largest > SMALLEST_STEP)
            part = find_part(s, step, first);
        for (int k = 0; k < s->m; k++)
            s->x[k] += part * step[k];
        if (largest < SMALLEST_STEP || (pass > PATIENT_PASSES && residual < NEGLIGIBLE_TORQUE)) {
            place_at(s, s->x);
            if (!release_loaded(s))
                return true;
        }
    }
    return false;
}

static double distance(const search *s)
{
    double gap[3];
    er_anchor_gap(&s->load->anchor, 0.0, s->placement.tool_position, gap);
    return sqrt(er_dot(gap, gap));
}

/* Whether coordinate k, on a flank, may rest on the other one as well: its load drives it off the middle
 * of its play, and the spring does not hold it there. */
static bool may_change(const search *s, int k)
{
    double net = s->softening[k * s->m + k] - s->support[k * s->m + k];
    return er_curve_switches(s->curve, k) && region(s, k, s->x[k]) != 0 && net > 0.0 &&
           fabs(s->torque[k]) < ROOM * half_width(s, k) * net;
}

/* Of two flanks the one that leaves the TCP nearer to the anchor. */
static void take_nearer_flanks(search *s)
{
    search *at = s;
    bool open[MOST];
    for (int k = 0; k < s->m; k++)
        open[k] = may_change(s, k);
    for (int k = 0; k < s->m; k++) {
        search other;
        int before = region(s, k, s->x[k]);
        if (!open[k])
            continue;
        other = *at;
        memset(other.neutral, 0, sizeof other.neutral);
        other.x[k] = -other.x[k];
        if (descend(&other) && region(&other, k, other.x[k]) == -before &&
            distance(&other) < distance(at))
            *at = other;
    }
}

bool er_anchored_equilibrium(const er_robot *robot, const er_curve *curve, const double gravity[3],
                             const double *q, const er_load *load, double *x)
{
    search s;
    s.robot = robot, s.curve = curve, s.gravity = gravity, s.load = load, s.q = q;
    s.m = robot->elastics;
    if (!begin(&s) || !descend(&s))
        return false;
    take_nearer_flanks(&s);
    memcpy(x, s.x, (size_t)s.m * sizeof *x);
    return true;
}
