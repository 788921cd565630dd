#include "drive_fit.h"

#include <math.h>
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

/* The matrix: rows of its upper half, each from its diagonal on, with blanks behind; and the right-hand side.  Groups
 * are cleared before something is added to them, and eliminated when nothing more is. */
typedef struct {
    const er_drive_fit *fit;
    int64_t stride, size;
    int width, room; /* of a row, and with the blanks */
    double *rows, *right;
} band;

static band band_of(const er_drive_fit *fit)
{
    const er_gear_drive *drive = &fit->drive;
    band b = {.fit = fit, .stride = drive->parts + 1};
    b.size = (drive->count + drive->degree + 1) * b.stride;
    b.width = (int)((drive->degree + 2) * b.stride);
    b.room = b.width + ER_LANES;
    return b;
}

int64_t er_drive_fit_room(const er_drive_fit *fit)
{
    band b = band_of(fit);
    return (b.size + b.width) * b.room;
}

static int64_t place_of_coefficient(const band *b, int64_t k)
{
    return b->stride * (1 + k);
}

static int64_t place_of_miss(const band *b, int64_t node)
{
    const er_gear_drive *drive = &b->fit->drive;
    int64_t interval = (node - 1 + drive->parts) / drive->parts - 1; /* rounded down, node 0 as well */
    return (interval + (drive->degree + 3) / 2) * b->stride + 1 + (node - 1 - interval * drive->parts);
}

static void clear_group(band *b, int64_t group)
{
    size_t numbers = (size_t)(b->stride * b->room);
    memset(b->rows + group * numbers, 0, numbers * sizeof(double));
}

static void add_right(band *b, int64_t place, double value)
{
    if (b->fit->free[place])
        b->right[place] += value;
}

/* Adds the square of a row of a residual, whose places rise, and its product with the residual. */
static void add_row(band *b, int count, const int64_t *place, const double *row, double residual)
{
    for (int i = 0; i < count; i++) {
        double *at = b->rows + place[i] * b->room - place[i];
        add_right(b, place[i], -row[i] * residual);
        for (int k = i; k < count; k++)
            at[place[k]] += row[i] * row[k];
    }
}

static void add_miss(band *b, const double *misses, int64_t node)
{
    int64_t place = place_of_miss(b, node);
    b->rows[place * b->room] += 1.0;
    add_right(b, place, -misses[node]);
}

static void add_bend(band *b, const double *coefficients, double damping, int64_t k)
{
    const er_drive_fit *fit = b->fit;
    double weight = fit->smoothing / (fit->cycle * fit->cycle), row[3], damped[3];
    int64_t place[3];
    for (int a = 0; a < 3; a++) {
        place[a] = place_of_coefficient(b, k + a);
        row[a] = weight * difference[a];
        damped[a] = damping * row[a];
    }
    add_row(b, 3, place, row, bend_at(fit, coefficients, k));
    if (damping > 0.0)
        add_row(b, 3, place, damped, 0.0);
}

static void add_condition(band *b, const double *coefficients, int64_t c)
{
    const er_drive_fit *fit = b->fit;
    int64_t width = fit->drive.degree + 1, place[ER_MOST_COEFFICIENTS];
    double value[ER_MOST_COEFFICIENTS];
    for (int64_t k = 0; k < width; k++) {
        place[k] = place_of_coefficient(b, fit->condition_first[c] + k);
        value[k] = fit->heavy * fit->condition_weights[c * width + k];
    }
    add_row(b, (int)width, place, value, fit->heavy * condition_error(fit, coefficients, c));
}

/* Places of an equation's unknowns, rising, with their derivatives; returns their number. */
static int sort_row(const band *b, int64_t i, int64_t j, const er_gear_row *row, int64_t *place, double *value)
{
    const er_gear_drive *drive = &b->fit->drive;
    int64_t node = i * drive->parts + j, coefficient = i > 0 ? i - 1 : 0, last = i + drive->degree;
    int64_t miss = node > 0 ? node - 1 : 0;
    int count = 0;
    while (coefficient <= last || miss <= node + 1) {
        int64_t one = coefficient <= last ? place_of_coefficient(b, coefficient) : INT64_MAX;
        int64_t other = miss <= node + 1 ? place_of_miss(b, miss) : INT64_MAX;
        place[count] = one < other ? one : other;
        value[count++] = b->fit->heavy * (one < other ? row->by_coefficient[coefficient++ - i + 1]
                                                      : row->by_miss[miss++ - node + 1]);
    }
    return count;
}

