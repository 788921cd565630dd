#include "gear.h"

#include <math.h>
#include <string.h>

/* In the order of TORQUE_CURVES. */
enum { LINEAR,
       BACKLASH,
       SPLINE,
       LAWS };
const int er_gear_laws = LAWS;
typedef char laws_fit[LAWS <= ER_MAX_LAWS ? 1 : -1];

/* Newton steps of the inversion inside one cubic piece; it starts in the piece's middle. */
#define INVERSION_STEPS 12
/* Slopes beside a point that differ by less, relative to the largest such sum, have no weights. */
#define AKIMA_CUTOFF 1e-9
/* A jump of the curvature counts from this part of the largest curvature on. */
#define SMALLEST_JUMP 1e-9
/* Distance to a bend that there is not [rad]. */
#define NOWHERE 1.0

bool er_law_switches(int law)
{
    return law != LINEAR;
}

/* Slopes of Akima's curve at its points, from those of the chords (SciPy's Akima1DInterpolator). */
static void akima_slopes(int n, const double *x, const double *y, double *slope)
{
    double chord[ER_MAX_KNOTS + 3], change[ER_MAX_KNOTS + 2], largest = 0.0;
    for (int k = 0; k + 1 < n; k++)
        chord[k + 2] = (y[k + 1] - y[k]) / (x[k + 1] - x[k]);
    chord[1] = 2.0 * chord[2] - chord[3];
    chord[0] = 2.0 * chord[1] - chord[2];
    chord[n + 1] = 2.0 * chord[n] - chord[n - 1];
    chord[n + 2] = 2.0 * chord[n + 1] - chord[n];
    for (int k = 0; k < n + 2; k++)
        change[k] = fabs(chord[k + 1] - chord[k]);
    for (int k = 0; k < n; k++)
        largest = fmax(largest, change[k] + change[k + 2]);
    for (int k = 0; k < n; k++) {
        double sum = change[k] + change[k + 2];
        slope[k] = 0.5 * (chord[k + 3] + chord[k]);
        if (sum > AKIMA_CUTOFF * largest)
            slope[k] = chord[k + 1] + change[k] / sum * (chord[k + 2] - chord[k + 1]);
    }
}

/* Fits the cubics to the points in knot and value. */
static void fit_spline(er_spline *s)
{
    double slope[ER_MAX_KNOTS] = {0.0};
    int n = s->points;
    akima_slopes(n, s->knot, s->value, slope);
    memset(s->cubic, 0, sizeof s->cubic);
    s->start[0] = s->knot[0];
    for (int k = 0; k < n; k++) {
        double *c = s->cubic[k + 1];
        s->start[k + 1] = s->knot[k];
        c[0] = s->value[k];
        c[1] = slope[k];
        if (k + 1 < n) {
            double width = s->knot[k + 1] - s->knot[k];
            double chord = (s->value[k + 1] - s->value[k]) / width;
            double bend = (slope[k] + slope[k + 1] - 2.0 * chord) / width;
            c[2] = (chord - slope[k]) / width - bend;
            c[3] = bend / width;
        }
    }
    s->cubic[0][0] = s->value[0];
    s->cubic[0][1] = slope[0];
}

/* Zero up to B/2, a parabola to 3B/2, then the line k (|x| - B): points B/2 apart. */
static void rounded_backlash(er_spline *s, double stiffness, double backlash)
{
    static const double torque[6] = {0.0, 0.0, 0.25, 1.0, 2.0, 3.0};
    double half = 0.5 * backlash;
    s->points = 11;
    for (int k = -5; k <= 5; k++) {
        s->knot[k + 5] = half * k;
        s->value[k + 5] = copysign(stiffness * half * torque[k < 0 ? -k : k], k);
    }
}

static void build_spline(er_gears *gears, int k, const er_table *table)
{
    er_spline *s = &gears->spline[k];
    s->points = 0;
    if (table->points > 0) {
        s->points = table->points;
        memcpy(s->knot, table->angle, sizeof s->knot);
        memcpy(s->value, table->torque, sizeof s->value);
    } else if (gears->backlash[k] > 0.0) {
        rounded_backlash(s, gears->stiffness[k], gears->backlash[k]);
        gears->half_width[k] = 0.5 * gears->backlash[k];
    }
    if (s->points > 0)
        fit_spline(s);
}

