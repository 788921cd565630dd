#include "curves.h"

#include <math.h>
#include <string.h>

/* Newton steps of the inversion inside one cubic piece; it starts in the piece's middle. */
#define INVERSION_STEPS 12
/* Slopes beside a point that differ by less, relative to the largest such sum, have no weights. */
#define AKIMA_CUTOFF 1e-9

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
static void rounded_dead_band(er_spline *s, double stiffness, double backlash)
{
    static const double torque[6] = {0.0, 0.0, 0.25, 1.0, 2.0, 3.0};
    double half = 0.5 * backlash;
    s->points = 11;
    for (int k = -5; k <= 5; k++) {
        s->knot[k + 5] = half * k;
        s->value[k + 5] = copysign(stiffness * half * torque[k < 0 ? -k : k], k);
    }
}

static void build_spline(er_curve *curve, int k, const er_table *table)
{
    er_spline *s = &curve->spline[k];
    s->points = 0;
    if (table->points > 0) {
        s->points = table->points;
        memcpy(s->knot, table->angle, sizeof s->knot);
        memcpy(s->value, table->torque, sizeof s->value);
    } else if (curve->backlash[k] > 0.0) {
        rounded_dead_band(s, curve->stiffness[k], curve->backlash[k]);
        curve->half_width[k] = 0.5 * curve->backlash[k];
    }
    if (s->points > 0)
        fit_spline(s);
}

void er_curve_build(er_curve *curve, er_curve_kind kind, const er_robot *robot,
                    const er_parameters *parameters)
{
    curve->kind = kind;
    curve->count = robot->elastics;
    for (int k = 0; k < curve->count; k++) {
        curve->stiffness[k] = parameters->stiffness[k];
        curve->backlash[k] = kind == ER_LINEAR ? 0.0 : parameters->backlash[k];
        curve->half_width[k] = INFINITY;
        curve->spline[k].points = 0;
        if (kind == ER_SPLINE)
            build_spline(curve, k, &robot->table[k]);
        else if (curve->backlash[k] > 0.0)
            curve->half_width[k] = curve->backlash[k];
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

double er_spline_torque(const er_curve *curve, int k, double x)
{
    const er_spline *s = &curve->spline[k];
    int piece = piece_at(s, x);
    const double *c = s->cubic[piece];
    double t = x - s->start[piece];
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]));
}

double er_spline_slope(const er_curve *curve, int k, double x)
{
    const er_spline *s = &curve->spline[k];
    int piece = piece_at(s, x);
    const double *c = s->cubic[piece];
    double t = x - s->start[piece];
    return c[1] + t * (2.0 * c[2] + 3.0 * t * c[3]);
}

double er_curve_flank_slope(const er_curve *curve, int k, double x)
{
    const er_spline *s = &curve->spline[k];
    double slope;
    if (s->points == 0)
        return curve->stiffness[k];
    slope = er_curve_slope(curve, k, 1, x);
    return slope > 0.0 ? slope : s->cubic[s->points][1];
}

double er_curve_flank_curvature(const er_curve *curve, int k, double x)
{
    const er_spline *s = &curve->spline[k];
    int piece;
    if (s->points == 0 || !(er_curve_slope(curve, k, 1, x) > 0.0))
        return 0.0;
    piece = piece_at(s, x);
    return 2.0 * s->cubic[piece][2] + 6.0 * s->cubic[piece][3] * (x - s->start[piece]);
}

/* Of the rounded dead band S is k B times a function of x / B. */
double er_curve_along(const er_curve *curve, int k, int region, double x, double stiffness,
                      double backlash)
{
    double torque = er_curve_torque(curve, k, region, x), flank = curve->stiffness[k], of_backlash;
    if (region == 0 || (curve->spline[k].points > 0 && !er_curve_switches(curve, k)))
        return 0.0;
    if (curve->spline[k].points > 0)
        of_backlash = (torque - x * er_spline_slope(curve, k, x)) / curve->backlash[k];
    else if (curve->kind == ER_LINEAR || (curve->backlash[k] == 0.0 && x == 0.0))
        of_backlash = 0.0;
    else /* without play the region is 1: one that opens */
        of_backlash = -copysign(flank, curve->backlash[k] > 0.0 ? region : x);
    return torque / flank * stiffness + of_backlash * backlash;
}

double er_curve_flank_slope_along(const er_curve *curve, int k, double x, double stiffness,
                                  double backlash)
{
    if (curve->spline[k].points == 0)
        return stiffness;
    if (!er_curve_switches(curve, k))
        return 0.0;
    return er_curve_flank_slope(curve, k, x) / curve->stiffness[k] * stiffness -
           er_curve_flank_curvature(curve, k, x) * x / curve->backlash[k] * backlash;
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

double er_curve_deflection(const er_curve *curve, int k, double torque)
{
    if (torque == 0.0 && (curve->spline[k].points == 0 || er_curve_switches(curve, k)))
        return 0.0;
    if (curve->spline[k].points > 0)
        return spline_deflection(&curve->spline[k], torque);
    return torque / curve->stiffness[k] + copysign(curve->backlash[k], torque);
}

int er_curve_region(const er_curve *curve, int k, double x)
{
    double width = curve->half_width[k];
    if (!er_curve_switches(curve, k))
        return 1;
    return x > width ? 1 : x < -width ? -1 : 0;
}
