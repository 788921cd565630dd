#include "drive_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double difference[3] = {1.0, -2.0, 1.0};

static double bend_at(const er_drive_fit *fit, const double *coefficients, int64_t k)
{
    const double *c = coefficients + k;
    return fit->smoothing * ((c[2] - 2.0 * c[1] + c[0]) / (fit->cycle * fit->cycle) - fit->bend[k]);
}

static double condition_error(const er_drive_fit *fit, const double *coefficients, int64_t c)
{
    int64_t width = fit->drive.degree + 1;
    double sum = -fit->condition_value[c];
    for (int64_t k = 0; k < width; k++)
        sum += fit->condition_weights[c * width + k] * coefficients[fit->condition_first[c] + k];
    return sum;
}

double er_drive_fit_value(const er_drive_fit *fit, const double *coefficients, const double *misses)
{
    const er_gear_drive *drive = &fit->drive;
    er_gear_step steps[2];
    int64_t nodes = drive->count * drive->parts;
    double objective = misses[nodes] * misses[nodes], equations = 0.0;
    for (int64_t node = 0; node < nodes; node++) {
        er_gear_step *now = &steps[node % 2], *before = &steps[(node + 1) % 2];
        double defect;
        er_gear_step_at(drive, coefficients, misses, node / drive->parts, node % drive->parts, now);
        defect = er_gear_defect(drive, coefficients, misses, node, before, now);
        equations += defect * defect;
        objective += misses[node] * misses[node];
    }
    for (int64_t k = 0; k < drive->count + drive->degree - 2; k++) {
        double bend = bend_at(fit, coefficients, k);
        objective += bend * bend;
    }
    for (int64_t c = 0; c < fit->conditions; c++) {
        double error = condition_error(fit, coefficients, c);
        equations += error * error;
    }
    return 0.5 * (objective + fit->counted * fit->counted * equations);
}

/* The matrix: rows of its upper half, each from its diagonal on, with blanks behind; and the right-hand side. */
typedef struct {
    int64_t stride, size;
    int width, room; /* of a row, and with the blanks */
    double *rows, *right;
} band;

static int64_t place_of_coefficient(const band *b, int64_t k)
{
    return b->stride * (1 + k);
}

static int64_t place_of_miss(const er_gear_drive *drive, int64_t node)
{
    int64_t interval = (node - 1 + drive->parts) / drive->parts - 1; /* rounded down, node 0 as well */
    return (interval + (drive->degree + 3) / 2) * (drive->parts + 1) + 1 + (node - 1 - interval * drive->parts);
}

/* Adds the square of a row of a residual, whose places rise, and its product with the residual. */
static void add_row(band *b, int count, const int64_t *place, const double *row, double residual)
{
    for (int i = 0; i < count; i++) {
        double *at = b->rows + place[i] * b->room - place[i];
        b->right[place[i]] -= row[i] * residual;
        for (int k = i; k < count; k++)
            at[place[k]] += row[i] * row[k];
    }
}

static void add_objective(const er_drive_fit *fit, const double *coefficients, const double *misses, double damping,
                          band *b)
{
    const er_gear_drive *drive = &fit->drive;
    double weight = fit->smoothing / (fit->cycle * fit->cycle), damped = damping * weight;
    for (int64_t node = 0; node <= drive->count * drive->parts; node++) {
        int64_t place = place_of_miss(drive, node);
        b->rows[place * b->room] = 1.0;
        b->right[place] = -misses[node];
    }
    for (int64_t k = 0; k < drive->count + drive->degree - 2; k++) {
        double row[3], again[3];
        int64_t place[3];
        for (int a = 0; a < 3; a++) {
            place[a] = place_of_coefficient(b, k + a);
            row[a] = weight * difference[a];
            again[a] = damped * difference[a];
        }
        add_row(b, 3, place, row, bend_at(fit, coefficients, k));
        add_row(b, 3, place, again, 0.0);
    }
}

