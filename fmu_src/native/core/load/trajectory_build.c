#include "trajectory_build.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../io/table_file.h"

/* Columns of a table: time, q, and optionally rates and accelerations, [sample][column]. */
typedef struct {
    size_t samples;
    int joints;
    bool rates;
    double *data; /* time, q1.., then qd1.., qdd1.. if there are rates; from malloc */
} table_samples;

static int column_count(const table_samples *s)
{
    return 1 + s->joints * (s->rates ? 3 : 1);
}

static const double *sample_row(const table_samples *s, size_t k)
{
    return s->data + k * (size_t)column_count(s);
}

/* The largest size of a number; infinite where one is NaN.  In maxima beside each other. */
static double largest_size(const double *values, size_t count)
{
    double most[4] = {0.0, 0.0, 0.0, 0.0}, sum[4] = {0.0, 0.0, 0.0, 0.0}, all = 0.0;
    size_t k = 0;
    for (; k + 4 <= count; k += 4)
        for (int i = 0; i < 4; i++) {
            double size = fabs(values[k + i]);
            most[i] = size > most[i] ? size : most[i];
            sum[i] += 0.0 * size;
        }
    for (; k < count; k++) {
        most[0] = fmax(most[0], fabs(values[k]));
        sum[0] += 0.0 * values[k];
    }
    for (int i = 0; i < 4; i++)
        all = sum[i] == 0.0 ? fmax(all, most[i]) : INFINITY;
    return sum[0] + sum[1] + sum[2] + sum[3] == 0.0 ? all : INFINITY;
}

