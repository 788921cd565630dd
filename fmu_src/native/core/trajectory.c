#include "trajectory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POWERS = 6 };

static double *coefficients(const er_trajectory *t, size_t sample, int joint)
{
    return t->power + (sample * (size_t)t->joints + (size_t)joint) * POWERS;
}

static int column_count(const er_samples *s)
{
    return 1 + s->joints * (s->rates ? 3 : 1);
}

static const double *sample_row(const er_samples *s, size_t k)
{
    return s->data + k * (size_t)column_count(s);
}

static bool require_samples(const er_samples *s, const er_settings *settings, er_failure *failure)
{
    static const char *const names[] = {"q", "qd", "qdd"};
    if (s->samples < 2)
        return er_fail(failure, "expected at least 2 samples, got %lu",
                       (unsigned long)s->samples);
    for (size_t k = 0; k < s->samples; k++) {
        const double *row = sample_row(s, k);
        for (int c = 0; c < column_count(s); c++)
            if (!(fabs(row[c]) <= settings->most_sample)) /* NaN is not at most anything */
                return er_fail(failure, "%s: expected finite numbers of at most %g, got another in"
                               " sample %lu", c == 0 ? "time" : names[(c - 1) / s->joints],
                               settings->most_sample, (unsigned long)k + 1);
        if (k > 0 && row[0] - sample_row(s, k - 1)[0] < settings->closest_samples)
            return er_fail(failure, "expected rising times, at least %g s apart, got %.9g s, then %.9g s at"
                           " sample %lu", settings->closest_samples, sample_row(s, k - 1)[0], row[0],
                           (unsigned long)k + 1);
    }
    return true;
}

/* Polynomials of degree 5 that take value, rate and acceleration at both ends of each interval.
 *
 * In s / h: c0..c2 from the left end; c3..c5 solve the conditions at the right end. */
static void fit_quintic(er_trajectory *t, const er_samples *s)
{
    int n = s->joints;
    for (size_t k = 0; k + 1 < s->samples; k++) {
        const double *left = sample_row(s, k) + 1, *right = sample_row(s, k + 1) + 1;
        double h = t->time[k + 1] - t->time[k], h3 = h * h * h;
        for (int i = 0; i < n; i++) {
            double q0 = left[i], v0 = left[n + i], a0 = left[2 * n + i];
            double rise = right[i] - q0 - h * v0 - 0.5 * h * h * a0;
            double slope = h * (right[n + i] - v0) - h * h * a0;
            double curvature = h * h * (right[2 * n + i] - a0);
            double *c = coefficients(t, k, i);
            c[0] = q0;
            c[1] = v0;
            c[2] = 0.5 * a0;
            c[3] = (10.0 * rise - 4.0 * slope + 0.5 * curvature) / h3;
            c[4] = (-15.0 * rise + 7.0 * slope - curvature) / (h3 * h);
            c[5] = (6.0 * rise - 3.0 * slope + 0.5 * curvature) / (h3 * h * h);
        }
    }
}

/* C2 cubics with zero rate at both ends.  The rates at the samples solve a tridiagonal system:
 * h_k v_(k-1) + 2 (h_(k-1) + h_k) v_k + h_(k-1) v_(k+1) = 3 (h_k d_(k-1) + h_(k-1) d_k), d the chords. */
static bool fit_cubic(er_trajectory *t, const er_samples *s)
{
    size_t last = s->samples - 1;
    double *work = malloc(2 * s->samples * sizeof *work), *rate = work, *ratio;
    if (work == NULL)
        return false;
    ratio = work + s->samples;
    for (int i = 0; i < s->joints; i++) {
        rate[0] = rate[last] = ratio[0] = 0.0;
        for (size_t k = 1; k < last; k++) {
            double before = t->time[k] - t->time[k - 1], behind = t->time[k + 1] - t->time[k];
            double q = sample_row(s, k)[1 + i];
            double chord_before = (q - sample_row(s, k - 1)[1 + i]) / before;
            double chord_behind = (sample_row(s, k + 1)[1 + i] - q) / behind;
            double pivot = 2.0 * (before + behind) - behind * ratio[k - 1];
            ratio[k] = before / pivot;
            rate[k] = (3.0 * (behind * chord_before + before * chord_behind) -
                       behind * rate[k - 1]) / pivot;
        }
        for (size_t k = last - 1; k > 0; k--)
            rate[k] -= ratio[k] * rate[k + 1];
        for (size_t k = 0; k < last; k++) {
            double h = t->time[k + 1] - t->time[k], *c = coefficients(t, k, i);
            double q = sample_row(s, k)[1 + i];
            double chord = (sample_row(s, k + 1)[1 + i] - q) / h;
            double bend = (rate[k] + rate[k + 1] - 2.0 * chord) / h;
            c[0] = q;
            c[1] = rate[k];
            c[2] = (chord - rate[k]) / h - bend;
            c[3] = bend / h;
            c[4] = c[5] = 0.0;
        }
    }
    free(work);
    return true;
}

