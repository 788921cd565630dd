#include "gear_drive.h"

#include <math.h>
#include <string.h>

enum { HALVES = 2 };

er_gear_drive er_gear_part(const er_gear_drive *drive, int64_t begin, int64_t end)
{
    er_gear_drive part = *drive;
    int64_t step = begin * drive->parts;
    part.count = end - begin;
    part.first = drive->first && begin == 0;
    part.link += 4 * step;
    part.impulse += HALVES * step;
    part.inertia += step;
    part.scale += step;
    if (drive->held_wind_up != NULL) {
        part.held_wind_up += ER_QUARTERS * step;
        part.held_impulse += HALVES * step;
        part.held_slope += HALVES * ER_QUARTERS * step;
    }
    return part;
}

/* The piece of the torque curve at an angle. */
static int64_t piece_at(const er_gear_drive *drive, double x)
{
    int64_t piece = 0;
    while (piece < drive->pieces - 1 && x > drive->knots[piece])
        piece++;
    return piece;
}

static double torque_and_slope(const er_gear_drive *drive, double x, double *slope)
{
    int64_t piece = piece_at(drive, x);
    const double *c = drive->cubics + 4 * piece;
    double t = x - drive->origins[piece];
    *slope = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]);
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]));
}

/* eps, eps' and eps'' at an angle of the drive. */
static void find_error(const er_gear_drive *drive, double q, double error[3])
{
    error[0] = error[1] = error[2] = 0.0;
    for (int64_t s = 0; s < drive->sines; s++) {
        double n = drive->order[s], turned = n * q + drive->phase[s], a = drive->amplitude[s];
        error[0] += a * sin(turned);
        error[1] += a * n * cos(turned);
        error[2] -= a * n * n * sin(turned);
    }
}

static double weighted_sum(int64_t count, const double *weights, const double *values)
{
    double sum = 0.0;
    for (int64_t k = 0; k < count; k++)
        sum += weights[k] * values[k];
    return sum;
}

/* Wind-ups at the quarters of a step, and du/dq there. */
static void find_wind_ups(const er_gear_drive *drive, const double *coefficients, const double *misses, int64_t i,
                          int64_t j, double x[ER_QUARTERS], double rise[ER_QUARTERS])
{
    int64_t node = i * drive->parts + j, width = drive->degree + 1;
    double grown = misses[node + 1] - misses[node];
    for (int p = 0; p < ER_QUARTERS; p++) {
        double q = weighted_sum(width, drive->value + (j * ER_QUARTERS + p) * width, coefficients + i), error[3];
        find_error(drive, q, error);
        x[p] = drive->link[4 * node + p] + (misses[node] + grown * (0.25 * p)) - (q + error[0]);
        rise[p] = 1.0 + error[1];
    }
}

static void integrate_half(const er_gear_drive *drive, int half, const double x[ER_QUARTERS],
                           const double torque[ER_QUARTERS], const double slope[ER_QUARTERS], er_gear_step *step)
{
    const double length = 0.5 * drive->step, simpson[3] = {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0};
    int from = 2 * half;
    double *by = step->by_wind_up[half], sum = 0.0;
    memset(by, 0, sizeof step->by_wind_up[half]);
    if (slope[from] == slope[from + 1] && slope[from + 1] == slope[from + 2]) {
        for (int p = 0; p < 3; p++) {
            sum += simpson[p] * torque[from + p];
            by[from + p] = length * slope[from + p] * simpson[p];
        }
        step->impulse[half] = length * sum;
        return;
    }
    for (int f = 0; f < ER_FINE; f++) {
        const double *weights = drive->fine + (half * ER_FINE + f) * ER_QUARTERS;
        double there;
        sum += torque_and_slope(drive, weighted_sum(ER_QUARTERS, weights, x), &there);
        for (int p = 0; p < ER_QUARTERS; p++)
            by[p] += length / ER_FINE * there * weights[p];
    }
    step->impulse[half] = length / ER_FINE * sum;
}

static void add_held(const er_gear_drive *drive, int64_t node, const double x[ER_QUARTERS], er_gear_step *step)
{
    const double *about = drive->held_wind_up + node * ER_QUARTERS;
    for (int half = 0; half < HALVES; half++) {
        const double *slope = drive->held_slope + (node * HALVES + half) * ER_QUARTERS;
        step->impulse[half] += drive->held_impulse[node * HALVES + half];
        for (int p = 0; p < ER_QUARTERS; p++) {
            step->impulse[half] += slope[p] * (x[p] - about[p]);
            step->by_wind_up[half][p] += slope[p];
        }
    }
}

void er_gear_step_at(const er_gear_drive *drive, const double *coefficients, const double *misses, int64_t i, int64_t j,
                     er_gear_step *step)
{
    int64_t node = i * drive->parts + j;
    double x[ER_QUARTERS], torque[ER_QUARTERS], slope[ER_QUARTERS];
    find_wind_ups(drive, coefficients, misses, i, j, x, step->rise);
    for (int p = 0; p < ER_QUARTERS; p++)
        torque[p] = torque_and_slope(drive, x[p], &slope[p]);
    for (int half = 0; half < HALVES; half++) {
        integrate_half(drive, half, x, torque, slope, step);
        step->impulse[half] += drive->damping * (x[2 * half + 2] - x[2 * half]);
        step->impulse[half] -= drive->impulse[HALVES * node + half];
        step->by_wind_up[half][2 * half] -= drive->damping;
        step->by_wind_up[half][2 * half + 2] += drive->damping;
    }
    if (drive->held_wind_up != NULL)
        add_held(drive, node, x, step);
}