/* Places of an equation's unknowns, rising, with their derivatives; returns their number. */
static int sort_row(const er_drive_fit *fit, const band *b, int64_t i, int64_t j, const er_gear_row *row,
                    int64_t *place, double *value)
{
    const er_gear_drive *drive = &fit->drive;
    int64_t node = i * drive->parts + j, coefficient = i > 0 ? i - 1 : 0, last = i + drive->degree;
    int64_t miss = node > 0 ? node - 1 : 0;
    int count = 0;
    while (coefficient <= last || miss <= node + 1) {
        int64_t one = coefficient <= last ? place_of_coefficient(b, coefficient) : INT64_MAX;
        int64_t other = miss <= node + 1 ? place_of_miss(drive, miss) : INT64_MAX;
        place[count] = one < other ? one : other;
        value[count++] = fit->heavy * (one < other ? row->by_coefficient[coefficient++ - i + 1]
                                                   : row->by_miss[miss++ - node + 1]);
    }
    return count;
}

static void add_equations(const er_drive_fit *fit, const double *coefficients, const double *misses, band *b)
{
    const er_gear_drive *drive = &fit->drive;
    er_gear_step steps[2];
    for (int64_t node = 0; node < drive->count * drive->parts; node++) {
        er_gear_step *now = &steps[node % 2], *before = &steps[(node + 1) % 2];
        int64_t i = node / drive->parts, j = node % drive->parts, place[ER_MOST_COEFFICIENTS + 4];
        double value[ER_MOST_COEFFICIENTS + 4];
        er_gear_row row;
        er_gear_step_at(drive, coefficients, misses, i, j, now);
        er_gear_find_row(drive, coefficients, i, j, before, now, &row);
        add_row(b, sort_row(fit, b, i, j, &row, place, value), place, value,
                fit->heavy * er_gear_defect(drive, coefficients, misses, node, before, now));
    }
    for (int64_t c = 0; c < fit->conditions; c++) {
        int64_t width = drive->degree + 1, place[ER_MOST_COEFFICIENTS];
        double value[ER_MOST_COEFFICIENTS];
        for (int64_t k = 0; k < width; k++) {
            place[k] = place_of_coefficient(b, fit->condition_first[c] + k);
            value[k] = fit->heavy * fit->condition_weights[c * width + k];
        }
        add_row(b, (int)width, place, value, fit->heavy * condition_error(fit, coefficients, c));
    }
}

static void hold_unknowns(const er_drive_fit *fit, band *b)
{
    for (int64_t k = 0; k < fit->drive.count + fit->drive.degree; k++)
        b->rows[place_of_coefficient(b, k) * b->room] += fit->idle;
    for (int64_t place = 0; place < b->size; place++)
        if (!fit->free[place]) {
            b->rows[place * b->room] += fit->held;
            b->right[place] = 0.0;
        }
}

/* Solves in place: U^T U, down and up. */
static bool solve_band(const er_link_kernel *kernel, band *b)
{
    for (int64_t u = 0; u < b->size; u++) {
        int64_t rest = b->size - u;
        int width = rest < b->width ? (int)rest : b->width;
        if (!kernel->eliminate_row(width, b->room, b->rows + u * b->room, b->right + u))
            return false;
    }
    for (int64_t u = b->size - 1; u >= 0; u--) {
        const double *row = b->rows + u * b->room;
        double sum = b->right[u];
        int64_t rest = b->size - u;
        for (int k = 1; k < (rest < b->width ? (int)rest : b->width); k++)
            sum -= row[k] * b->right[u + k];
        b->right[u] = sum / row[0];
    }
    return true;
}

int32_t er_drive_fit_step(const er_drive_fit *fit, const double *coefficients, const double *misses,
                          double damping, double *step)
{
    const er_gear_drive *drive = &fit->drive;
    const er_link_kernel kernel = er_best_link_kernel();
    band b;
    bool solved;
    b.stride = drive->parts + 1;
    b.size = (drive->count + drive->degree + 1) * b.stride;
    b.width = (int)((drive->degree + 2) * b.stride);
    b.room = b.width + ER_LANES;
    b.rows = calloc((size_t)(b.size + b.width) * b.room, sizeof(double));
    b.right = step;
    if (b.rows == NULL)
        return ER_FIT_NO_MEMORY;
    memset(step, 0, (size_t)b.size * sizeof *step);
    add_objective(fit, coefficients, misses, damping, &b);
    add_equations(fit, coefficients, misses, &b);
    hold_unknowns(fit, &b);
    solved = solve_band(&kernel, &b);
    free(b.rows);
    return solved ? ER_FIT_DONE : ER_FIT_NOT_POSITIVE;
}
