#include "trajectory.h"

#include <math.h>
#include <string.h>

/* The interval that holds a time: the largest k with time[k] <= time, at most the last but one.
 * From the hint on in strides that double, then by halves. */
static size_t find_interval(const er_trajectory *t, double time, size_t *hint)
{
    size_t low = *hint, high, last = t->samples - 1, stride = 1;
    if (low == 0 || t->time[low] <= time) {
        for (high = low + 1; high < last && t->time[high] <= time; stride *= 2) {
            low = high;
            high = last - low > stride ? low + stride : last;
        }
    } else {
        for (high = low; low > 0 && t->time[low] > time; stride *= 2) {
            high = low;
            low = low > stride ? low - stride : 0;
        }
    }
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (t->time[middle] <= time)
            low = middle;
        else
            high = middle;
    }
    return *hint = low;
}

bool er_drives_cover(const er_drives *drives, double time, double slack, er_failure *failure)
{
    const er_trajectory *t = drives->trajectory;
    double s = time - drives->start, last;
    if (t == NULL)
        return true;
    last = t->time[t->samples - 1];
    if (s >= -slack && s <= last + slack)
        return true;
    return er_fail(failure, "time: expected %.9g to %.9g s, the trajectory's, got %.9g s", t->start,
                   t->start + last, t->start + s);
}

/* Weights of rise, rates and accelerations at both ends of an interval, for the value of its quintic or
 * for one of that's derivatives. */
typedef struct {
    double rise, rate[2], bend[2];
} weights;

static double weighted_sum(const weights *w, double rise, const double *left, const double *right, int n)
{
    return w->rise * rise + (w->rate[0] * left[n] + w->rate[1] * right[n]) +
           (w->bend[0] * left[2 * n] + w->bend[1] * right[2 * n]);
}

/* q, q', q'' a part u of an interval of length h behind its start; by joint, two neighbouring rows. */
static void along_quintic(int n, const double *left, const double *right, double h, double u, double *q,
                          double *qd, double *qdd)
{
    double u2 = u * u, u3 = u2 * u, d = 1.0 / h;
    const weights value = {
        u3 * (10.0 - u * (15.0 - 6.0 * u)),
        {h * u * (1.0 - u2 * (6.0 - u * (8.0 - 3.0 * u))), h * u3 * (-4.0 + u * (7.0 - 3.0 * u))},
        {h * h * 0.5 * u2 * (1.0 - u * (3.0 - u * (3.0 - u))), h * h * 0.5 * u3 * (1.0 - u * (2.0 - u))},
    };
    const weights rate = {
        d * 30.0 * u2 * (1.0 - u * (2.0 - u)),
        {1.0 - u2 * (18.0 - u * (32.0 - 15.0 * u)), u2 * (-12.0 + u * (28.0 - 15.0 * u))},
        {h * u * (1.0 - u * (4.5 - u * (6.0 - 2.5 * u))), h * u2 * (1.5 - u * (4.0 - 2.5 * u))},
    };
    const weights bend = {
        d * d * 60.0 * u * (1.0 - u * (3.0 - 2.0 * u)),
        {d * u * (-36.0 + u * (96.0 - 60.0 * u)), d * u * (-24.0 + u * (84.0 - 60.0 * u))},
        {1.0 - u * (9.0 - u * (18.0 - 10.0 * u)), u * (3.0 - u * (12.0 - 10.0 * u))},
    };
    for (int i = 0; i < n; i++) {
        double rise = right[i] - left[i];
        q[i] = left[i] + weighted_sum(&value, rise, left + i, right + i, n);
        qd[i] = weighted_sum(&rate, rise, left + i, right + i, n);
        qdd[i] = weighted_sum(&bend, rise, left + i, right + i, n);
    }
}

void er_drives_at(const er_drives *drives, double time, double *q, double *qd, double *qdd)
{
    const er_trajectory *t = drives->trajectory;
    const double *row;
    double s = time - drives->start, h;
    size_t k;
    if (t == NULL) {
        for (int i = 0; i < drives->joints; i++)
            er_command_at(drives->powers[i], s, &q[i], &qd[i], &qdd[i]);
        return;
    }
    if (s < 0.0)
        s = 0.0;
    if (s > t->time[t->samples - 1])
        s = t->time[t->samples - 1];
    k = find_interval(t, s, drives->hint);
    row = t->row + k * er_trajectory_width(t) + 1;
    h = t->time[k + 1] - t->time[k];
    along_quintic(t->joints, row, row + er_trajectory_width(t), h, (s - t->time[k]) / h, q, qd, qdd);
}

/* q''' a part u of an interval behind its start, likewise. */
static void bend_along_quintic(int n, const double *left, const double *right, double h, double u, double *third)
{
    double d = 1.0 / h;
    const weights by_time = {
        d * d * d * (60.0 - u * (360.0 - 360.0 * u)),
        {d * d * (-36.0 + u * (192.0 - 180.0 * u)), d * d * (-24.0 + u * (168.0 - 180.0 * u))},
        {d * (-9.0 + u * (36.0 - 30.0 * u)), d * (3.0 - u * (24.0 - 30.0 * u))},
    };
    for (int i = 0; i < n; i++)
        third[i] = weighted_sum(&by_time, right[i] - left[i], left + i, right + i, n);
}

void er_drives_by_time(const er_drives *drives, double time, double *q, double *qd, double *qdd)
{
    const er_trajectory *t = drives->trajectory;
    size_t bytes = (size_t)drives->joints * sizeof *q, k;
    double position[ER_MAX_JOINTS], s = time - drives->start, h;
    const double *row;
    memset(q, 0, bytes);
    memset(qd, 0, bytes);
    memset(qdd, 0, bytes);
    if (t == NULL || s < 0.0 || s > t->time[t->samples - 1])
        return;
    er_drives_at(drives, time, position, q, qd);
    k = find_interval(t, s, drives->hint);
    row = t->row + k * er_trajectory_width(t) + 1;
    h = t->time[k + 1] - t->time[k];
    bend_along_quintic(t->joints, row, row + er_trajectory_width(t), h, (s - t->time[k]) / h, qdd);
}

double er_drives_next_kink(const er_drives *drives, double time, double end, double jump)
{
    const er_trajectory *t = drives->trajectory;
    if (t == NULL)
        return end;
    for (size_t k = find_interval(t, fmax(time - drives->start, 0.0), drives->hint) + 1; k + 1 < t->samples; k++) {
        double at = t->time[k] + drives->start;
        if (at >= end)
            break;
        if (t->jump[k] > jump && at > time) /* the difference rounds: `time` may be this sample's */
            return at;
    }
    return end;
}