/* The equation of the node where step j of interval i begins. */
static void add_equation(band *b, const double *coefficients, const double *misses, int64_t i, int64_t j,
                         const er_gear_step *before, const er_gear_step *now)
{
    const er_gear_drive *drive = &b->fit->drive;
    int64_t place[ER_MOST_COEFFICIENTS + 4];
    double value[ER_MOST_COEFFICIENTS + 4];
    er_gear_row row;
    er_gear_find_row(drive, coefficients, i, j, before, now, &row);
    add_row(b, sort_row(b, i, j, &row, place, value), place, value,
            b->fit->heavy * er_gear_defect(drive, coefficients, misses, i * drive->parts + j, before, now));
}

static bool eliminate_group(band *b, const er_link_kernel *kernel, int64_t group)
{
    const er_drive_fit *fit = b->fit;
    int64_t coefficient = group - 1;
    if (coefficient >= 0 && coefficient < fit->drive.count + fit->drive.degree)
        b->rows[group * b->stride * b->room] += fit->idle;
    for (int64_t u = group * b->stride; u < (group + 1) * b->stride; u++) {
        int64_t rest = b->size - u;
        if (!fit->free[u])
            b->rows[u * b->room] += fit->held;
        if (!kernel->eliminate_row(rest < b->width ? (int)rest : b->width, b->room, b->rows + u * b->room, b->right + u))
            return false;
    }
    return true;
}

/* Adds all of an interval and what begins in it; the last one has all that is left. */
static void add_interval(band *b, const double *coefficients, const double *misses, double damping, int64_t i,
                         er_gear_step steps[2])
{
    const er_drive_fit *fit = b->fit;
    const er_gear_drive *drive = &fit->drive;
    int64_t bends = i + 1 < drive->count ? i + 1 : drive->count + drive->degree - 2;
    for (int64_t node = i * drive->parts + (i > 0); node <= (i + 1) * drive->parts; node++)
        add_miss(b, misses, node);
    for (int64_t k = i; k < bends; k++)
        add_bend(b, coefficients, damping, k);
    for (int64_t c = 0; c < fit->conditions; c++)
        if (fit->condition_first[c] == i)
            add_condition(b, coefficients, c);
    for (int64_t j = 0; j < drive->parts; j++) {
        int64_t node = i * drive->parts + j;
        er_gear_step *now = &steps[node % 2], *before = &steps[(node + 1) % 2];
        er_gear_step_at(drive, coefficients, misses, i, j, now);
        add_equation(b, coefficients, misses, i, j, before, now);
    }
}

static void go_back_up(band *b)
{
    for (int64_t u = b->size - 1; u >= 0; u--) {
        const double *row = b->rows + u * b->room;
        int64_t rest = b->size - u;
        double sum = b->right[u];
        for (int k = 1; k < (rest < b->width ? (int)rest : b->width); k++)
            sum -= row[k] * b->right[u + k];
        b->right[u] = sum / row[0];
    }
}

bool er_drive_fit_step(const er_drive_fit *fit, const double *coefficients, const double *misses, double damping,
                       double *work, double *step)
{
    const er_gear_drive *drive = &fit->drive;
    const er_link_kernel kernel = er_best_link_kernel();
    int64_t reach = drive->degree + 1;
    er_gear_step steps[2];
    band b = band_of(fit);
    b.rows = work;
    b.right = step;
    memset(step, 0, (size_t)b.size * sizeof *step);
    for (int64_t group = 0; group < reach; group++)
        clear_group(&b, group);
    for (int64_t i = 0; i < drive->count; i++) {
        clear_group(&b, i + reach);
        add_interval(&b, coefficients, misses, damping, i, steps);
        if (!eliminate_group(&b, &kernel, i))
            return false;
    }
    for (int64_t group = drive->count; group < drive->count + reach; group++)
        if (!eliminate_group(&b, &kernel, group))
            return false;
    go_back_up(&b);
    return true;
}