/* u' at the first time [rad/s], and its derivatives by the first coefficients. */
static double start_rate(const er_gear_drive *drive, const double *coefficients, double *by)
{
    int64_t width = drive->degree + 1;
    double q = weighted_sum(width, drive->value, coefficients), error[3];
    double rate = weighted_sum(width, drive->start_row, coefficients);
    find_error(drive, q, error);
    for (int64_t k = 0; by != NULL && k < width; k++)
        by[k] = (1.0 + error[1]) * drive->start_row[k] + error[2] * rate * drive->value[k];
    return (1.0 + error[1]) * rate;
}

double er_gear_defect(const er_gear_drive *drive, const double *coefficients, const double *misses, int64_t node,
                      const er_gear_step *before, const er_gear_step *now)
{
    const double *M = drive->inertia;
    double sum = M[node] / drive->step * (misses[node + 1] - misses[node]) + now->impulse[0];
    if (node > 0)
        sum += before->impulse[1] - M[node - 1] / drive->step * (misses[node] - misses[node - 1]);
    else if (drive->first) /* it starts in equilibrium with its wind-up at rest, so delta' = u' - phi' */
        sum -= M[0] * (start_rate(drive, coefficients, NULL) - drive->link_rate);
    else
        sum = 0.0; /* the step before is not here */
    return drive->scale[node] * sum;
}

/* Derivatives by the coefficients of an interval of what is so derived by the wind-ups of a half. */
static void add_by_coefficients(const er_gear_drive *drive, int64_t j, int half, const er_gear_step *step, double *by)
{
    int64_t width = drive->degree + 1;
    for (int p = 0; p < ER_QUARTERS; p++) {
        double weight = step->by_wind_up[half][p] * step->rise[p];
        const double *value = drive->value + (j * ER_QUARTERS + p) * width;
        for (int64_t k = 0; k < width; k++)
            by[k] -= weight * value[k];
    }
}

static void add_by_misses(int half, const er_gear_step *step, double *by)
{
    for (int p = 0; p < ER_QUARTERS; p++) {
        by[0] += step->by_wind_up[half][p] * (1.0 - 0.25 * p);
        by[1] += step->by_wind_up[half][p] * (0.25 * p);
    }
}

void er_gear_find_row(const er_gear_drive *drive, const double *coefficients, int64_t i, int64_t j,
                      const er_gear_step *before, const er_gear_step *now, er_gear_row *row)
{
    int64_t node = i * drive->parts + j;
    double g = drive->inertia[node] / drive->step;
    memset(row, 0, sizeof *row);
    if (node == 0 && !drive->first)
        return;
    add_by_coefficients(drive, j, 0, now, row->by_coefficient + 1);
    add_by_misses(0, now, row->by_miss + 1);
    row->by_miss[1] -= g;
    row->by_miss[2] += g;
    if (node > 0) {
        double g_before = drive->inertia[node - 1] / drive->step;
        add_by_coefficients(drive, j > 0 ? j - 1 : drive->parts - 1, 1, before, row->by_coefficient + (j > 0));
        add_by_misses(1, before, row->by_miss);
        row->by_miss[0] += g_before;
        row->by_miss[1] -= g_before;
    } else {
        double by[ER_MOST_COEFFICIENTS];
        start_rate(drive, coefficients, by);
        for (int64_t k = 0; k <= drive->degree; k++)
            row->by_coefficient[1 + k] -= drive->inertia[0] * by[k];
    }
    for (int k = 0; k <= ER_MOST_COEFFICIENTS; k++)
        row->by_coefficient[k] *= drive->scale[node];
    for (int k = 0; k < 3; k++)
        row->by_miss[k] *= drive->scale[node];
}

void er_gear_wind_ups(const er_gear_drive *drive, const double *coefficients, const double *misses, double *wind_up)
{
    double rise[ER_QUARTERS];
    for (int64_t i = 0; i < drive->count; i++)
        for (int64_t j = 0; j < drive->parts; j++, wind_up += ER_QUARTERS)
            find_wind_ups(drive, coefficients, misses, i, j, wind_up, rise);
}

void er_gear_defects(const er_gear_drive *drive, const double *coefficients, const double *misses, double *defects)
{
    er_gear_step steps[2];
    for (int64_t node = 0; node < drive->count * drive->parts; node++) {
        er_gear_step *now = &steps[node % 2], *before = &steps[(node + 1) % 2];
        er_gear_step_at(drive, coefficients, misses, node / drive->parts, node % drive->parts, now);
        defects[node] = er_gear_defect(drive, coefficients, misses, node, before, now);
    }
}

void er_gear_rows(const er_gear_drive *drive, const double *coefficients, const double *misses, double *rows)
{
    er_gear_step steps[2];
    for (int64_t node = 0; node < drive->count * drive->parts; node++) {
        er_gear_step *now = &steps[node % 2], *before = &steps[(node + 1) % 2];
        int64_t i = node / drive->parts, j = node % drive->parts, width = drive->degree + 2;
        er_gear_row row;
        er_gear_step_at(drive, coefficients, misses, i, j, now);
        er_gear_find_row(drive, coefficients, i, j, before, now, &row);
        memcpy(rows, row.by_coefficient, (size_t)width * sizeof *rows);
        memcpy(rows + width, row.by_miss, sizeof row.by_miss);
        rows += width + 3;
    }
}
