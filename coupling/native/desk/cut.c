#include "cut.h"

#include <math.h>
#include <string.h>

#define TURN 6.283185307179586477
#define NODES 12

/* Gauss points along the engaged part of an edge, one half of them, and their weights. */
static const double NODE[NODES / 2] = {0.1252334085114689, 0.3678314989981802, 0.5873179542866175,
                                       0.7699026741943047, 0.9041172563704749, 0.9815606342467193};
static const double WEIGHT[NODES / 2] = {0.2491470458134028, 0.2334925365383548, 0.2031674267230659,
                                         0.1600783285433462, 0.1069393259953184, 0.0471753363865118};

/* Position on the way at a time, found from where the last search ended. */
static void position_at(int64_t rows, const double *time, const double *way, double at, int64_t *row, double *place)
{
    int64_t k = *row;
    if (at <= time[0] || rows == 1) {
        place[0] = way[0];
        place[1] = way[1];
        return;
    }
    while (k + 2 < rows && time[k + 1] < at)
        k++;
    while (k > 0 && time[k] > at)
        k--;
    *row = k;
    double part = (at - time[k]) / (time[k + 1] - time[k]);
    if (part > 1.0)
        part = 1.0;
    for (int i = 0; i < 2; i++)
        place[i] = way[2 * k + i] + part * (way[2 * (k + 1) + i] - way[2 * k + i]);
}

/* Add the wrench of an edge between two heights; `since`: way since the passes before, along the feed and to its left;
 * `ploughs`: part of its edge force that acts. */
static void add_edge(const er_mill *mill, int64_t tooth, double tip, double low, double high, const double *since,
                     double ploughs, double *wrench)
{
    const double *K = mill->coefficients;
    const double *further = mill->further + 2 * mill->passes * tooth;
    for (int node = 0; node < NODES; node++) {
        double place = node < NODES / 2 ? -NODE[node] : NODE[node - NODES / 2];
        double weight = 0.5 * (high - low) * WEIGHT[node % (NODES / 2)];
        double height = low + 0.5 * (1.0 + place) * (high - low), behind = mill->lag * height;
        double phi = tip - behind, s = sin(phi), c = cos(phi);
        double turned_c = cos(behind), turned_s = sin(behind), chip = INFINITY;
        for (int64_t pass = 0; pass < mill->passes; pass++) {
            double h = since[2 * pass] * s + since[2 * pass + 1] * c + further[2 * pass] * turned_c +
                       further[2 * pass + 1] * turned_s;
            if (h < chip)
                chip = h;
        }
        if (chip <= -mill->rubs)
            continue;
        double share = ploughs * (chip >= 0.0 ? 1.0 : 1.0 + chip / mill->rubs), cut = chip > 0.0 ? chip : 0.0;
        double tangential = weight * (K[0] * cut + share * K[3]), radial = weight * (K[1] * cut + share * K[4]);
        double axial = weight * (K[2] * cut + share * K[5]);
        double along = -tangential * c - radial * s, across = tangential * s - radial * c;
        wrench[0] += along;
        wrench[1] += across;
        wrench[2] -= axial; /* a right-hand helix is pulled into the work */
        wrench[3] += -height * across - mill->radius * c * axial;
        wrench[4] += height * along + mill->radius * s * axial;
        wrench[5] += mill->radius * tangential;
    }
}

static double within(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

void er_mill_wrench(const er_mill *mill, const er_engagement *cut, int64_t rows, const double *way_time,
                    const double *way, double *wrench)
{
    memset(wrench, 0, (size_t)cut->count * 6 * sizeof(double));
    for (int64_t tooth = 0; tooth < mill->teeth; tooth++) {
        int64_t now_row = 0, row[ER_MOST_PASSES] = {0};
        for (int64_t k = 0; k < cut->count; k++) {
            const double *start = cut->start + k * cut->arcs, *end = cut->end + k * cut->arcs;
            const double *depth = cut->depth + k * cut->arcs, *f = cut->feed + 2 * k;
            double deepest = 0.0;
            for (int64_t arc = 0; arc < cut->arcs; arc++)
                if (end[arc] > start[arc] && depth[arc] > deepest)
                    deepest = depth[arc];
            if (!(deepest > 0.0))
                continue;
            double tip = fmod(mill->speed * cut->time[k] + mill->tip[tooth], TURN);
            if (tip < 0.0)
                tip += TURN;
            double now[2], since[2 * ER_MOST_PASSES];
            position_at(rows, way_time, way, cut->time[k], &now_row, now);
            for (int64_t pass = 0; pass < mill->passes; pass++) {
                double before[2], delay = mill->delay[mill->passes * tooth + pass];
                position_at(rows, way_time, way, cut->time[k] - delay, &row[pass], before);
                double x = now[0] - before[0], y = now[1] - before[1];
                since[2 * pass] = x * f[0] + y * f[1];
                since[2 * pass + 1] = y * f[0] - x * f[1];
            }
            int64_t turns = (int64_t)ceil(mill->lag * deepest / TURN);
            for (int64_t turn = 0; turn <= turns; turn++)
                for (int64_t arc = 0; arc < cut->arcs; arc++) {
                    double behind = tip + TURN * (double)turn, low = 0.0, high = 0.0;
                    if (mill->lag > 0.0) { /* further up an edge may be a whole turn behind */
                        low = within((behind - end[arc]) / mill->lag, 0.0, depth[arc]);
                        high = within((behind - start[arc]) / mill->lag, 0.0, depth[arc]);
                    } else if (turn == 0 && start[arc] <= tip && tip <= end[arc])
                        high = depth[arc];
                    if (high > low)
                        add_edge(mill, tooth, tip, low, high, since, cut->share[k], wrench + 6 * k);
                }
        }
    }
}
