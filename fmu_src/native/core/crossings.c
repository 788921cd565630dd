#include "step.h"

#include <math.h>
#include <string.h>

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