static void find_jumps(er_trajectory *t)
{
    t->jump[0] = t->jump[t->samples - 1] = 0.0;
    for (size_t k = 1; k + 1 < t->samples; k++) {
        double h = t->time[k] - t->time[k - 1], largest = 0.0;
        for (int i = 0; i < t->joints; i++) {
            const double *c = coefficients(t, k - 1, i);
            double end = 6.0 * c[3] + h * (24.0 * c[4] + h * 60.0 * c[5]);
            largest = fmax(largest, fabs(6.0 * coefficients(t, k, i)[3] - end));
        }
        t->jump[k] = largest;
    }
}

/* FNV-1a over the samples, a number at a time; never 0. */
static uint64_t fingerprint_of(const er_samples *s)
{
    size_t count = s->samples * (size_t)column_count(s);
    uint64_t hash = UINT64_C(14695981039346656037), bits;
    for (size_t k = 0; k < count; k++) {
        memcpy(&bits, s->data + k, sizeof bits);
        hash = (hash ^ bits) * UINT64_C(1099511628211);
        hash ^= hash >> 32; /* the product alone would leave high bits without a trace in low ones */
    }
    return hash | 1;
}

bool er_trajectory_build(er_trajectory *t, const er_samples *s, const er_settings *settings,
                         er_failure *failure)
{
    size_t entries = s->samples * (size_t)s->joints * POWERS;
    memset(t, 0, sizeof *t);
    if (!require_samples(s, settings, failure))
        return false;
    t->joints = s->joints;
    t->samples = s->samples;
    t->fingerprint = fingerprint_of(s);
    t->time = malloc(s->samples * sizeof *t->time);
    t->jump = malloc(s->samples * sizeof *t->jump);
    t->power = malloc(entries * sizeof *t->power);
    if (t->time == NULL || t->jump == NULL || t->power == NULL) {
        er_trajectory_free(t);
        return er_fail(failure, "%lu samples do not fit into memory", (unsigned long)s->samples);
    }
    t->start = sample_row(s, 0)[0];
    for (size_t k = 0; k < s->samples; k++)
        t->time[k] = sample_row(s, k)[0] - t->start;
    if (s->rates) {
        fit_quintic(t, s);
    } else if (!fit_cubic(t, s)) {
        er_trajectory_free(t);
        return er_fail(failure, "it does not fit into memory");
    }
    find_jumps(t);
    return true;
}

void er_trajectory_free(er_trajectory *t)
{
    free(t->time);
    free(t->jump);
    free(t->power);
    memset(t, 0, sizeof *t);
}

/* The interval that holds a time: the largest k with time[k] <= t, at most the last but one. */
static size_t interval(const er_trajectory *t, double time, size_t *hint)
{
    size_t low = *hint, high, last = t->samples - 1;
    if (low < last && t->time[low] <= time) {
        if (low + 1 == last || time < t->time[low + 1])
            return low;
        if (low + 2 == last || time < t->time[low + 2])
            return *hint = low + 1;
    } else {
        low = 0;
    }
    high = last;
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

void er_drives_at(const er_drives *drives, double time, double *q, double *qd, double *qdd)
{
    const er_trajectory *t = drives->trajectory;
    const double *c;
    size_t k;
    double s = time - drives->start;
    if (t == NULL) {
        for (int i = 0; i < drives->joints; i++)
            er_command_at(drives->powers[i], s, &q[i], &qd[i], &qdd[i]);
        return;
    }
    if (s < 0.0)
        s = 0.0;
    if (s > t->time[t->samples - 1])
        s = t->time[t->samples - 1];
    k = interval(t, s, drives->hint);
    s -= t->time[k];
    c = coefficients(t, k, 0);
    for (int i = 0; i < t->joints; i++, c += POWERS) {
        q[i] = c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))));
        qd[i] = c[1] + s * (2.0 * c[2] + s * (3.0 * c[3] + s * (4.0 * c[4] + s * 5.0 * c[5])));
        qdd[i] = 2.0 * c[2] + s * (6.0 * c[3] + s * (12.0 * c[4] + s * 20.0 * c[5]));
    }
}

void er_drives_by_time(const er_drives *drives, double time, double *q, double *qd, double *qdd)
{
    const er_trajectory *t = drives->trajectory;
    size_t bytes = (size_t)drives->joints * sizeof *q, k;
    double position[ER_MAX_JOINTS], s = time - drives->start;
    memset(q, 0, bytes);
    memset(qd, 0, bytes);
    memset(qdd, 0, bytes);
    if (t == NULL || s < 0.0 || s > t->time[t->samples - 1])
        return;
    er_drives_at(drives, time, position, q, qd);
    k = interval(t, s, drives->hint);
    s -= t->time[k];
    for (int i = 0; i < t->joints; i++) {
        const double *c = coefficients(t, k, i);
        qdd[i] = 6.0 * c[3] + s * (24.0 * c[4] + s * 60.0 * c[5]);
    }
}

double er_drives_next_kink(const er_drives *drives, double time, double end, double jump)
{
    const er_trajectory *t = drives->trajectory;
    if (t == NULL)
        return end;
    for (size_t k = interval(t, fmax(time - drives->start, 0.0), drives->hint) + 1; k + 1 < t->samples;
         k++) {
        double at = t->time[k] + drives->start;
        if (at >= end)
            break;
        if (t->jump[k] > jump && at > time) /* the difference rounds: `time` may be this sample's */
            return at;
    }
    return end;
}
