#include "gear_path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Changes of piece within a sample, beyond which the gear is taken to rest where it is; and steps to one. */
enum { MOST_CHANGES = 500, MOST_STEPS = 100 };

/* Narrowest piece [rad]: far above rounding, worth micronewton metres. */
static const double narrow = 1e-12;

/* A gear on its way. */
typedef struct {
    const er_gear_law *spring;
    const er_gear_elements *elements;
    er_gear_law law; /* its corners stand in the memory of `angle` and so on */
    double *angle, *torque, *slope;
    double *elongation, turned; /* of the elements where it last turned */
    double damping, spacing;
    int64_t piece, weighted;    /* where it is; the piece of the weights of a whole sample */
    double first, second;
} gear;

static double clipped(double value, double most)
{
    return fmin(fmax(value, -most), most);
}

/* Torque of a law at an angle; `piece` goes up to that of the angle. */
static double torque_of(const er_gear_law *law, double angle, int64_t *piece)
{
    while (*piece < law->corners && angle > law->angle[*piece])
        ++*piece;
    int64_t corner = *piece > 0 ? *piece - 1 : 0;
    return law->torque[corner] + law->slope[*piece] * (angle - law->angle[corner]);
}

static double torque_of_elements(const er_gear_elements *elements, double moved, const double *elongation)
{
    double sum = 0.0;
    for (int64_t j = 0; j < elements->count; j++) {
        double a = elements->slip_angle[j];
        sum += elements->slip_torque[j] / a * clipped(elongation[j] + moved, a);
    }
    return sum;
}