void er_gears_build(er_gears *gears, int law, const er_robot *robot, const er_parameters *parameters)
{
    gears->law = law;
    gears->count = robot->elastics;
    for (int d = 0; d < robot->motors; d++)
        gears->slip_torque[robot->elastics + d] = parameters->friction[d];
    for (int k = 0; k < gears->count; k++) {
        gears->stiffness[k] = parameters->stiffness[k];
        gears->damping[k] = parameters->damping[k];
        gears->backlash[k] = law == LINEAR ? 0.0 : parameters->backlash[k];
        gears->half_width[k] = INFINITY;
        gears->slip_torque[k] = parameters->hysteresis[k];
        gears->spline[k].points = 0;
        if (law == SPLINE)
            build_spline(gears, k, &robot->table[k]);
        else if (gears->backlash[k] > 0.0)
            gears->half_width[k] = gears->backlash[k];
    }
}

/* The piece that holds at x: 0 below the first point, `points` above the last. */
static int piece_at(const er_spline *s, double x)
{
    int piece = 0;
    while (piece < s->points && x > s->knot[piece])
        piece++;
    return piece;
}

double er_spline_torque(const er_gears *gears, int k, double x)
{
    const er_spline *s = &gears->spline[k];
    int piece = piece_at(s, x);
    const double *c = s->cubic[piece];
    double t = x - s->start[piece];
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]));
}

double er_spline_slope(const er_gears *gears, int k, double x)
{
    const er_spline *s = &gears->spline[k];
    int piece = piece_at(s, x);
    const double *c = s->cubic[piece];
    double t = x - s->start[piece];
    return c[1] + t * (2.0 * c[2] + 3.0 * t * c[3]);
}

double er_gear_flank_slope(const er_gears *gears, int k, double x)
{
    const er_spline *s = &gears->spline[k];
    double slope;
    if (s->points == 0)
        return gears->stiffness[k];
    slope = er_gear_slope(gears, k, 1, x);
    return slope > 0.0 ? slope : s->cubic[s->points][1];
}

double er_gear_flank_curvature(const er_gears *gears, int k, double x)
{
    const er_spline *s = &gears->spline[k];
    int piece;
    if (s->points == 0 || !(er_gear_slope(gears, k, 1, x) > 0.0))
        return 0.0;
    piece = piece_at(s, x);
    return 2.0 * s->cubic[piece][2] + 6.0 * s->cubic[piece][3] * (x - s->start[piece]);
}

/* Of the rounded backlash S is k B times a function of x / B. */
double er_gear_along(const er_gears *gears, int k, int region, double x, double stiffness, double backlash)
{
    double torque = er_gear_torque(gears, k, region, x), flank = gears->stiffness[k], of_backlash;
    if (region == 0 || (gears->spline[k].points > 0 && !er_gear_switches(gears, k)))
        return 0.0;
    if (gears->spline[k].points > 0)
        of_backlash = (torque - x * er_spline_slope(gears, k, x)) / gears->backlash[k];
    else if (gears->law == LINEAR || (gears->backlash[k] == 0.0 && x == 0.0))
        of_backlash = 0.0;
    else /* without backlash the region is 1: one that opens */
        of_backlash = -copysign(flank, gears->backlash[k] > 0.0 ? region : x);
    return torque / flank * stiffness + of_backlash * backlash;
}

double er_gear_flank_slope_along(const er_gears *gears, int k, double x, double stiffness, double backlash)
{
    if (gears->spline[k].points == 0)
        return stiffness;
    if (!er_gear_switches(gears, k))
        return 0.0;
    return er_gear_flank_slope(gears, k, x) / gears->stiffness[k] * stiffness -
           er_gear_flank_curvature(gears, k, x) * x / gears->backlash[k] * backlash;
}