static bool require_samples(const table_samples *s, const er_settings *settings, er_failure *failure)
{
    static const char *const names[] = {"q", "qd", "qdd"};
    bool sane;
    if (s->samples < 2)
        return er_fail(failure, "expected at least 2 samples, got %lu", (unsigned long)s->samples);
    sane = largest_size(s->data, s->samples * (size_t)column_count(s)) <= settings->most_sample;
    for (size_t k = 0; k < s->samples; k++) {
        const double *row = sample_row(s, k);
        for (int c = 0; !sane && c < column_count(s); c++)
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

/* Rates and accelerations of the C2 cubic spline of joint i with zero rate at both ends.  The rates at
 * the samples solve a tridiagonal system:
 * h_k v_(k-1) + 2 (h_(k-1) + h_k) v_k + h_(k-1) v_(k+1) = 3 (h_k d_(k-1) + h_(k-1) d_k), d the chords. */
static void fit_cubic(const er_trajectory *t, int i, double *rate, double *ratio)
{
    size_t last = t->samples - 1, width = er_trajectory_width(t), n = (size_t)t->joints;
    double *q = t->row + 1 + i;
    rate[0] = rate[last] = ratio[0] = 0.0;
    for (size_t k = 1; k < last; k++) {
        double before = t->time[k] - t->time[k - 1];
        double behind = t->time[k + 1] - t->time[k];
        double chord_before = (q[k * width] - q[(k - 1) * width]) / before;
        double chord_behind = (q[(k + 1) * width] - q[k * width]) / behind;
        double pivot = 2.0 * (before + behind) - behind * ratio[k - 1];
        ratio[k] = before / pivot;
        rate[k] = (3.0 * (behind * chord_before + before * chord_behind) - behind * rate[k - 1]) /
                  pivot;
    }
    for (size_t k = last - 1; k > 0; k--)
        rate[k] -= ratio[k] * rate[k + 1];
    for (size_t k = 0; k <= last; k++) {
        size_t from = k < last ? k : last - 1;
        double h = t->time[from + 1] - t->time[from];
        double chord = (q[(from + 1) * width] - q[from * width]) / h;
        double left = 2.0 * rate[from] + rate[from + 1], right = rate[from] + 2.0 * rate[from + 1];
        q[k * width + n] = rate[k];
        q[k * width + 2 * n] = k < last ? (6.0 * chord - 2.0 * left) / h : (2.0 * right - 6.0 * chord) / h;
    }
}

/* Completes samples of times and angles alone. */
static bool complete_samples(er_trajectory *t, const table_samples *s)
{
    double *work = malloc(2 * s->samples * sizeof *work);
    t->row = malloc(s->samples * er_trajectory_width(t) * sizeof *t->row);
    if (work != NULL && t->row != NULL) {
        for (size_t k = 0; k < s->samples; k++)
            memcpy(t->row + k * er_trajectory_width(t), sample_row(s, k), (size_t)column_count(s) * sizeof *t->row);
        for (int i = 0; i < t->joints; i++)
            fit_cubic(t, i, work, work + s->samples);
    }
    free(work);
    return work != NULL && t->row != NULL;
}

/* Third derivatives at both ends of the quintic behind sample k, of each joint [rad/s^3]. */
static void third_derivatives(const er_trajectory *t, size_t k, double *restrict at_start, double *restrict at_end)
{
    int n = t->joints;
    const double *left = t->row + k * er_trajectory_width(t) + 1, *right = left + er_trajectory_width(t);
    double h = t->time[k + 1] - t->time[k], per_h3 = 1.0 / (h * h * h);
    for (int i = 0; i < n; i++) {
        double v = left[n + i], a = left[2 * n + i];
        double rise = right[i] - left[i] - h * v - 0.5 * h * h * a;
        double slope = h * (right[n + i] - v) - h * h * a;
        double curvature = h * h * (right[2 * n + i] - a);
        at_start[i] = (60.0 * rise - 24.0 * slope + 3.0 * curvature) * per_h3;
        at_end[i] = (60.0 * rise - 36.0 * slope + 9.0 * curvature) * per_h3;
    }
}

static void set_jumps(er_trajectory *t)
{
    double before[ER_MAX_JOINTS], start[ER_MAX_JOINTS], end[ER_MAX_JOINTS];
    third_derivatives(t, 0, start, before);
    t->jump[0] = t->jump[t->samples - 1] = 0.0;
    for (size_t k = 1; k + 1 < t->samples; k++) {
        double largest = 0.0;
        third_derivatives(t, k, start, end);
        for (int i = 0; i < t->joints; i++) {
            double jump = fabs(start[i] - before[i]);
            largest = jump > largest ? jump : largest;
            before[i] = end[i];
        }
        t->jump[k] = largest;
    }
}

/* FNV-1a over the samples, a number at a time, in threads that do not wait for each other; never 0. */
static uint64_t fingerprint_of(const table_samples *s)
{
    enum { THREADS = 4 };
    size_t count = s->samples * (size_t)column_count(s), k = 0;
    uint64_t hash[THREADS], bits, all = ER_HASH_START ^ count;
    for (int i = 0; i < THREADS; i++)
        hash[i] = ER_HASH_START + (uint64_t)i;
    for (; k + THREADS <= count; k += THREADS)
        for (int i = 0; i < THREADS; i++) {
            memcpy(&bits, s->data + k + i, sizeof bits);
            hash[i] = (hash[i] ^ bits) * ER_HASH_FACTOR;
            hash[i] ^= hash[i] >> 32; /* the product alone would leave high bits without a trace in low ones */
        }
    for (; k < count; k++) {
        memcpy(&bits, s->data + k, sizeof bits);
        all = (all ^ bits) * ER_HASH_FACTOR;
        all ^= all >> 32;
    }
    for (int i = 0; i < THREADS; i++) {
        all = (all ^ hash[i]) * ER_HASH_FACTOR;
        all ^= all >> 32;
    }
    return all | 1;
}

static bool build_motion(er_trajectory *t, table_samples *s, const er_settings *settings, er_failure *failure)
{
    if (!require_samples(s, settings, failure))
        return false;
    t->joints = s->joints;
    t->samples = s->samples;
    t->fingerprint = fingerprint_of(s);
    t->jump = malloc(s->samples * sizeof *t->jump);
    t->time = malloc(s->samples * sizeof *t->time);
    t->start = sample_row(s, 0)[0];
    for (size_t k = 0; t->time != NULL && k < s->samples; k++)
        t->time[k] = sample_row(s, k)[0] - t->start;
    if (s->rates) {
        t->row = s->data;
        s->data = NULL;
    }
    if (t->jump == NULL || t->time == NULL || (!s->rates && !complete_samples(t, s)))
        return er_fail(failure, "%lu samples do not fit into memory", (unsigned long)s->samples);
    set_jumps(t);
    return true;
}

/* Builds the motion; takes the samples' data, and frees them if that fails. */
static bool take_samples(er_trajectory *t, table_samples *s, const er_settings *settings, er_failure *failure)
{
    bool good;
    memset(t, 0, sizeof *t);
    good = build_motion(t, s, settings, failure);
    free(s->data);
    s->data = NULL;
    if (!good)
        er_trajectory_free(t);
    return good;
}

void er_trajectory_free(er_trajectory *t)
{
    free(t->time);
    free(t->row);
    free(t->jump);
    memset(t, 0, sizeof *t);
}

static bool missing_column(const er_data_table *table, const char *name, er_failure *failure)
{
    char names[400] = "";
    size_t length = 0;
    for (int k = 0; k < table->columns && length + ER_MAX_NAME + 2 < sizeof names; k++)
        length += (size_t)snprintf(names + length, sizeof names - length, "%s%s", k > 0 ? ", " : "", table->name[k]);
    return er_fail(failure, "expected one column '%s', got %s", name, names);
}

/* The column of a name; refuses none and several. */
static bool find_column(const er_data_table *table, const char *name, int *column, er_failure *failure)
{
    int count;
    *column = er_table_column(table, name, &count);
    return count == 1 || missing_column(table, name, failure);
}

/* Finds PREFIX1.. PREFIXn; *found is false where none of them is there. */
static bool find_block(const er_data_table *table, const char *prefix, int joints, int *column,
                       bool *is_there, er_failure *failure)
{
    char name[16];
    int count;
    *is_there = false;
    for (int i = 0; i < joints; i++) {
        snprintf(name, sizeof name, "%s%d", prefix, i + 1);
        *is_there |= er_table_column(table, name, &count) >= 0;
    }
    for (int i = 0; i < joints && *is_there; i++) {
        snprintf(name, sizeof name, "%s%d", prefix, i + 1);
        if (!find_column(table, name, &column[i], failure))
            return false;
    }
    return true;
}

/* Puts the wanted columns side by side, over the table's own numbers, which are the samples' then. */
static bool choose_columns(er_data_table *table, int joints, table_samples *samples, er_failure *failure)
{
    int column[1 + 3 * ER_MAX_JOINTS], width;
    bool q, qd, qdd, there;
    if (!find_column(table, "time", &column[0], failure) || !find_block(table, "q", joints, column + 1, &q, failure))
        return false;
    if (!q)
        return missing_column(table, "q1", failure);
    if (!find_block(table, "qd", joints, column + 1 + joints, &qd, failure) ||
        !find_block(table, "qdd", joints, column + 1 + 2 * joints, &qdd, failure))
        return false;
    if (qd != qdd)
        return er_fail(failure, "expected qd and qdd, or none of them, got %s alone", qd ? "qd" : "qdd");
    width = 1 + joints * (qd ? 3 : 1);
    there = width == table->columns;
    for (int c = 0; c < width; c++)
        there &= column[c] == c;
    for (size_t k = 0; !there && k < table->rows; k++) {
        double row[ER_MAX_TABLE_COLUMNS];
        memcpy(row, table->data + k * (size_t)table->columns, (size_t)table->columns * sizeof *row);
        for (int c = 0; c < width; c++)
            table->data[k * (size_t)width + (size_t)c] = row[column[c]];
    }
    *samples = (table_samples){table->rows, joints, qd, table->data};
    table->data = NULL;
    return true;
}

bool er_trajectory_read(er_trajectory *trajectory, const char *path, int joints,
                        const er_settings *settings, er_failure *failure)
{
    er_data_table *table = malloc(sizeof *table);
    table_samples samples;
    er_failure inner;
    bool good = table != NULL || er_fail(&inner, "it does not fit into memory");
    if (good && er_table_read(table, path, &inner)) {
        good = choose_columns(table, joints, &samples, &inner) &&
               take_samples(trajectory, &samples, settings, &inner);
        er_table_free(table);
    } else {
        good = false;
    }
    free(table);
    return good || er_fail(failure, "trajectory %.500s: %.1000s", path, inner.text);
}