static int rising(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int64_t er_gear_law_with_elements(const er_gear_law *spring, const er_gear_elements *elements, double start,
                                  const double *elongation, double *angle, double *torque, double *slope)
{
    int64_t all = spring->corners, count = 0, piece = 0;
    double end, before;
    memcpy(angle, spring->angle, (size_t)all * sizeof *angle);
    for (int64_t j = 0; j < elements->count; j++) {
        angle[all++] = start - elongation[j] + elements->slip_angle[j];
        angle[all++] = start - elongation[j] - elements->slip_angle[j];
    }
    qsort(angle, (size_t)all, sizeof *angle, rising);
    before = -INFINITY;
    for (int64_t k = 0; k < all; k++) {
        double corner = angle[k];
        if (corner - before > narrow)
            angle[count++] = corner;
        before = corner;
    }
    if (count == 0) /* nothing is a number */
        count = 1;
    end = angle[0] - 1.0;
    before = torque_of(spring, end, &piece) + torque_of_elements(elements, end - start, elongation);
    for (int64_t k = 0; k < count; end = angle[k++]) {
        torque[k] = torque_of(spring, angle[k], &piece) + torque_of_elements(elements, angle[k] - start, elongation);
        slope[k] = (torque[k] - before) / (angle[k] - end);
        before = torque[k];
    }
    end = angle[count - 1] + 1.0;
    slope[count] = torque_of(spring, end, &piece) + torque_of_elements(elements, end - start, elongation) - before;
    return count;
}

static double offset_of(const er_gear_law *law, int64_t piece)
{
    int64_t corner = piece > 0 ? piece - 1 : 0;
    return law->torque[corner] - law->slope[piece] * law->angle[corner];
}

/* psi_1 [s] and psi_2 [s^2] of a slope. */
static void find_weights(const gear *g, double slope, double time, double *first, double *second)
{
    double rate = slope / g->damping;
    if (rate * time < 1e-4) {
        *first = time * (1.0 - 0.5 * rate * time);
        *second = time * time * (0.5 - rate * time / 6.0);
    } else {
        *first = -expm1(-rate * time) / rate;
        *second = (time - *first) / rate;
    }
}

/* The piece at an angle; on a corner that into which the gear moves, at rest the upper one. */
static int64_t piece_of(const er_gear_law *law, double angle, const double *torque, int64_t count)
{
    int64_t low = 0, high = law->corners;
    while (low < high) {
        int64_t middle = (low + high) / 2;
        if (law->angle[middle] <= angle)
            low = middle + 1;
        else
            high = middle;
    }
    if (low > 0 && law->angle[low - 1] == angle)
        for (int64_t k = 0; k < (count < 2 ? count : 2); k++)
            if (torque[k] != law->torque[low - 1])
                return torque[k] > law->torque[low - 1] ? low : low - 1;
    return low;
}

/* When an angle that is off an edge now, and on its other side, `last`, after a time, comes to it: Newton's method
 * within what encloses it. */
static double time_of_arrival(const gear *g, double slope, double off, double speed, double rate, double time, double last)
{
    double low = 0.0, high = time, at = time * off / (off - last);
    if (off * last >= 0.0) /* on it already, and on its way away */
        return 0.0;
    for (int k = 0; k < MOST_STEPS; k++) {
        double first, second, away, next;
        find_weights(g, slope, at, &first, &second);
        away = off + speed * first + rate * second;
        if (away == 0.0)
            return at;
        if ((away > 0.0) == (off > 0.0))
            low = at;
        else
            high = at;
        /* psi_1' = 1 - l psi_1, psi_2' = psi_1 */
        next = at - away / (speed * (1.0 - slope / g->damping * first) + rate * first);
        if (!(next > low && next < high))
            next = 0.5 * (low + high);
        if (fabs(next - at) <= 1e-15 * time)
            return next;
        at = next;
    }
    return at;
}

/* The angle a sample later, from that and the torques at both; the gear's piece goes with it. */
static double moved(gear *g, double angle, double torque, double then)
{
    const er_gear_law *law = &g->law;
    double left = g->spacing, growth = (then - torque) / g->spacing, d = g->damping, first, second;
    if (g->weighted != g->piece) {
        g->weighted = g->piece;
        find_weights(g, law->slope[g->piece], g->spacing, &g->first, &g->second);
    }
    first = g->first, second = g->second;
    for (int change = 0; change < MOST_CHANGES; change++) {
        int64_t piece = g->piece;
        double low = piece > 0 ? law->angle[piece - 1] : -INFINITY;
        double high = piece < law->corners ? law->angle[piece] : INFINITY;
        double speed = (torque - offset_of(law, piece) - law->slope[piece] * angle) / d;
        double next = angle + speed * first + growth / d * second, edge, gone;
        if (!(next < low || next > high))
            return next;
        edge = next > high ? high : low;
        gone = time_of_arrival(g, law->slope[piece], angle - edge, speed, growth / d, left, next - edge);
        left -= gone;
        torque += growth * gone;
        angle = edge;
        g->piece += next > high ? 1 : -1;
        find_weights(g, law->slope[g->piece], left, &first, &second);
    }
    return angle;
}

/* Takes the law from a wind-up on. */
static void begin_law(gear *g, double wind_up, const double *torque, int64_t count)
{
    g->turned = wind_up;
    g->weighted = -1;
    if (g->elements->count > 0) {
        int64_t corners = er_gear_law_with_elements(g->spring, g->elements, wind_up, g->elongation, g->angle, g->torque,
                                                    g->slope);
        g->law = (er_gear_law){corners, g->angle, g->torque, g->slope};
    } else
        g->law = *g->spring;
    g->piece = piece_of(&g->law, wind_up, torque, count);
}

static void follow_path(gear *g, int64_t count, const double *torque, double start, double *angle, double *rate)
{
    double way = 0.0;
    for (int64_t j = 0; j < g->elements->count; j++)
        g->elongation[j] = clipped(start, g->elements->slip_angle[j]);
    begin_law(g, start, torque, count);
    for (int64_t k = 0; k < count; k++) {
        if (k == 0)
            angle[k] = start;
        else {
            double before = angle[k - 1];
            angle[k] = moved(g, before, torque[k - 1], torque[k]);
            if (g->elements->count > 0 && (angle[k] - before) * way < 0.0) {
                /* What it was until it turned, and once more from there. */
                for (int64_t j = 0; j < g->elements->count; j++)
                    g->elongation[j] = clipped(g->elongation[j] + before - g->turned, g->elements->slip_angle[j]);
                begin_law(g, before, torque + k - 1, count - k + 1);
                angle[k] = moved(g, before, torque[k - 1], torque[k]);
            }
            if (angle[k] != before)
                way = angle[k] - before;
        }
        rate[k] = (torque[k] - offset_of(&g->law, g->piece) - g->law.slope[g->piece] * angle[k]) / g->damping;
    }
}

bool er_gear_path(const er_gear_law *spring, const er_gear_elements *elements, double damping, double spacing,
                  int64_t count, const double *torque, double start, double *angle, double *rate)
{
    size_t corners = (size_t)(spring->corners + 2 * elements->count);
    double *memory = malloc((3 * corners + 1 + (size_t)elements->count) * sizeof *memory);
    gear g = {.spring = spring, .elements = elements, .damping = damping, .spacing = spacing};
    if (memory == NULL)
        return false;
    g.angle = memory;
    g.torque = memory + corners;
    g.slope = memory + 2 * corners;
    g.elongation = memory + 3 * corners + 1;
    follow_path(&g, count, torque, start, angle, rate);
    free(memory);
    return true;
}

void er_backlash_reversals(int64_t count, int64_t series, double spacing, const double *torque, const double *backlash,
                           const double *damping, int64_t *changes)
{
    for (int64_t g = 0; g < series; g++) {
        double place = 0.0, flank = 0.0, edge = backlash[g];
        changes[g] = 0;
        for (int64_t k = 0; k < count; k++) {
            double reached = 0.0;
            place = clipped(place + spacing * torque[k * series + g] / damping[g], edge);
            if (fabs(place) >= edge)
                reached = (place > 0.0) - (place < 0.0);
            changes[g] += reached * flank < 0.0;
            if (reached != 0.0)
                flank = reached;
        }
    }
}