static double spline_deflection(const er_spline *s, double torque)
{
    int piece = 0;
    double t, longest, floor_slope = 1e-6 * s->cubic[s->points][1];
    const double *c;
    bool inner;
    while (piece < s->points && torque > s->value[piece])
        piece++;
    c = s->cubic[piece];
    inner = piece > 0 && piece < s->points;
    longest = inner ? s->knot[piece] - s->start[piece] : 0.0;
    t = 0.5 * longest;
    for (int pass = 0; pass < INVERSION_STEPS; pass++) {
        double value = c[0] + t * (c[1] + t * (c[2] + t * c[3]));
        double slope = c[1] + t * (2.0 * c[2] + 3.0 * t * c[3]);
        t -= (value - torque) / fmax(slope, floor_slope);
        if (inner)
            t = fmin(fmax(t, 0.0), longest);
    }
    return s->start[piece] + t;
}

double er_gear_deflection(const er_gears *gears, int k, double torque)
{
    if (torque == 0.0 && (gears->spline[k].points == 0 || er_gear_switches(gears, k)))
        return 0.0;
    if (gears->spline[k].points > 0)
        return spline_deflection(&gears->spline[k], torque);
    return torque / gears->stiffness[k] + copysign(gears->backlash[k], torque);
}

int er_gear_region(const er_gears *gears, int k, double x)
{
    double width = gears->half_width[k];
    if (!er_gear_switches(gears, k))
        return 1;
    return x > width ? 1 : x < -width ? -1
                                      : 0;
}

double er_gear_slack(const er_gears *gears, const er_settings *settings, int k, double tolerance)
{
    return fmin(settings->slack * tolerance, settings->slack_of_width * gears->half_width[k]);
}

void er_gear_edges(const er_gears *gears, const er_settings *settings, int k, int region, double tolerance,
                   double edge[2])
{
    double width = gears->half_width[k], beyond = er_gear_slack(gears, settings, k, tolerance);
    edge[0] = region < 0 ? -INFINITY : (region == 0 ? -width : width) - beyond;
    edge[1] = region > 0 ? INFINITY : (region == 0 ? width : -width) + beyond;
}

static double spline_curvature(const er_spline *s, int piece, double x)
{
    const double *c = s->cubic[piece];
    return 2.0 * c[2] + 6.0 * c[3] * (x - s->start[piece]);
}

static void find_spline_bends(const er_spline *s, er_bends *bends)
{
    double extent = s->knot[s->points - 1] - s->knot[0];
    double largest = fabs(s->value[s->points - 1] - s->value[0]) / (extent * extent);
    for (int k = 0; k < s->points; k++) {
        largest = fmax(largest, fabs(spline_curvature(s, k, s->knot[k])));
        largest = fmax(largest, fabs(spline_curvature(s, k + 1, s->knot[k])));
    }
    for (int k = 0; k < s->points; k++) {
        double jump = spline_curvature(s, k + 1, s->knot[k]) - spline_curvature(s, k, s->knot[k]);
        if (fabs(jump) > SMALLEST_JUMP * largest)
            bends->angle[bends->count++] = s->knot[k];
    }
}

void er_bends_find(const er_gears *gears, int k, er_bends *bends)
{
    bends->count = 0;
    if (gears->spline[k].points > 0) {
        find_spline_bends(&gears->spline[k], bends);
    } else if (er_gear_switches(gears, k)) {
        bends->count = 2;
        bends->angle[0] = -gears->half_width[k];
        bends->angle[1] = gears->half_width[k];
    }
}

int er_bends_piece(const er_bends *bends, int piece, double x, double slack)
{
    if (piece > bends->count) /* of another curve */
        piece = bends->count;
    while (piece < bends->count && x - bends->angle[piece] >= slack)
        piece++;
    while (piece > 0 && bends->angle[piece - 1] - x >= slack)
        piece--;
    return piece;
}

void er_bends_distance(const er_bends *bends, int piece, double x, double slack, double distance[2])
{
    distance[0] = piece > 0 ? x - bends->angle[piece - 1] + slack : NOWHERE;
    distance[1] = piece < bends->count ? bends->angle[piece] - x + slack : NOWHERE;
}

void er_bends_distance_along(const er_bends *bends, int piece, double x_change, double wider, double slack,
                             double distance[2])
{
    slack *= wider;
    distance[0] = piece > 0 ? x_change - wider * bends->angle[piece - 1] + slack : 0.0;
    distance[1] = piece < bends->count ? wider * bends->angle[piece] - x_change + slack : 0.0;
}
