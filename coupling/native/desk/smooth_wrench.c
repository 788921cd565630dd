#include "smooth_wrench.h"

#include <math.h>
#include <string.h>

/* Means over a width one behind the other.  Two of them are centred WIDE cells before the last one taken. */
enum { MEANS = 4, WIDE = ER_CELLS - 1 };

/* Cells before the first and behind the last instant beyond which everything is constant. */
static const double beyond = 4.0 * MEANS * ER_CELLS;

/* So many cells that their numbers are exact. */
static const double most_cells = 1e15;

typedef double axes[ER_AXES];

/* Sums over the last ER_CELLS values of what is one mean less smooth. */
typedef struct {
    axes ring[ER_CELLS], sum;
} running_mean;

/* The grid while it is gone along: cell `next` comes next. */
typedef struct {
    const er_wrench_history *history;
    int64_t next, piece;
    running_mean mean[MEANS];
    axes twice[ER_CELLS]; /* the last values of two means */
    axes smooth[2];       /* of the last cells that are known */
} grid;

/* Adds the impulse of a piece's wrench, or of an end's, from a time to another one. */
static void add_impulse(const grid *g, double from, double to, axes impulse)
{
    const er_wrench_history *h = g->history;
    const double *start = h->behind + g->piece * ER_AXES, *end = h->before + (g->piece + 1) * ER_AXES;
    double begin = h->instants[g->piece], share = (0.5 * (from + to) - begin) / (h->instants[g->piece + 1] - begin);
    for (int k = 0; k < ER_AXES; k++)
        impulse[k] += (to - from) * (start[k] + share * (end[k] - start[k]));
}

static void add_constant(const double *wrench, double length, axes impulse)
{
    for (int k = 0; k < ER_AXES && length > 0.0; k++)
        impulse[k] += length * wrench[k];
}

/* Mean wrench of the next cell. */
static void take_cell(grid *g, axes mean)
{
    const er_wrench_history *h = g->history;
    double first = h->instants[0], last = h->instants[h->count - 1];
    double begin = first + h->cell * (double)g->next, end = first + h->cell * (double)(g->next + 1);
    double at = fmax(begin, first), until = fmin(end, last);
    memset(mean, 0, sizeof(axes));
    add_constant(h->before, fmin(end, first) - begin, mean);
    while (at < until) {
        double stop = until;
        while (g->piece < h->count - 2 && h->instants[g->piece + 1] <= at)
            g->piece++;
        if (g->piece < h->count - 2)
            stop = fmin(until, h->instants[g->piece + 1]);
        add_impulse(g, at, stop, mean);
        at = stop;
    }
    add_constant(h->behind + (h->count - 1) * ER_AXES, end - fmax(begin, last), mean);
    for (int k = 0; k < ER_AXES; k++)
        mean[k] /= h->cell;
}

/* Takes a value into a mean, and puts that in its place. */
static void take_mean(running_mean *mean, int64_t cell, axes value)
{
    double *gone = mean->ring[cell & (ER_CELLS - 1)];
    for (int k = 0; k < ER_AXES; k++) {
        mean->sum[k] += value[k] - gone[k];
        gone[k] = value[k];
        value[k] = mean->sum[k] / ER_CELLS;
    }
}

/* Goes a cell on: the one 2 WIDE before it is then known. */
static void go_on(grid *g)
{
    axes value;
    const double *earlier = g->twice[(g->next - WIDE) & (ER_CELLS - 1)];
    take_cell(g, value);
    take_mean(&g->mean[0], g->next, value);
    take_mean(&g->mean[1], g->next, value);
    memcpy(g->twice[g->next & (ER_CELLS - 1)], value, sizeof value);
    take_mean(&g->mean[2], g->next, value);
    take_mean(&g->mean[3], g->next, value);
    memcpy(g->smooth[0], g->smooth[1], sizeof value);
    for (int k = 0; k < ER_AXES; k++)
        g->smooth[1][k] = 2.0 * earlier[k] - value[k];
    g->next++;
}

/* Goes to where a cell and the next one are known. */
static void go_to(grid *g, int64_t cell)
{
    int64_t next = cell + 2 + 2 * WIDE, first = cell - 2 * WIDE;
    if (g->next > next || g->next <= first) {
        const er_wrench_history *h = g->history;
        double begin = h->instants[0] + h->cell * (double)first;
        int64_t low = 0, high = h->count - 2;
        while (low < high) {
            int64_t middle = (low + high + 1) / 2;
            if (h->instants[middle] <= begin)
                low = middle;
            else
                high = middle - 1;
        }
        *g = (grid){.history = h, .next = first, .piece = low};
    }
    while (g->next < next)
        go_on(g);
}

void er_smooth_wrench(const er_wrench_history *history, int64_t count, const double *times, double *wrench)
{
    double first = history->instants[0], length = (history->instants[history->count - 1] - first) / history->cell;
    grid g = {.history = history, .next = INT64_MAX};
    for (int64_t t = 0; t < count; t++, wrench += ER_AXES) {
        /* In cells, from the middle of the first one on; what is not a number counts as behind the last one. */
        double place = fmin((times[t] - first) / history->cell - 0.5, fmin(length + beyond, most_cells));
        int64_t cell = (int64_t)floor(fmax(place, -beyond));
        double share = fmax(place, -beyond) - (double)cell;
        go_to(&g, cell);
        for (int k = 0; k < ER_AXES; k++)
            wrench[k] = g.smooth[0][k] + share * (g.smooth[1][k] - g.smooth[0][k]);
    }
}
