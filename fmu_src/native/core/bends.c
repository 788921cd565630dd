#include "bends.h"

#include <math.h>

/* A jump of the curvature counts from this part of the largest curvature on. */
#define SMALLEST_JUMP 1e-9
/* Distance to a bend that there is not [rad]. */
#define NOWHERE 1.0

static double curvature(const er_spline *s, int piece, double x)
{
    const double *c = s->cubic[piece];
    return 2.0 * c[2] + 6.0 * c[3] * (x - s->start[piece]);
}

static void find_in_spline(const er_spline *s, er_bends *bends)
{
    double extent = s->knot[s->points - 1] - s->knot[0];
    double largest = fabs(s->value[s->points - 1] - s->value[0]) / (extent * extent);
    for (int k = 0; k < s->points; k++) {
        largest = fmax(largest, fabs(curvature(s, k, s->knot[k])));
        largest = fmax(largest, fabs(curvature(s, k + 1, s->knot[k])));
    }
    for (int k = 0; k < s->points; k++) {
        double jump = curvature(s, k + 1, s->knot[k]) - curvature(s, k, s->knot[k]);
        if (fabs(jump) > SMALLEST_JUMP * largest)
            bends->angle[bends->count++] = s->knot[k];
    }
}

void er_bends_find(const er_curve *curve, int k, er_bends *bends)
{
    bends->count = 0;
    if (curve->spline[k].points > 0) {
        find_in_spline(&curve->spline[k], bends);
    } else if (er_curve_switches(curve, k)) {
        bends->count = 2;
        bends->angle[0] = -curve->half_width[k];
        bends->angle[1] = curve->half_width[k];
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
