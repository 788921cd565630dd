/* The step of a drive's fit: the band matrix of a stretch, built and eliminated interval by interval. */
#include "drive_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "drive_fit_terms.h"

/* Groups of a store for each that stays when it is emptied. */
#define ROOM 8

/* Changes solved for twice may differ by so much, or by a part of the largest one, which the next step corrects. */
static const double agreed = 1e-13, minded = 1e-6;

static const double difference[3] = {1.0, -2.0, 1.0};

/* The matrix of a stretch: rows of its upper half, each from its diagonal on, with blanks behind; and the right-hand
 * side.  Groups are cleared before something is added to them, and eliminated when nothing more is.  Those that were
 * eliminated stand in a store: where it is full they are solved for as if nothing changed behind them, and all but the
 * last ones leave it. */
typedef struct {
    const er_drive_fit *whole;
    er_drive_fit fit;
    er_stretch at;
    int64_t coefficients[2], misses[2]; /* first that may change, and first behind that may not */
    int64_t stride, size;
    int64_t first, lag, capacity; /* first group in the store; how many stay in it, and how many it has room for */
    int width, room;              /* of a row, and with the blanks */
    double *rows, *right, *solution; /* from the first group on */
    double *step, cut, largest;   /* largest difference of changes that were solved for twice, largest change */
} band;

static band band_of(const er_drive_fit *fit, er_stretch at, int64_t lag)
{
    band b = {.whole = fit, .fit = part_of(fit, at), .at = at, .lag = lag};
    const er_gear_drive *drive = &b.fit.drive;
    bool left = at.begin > 0, right = at.end < fit->drive.count;
    int64_t groups = drive->count + drive->degree + 1;
    b.coefficients[0] = left ? drive->degree + 1 : 0;
    b.coefficients[1] = right ? drive->count - 1 : drive->count + drive->degree;
    b.misses[0] = left ? 2 : 1; /* the path's first one is none */
    b.misses[1] = drive->count * drive->parts + (right ? -1 : 1);
    b.stride = drive->parts + 1;
    b.size = groups * b.stride;
    b.width = (int)((drive->degree + 2) * b.stride);
    b.room = b.width + ER_LANES;
    b.capacity = lag < groups / ROOM ? ROOM * lag : groups;
    return b;
}

/* Rows of the store, with the groups that an interval reaches. */
static int64_t rows_of(const band *b)
{
    return (b->capacity + b->fit.drive.degree + 2) * b->stride;
}

static double *row_at(const band *b, int64_t place)
{
    return b->rows + (place - b->first * b->stride) * b->room;
}

static double *right_at(const band *b, int64_t place)
{
    return b->right + place - b->first * b->stride;
}

static int64_t place_of_coefficient(const band *b, int64_t k)
{
    return b->stride * (1 + k);
}

/* Of a node so many steps behind the start of an interval, or before it. */
static int64_t place_of_miss(const band *b, int64_t i, int64_t steps)
{
    const er_gear_drive *drive = &b->fit.drive;
    int64_t part = steps - 1;
    for (; part < 0; i--)
        part += drive->parts;
    for (; part >= drive->parts; i++)
        part -= drive->parts;
    return (i + (drive->degree + 3) / 2) * b->stride + 1 + part;
}

/* Whether an unknown may change; what meets other stretches may not. */
static bool is_free(const band *b, int64_t group, int64_t in_group)
{
    const er_gear_drive *drive = &b->fit.drive;
    int64_t number = in_group == 0 ? group - 1 : (group - (drive->degree + 3) / 2) * drive->parts + in_group;
    const int64_t *range = in_group == 0 ? b->coefficients : b->misses;
    return range[0] <= number && number < range[1];
}

static void clear_group(band *b, int64_t group)
{
    memset(row_at(b, group * b->stride), 0, (size_t)(b->stride * b->room) * sizeof(double));
    memset(right_at(b, group * b->stride), 0, (size_t)b->stride * sizeof(double));
}

/* Adds the square of a row of a residual, whose places rise, and its product with the residual. */
static void add_row(band *b, int count, const int64_t *place, const double *row, double residual)
{
    for (int i = 0; i < count; i++) {
        double *at = row_at(b, place[i]) - place[i];
        *right_at(b, place[i]) -= row[i] * residual;
        for (int k = i; k < count; k++)
            at[place[k]] += row[i] * row[k];
    }
}

static void add_miss(band *b, double miss, int64_t i, int64_t steps)
{
    int64_t place = place_of_miss(b, i, steps);
    *row_at(b, place) += 1.0;
    *right_at(b, place) -= miss;
}

static void add_bend(band *b, const double *coefficients, double damping, int64_t k)
{
    const er_drive_fit *fit = &b->fit;
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
    const er_drive_fit *fit = b->whole;
    int64_t width = fit->drive.degree + 1, place[ER_MOST_COEFFICIENTS];
    double value[ER_MOST_COEFFICIENTS];
    for (int64_t k = 0; k < width; k++) {
        place[k] = place_of_coefficient(b, fit->condition_first[c] - b->at.begin + k);
        value[k] = fit->heavy * fit->condition_weights[c * width + k];
    }
    add_row(b, (int)width, place, value, fit->heavy * condition_error(fit, coefficients - b->at.begin, c));
}

/* Places of an equation's unknowns, rising, with their derivatives; returns their number. */
static int sort_row(const band *b, int64_t i, int64_t j, const er_gear_row *row, int64_t *place, double *value)
{
    int64_t coefficients = b->fit.drive.degree + 2, k = i > 0 ? 0 : 1, m = i > 0 || j > 0 ? 0 : 1;
    int64_t of_coefficient = place_of_coefficient(b, i + k - 1), of_miss = place_of_miss(b, i, j + m - 1);
    int count = 0;
    while (k < coefficients || m < 3) {
        bool is_coefficient = k < coefficients && (m == 3 || of_coefficient < of_miss);
        place[count] = is_coefficient ? of_coefficient : of_miss;
        value[count++] = b->fit.heavy * (is_coefficient ? row->by_coefficient[k] : row->by_miss[m]);
        if (is_coefficient)
            of_coefficient = place_of_coefficient(b, i + k++);
        else
            of_miss = place_of_miss(b, i, j + m++);
    }
    return count;
}

/* The equation of the node where step j of interval i begins. */
static void add_equation(band *b, const double *coefficients, const double *misses, int64_t i, int64_t j,
                         const er_gear_step *before, const er_gear_step *now)
{
    const er_gear_drive *drive = &b->fit.drive;
    int64_t place[ER_MOST_COEFFICIENTS + 4];
    double value[ER_MOST_COEFFICIENTS + 4];
    er_gear_row row;
    er_gear_find_row(drive, coefficients, i, j, before, now, &row);
    add_row(b, sort_row(b, i, j, &row, place, value), place, value,
            b->fit.heavy * er_gear_defect(drive, coefficients, misses, i * drive->parts + j, before, now));
}

static bool eliminate_group(band *b, const er_link_kernel *kernel, int64_t group)
{
    int64_t coefficient = group - 1;
    if (coefficient >= 0 && coefficient < b->fit.drive.count + b->fit.drive.degree)
        *row_at(b, group * b->stride) += b->fit.idle;
    for (int64_t r = 0; r < b->stride; r++) {
        int64_t place = group * b->stride + r, rest = b->size - place, width = b->width - r;
        double *row = row_at(b, place), *right = right_at(b, place);
        if (!is_free(b, group, r)) {
            memset(row, 0, (size_t)b->width * sizeof *row);
            row[0] = 1.0;
            *right = 0.0;
        } else if (!kernel->eliminate_row((int)(rest < width ? rest : width), b->room, row, right))
            return false;
    }
    return true;
}

/* Adds all of an interval and what begins in it; the last one has all that is left. */
static void add_interval(band *b, const double *coefficients, const double *misses, double damping, int64_t i,
                         er_gear_step steps[2])
{
    const er_gear_drive *drive = &b->fit.drive;
    int64_t bends = i + 1 < drive->count ? i + 1 : drive->count + drive->degree - 2;
    for (int64_t j = i > 0; j <= drive->parts; j++)
        add_miss(b, misses[i * drive->parts + j], i, j);
    for (int64_t k = i; k < bends; k++)
        add_bend(b, coefficients, damping, k);
    for (int64_t c = 0; c < b->whole->conditions; c++)
        if (b->whole->condition_first[c] - b->at.begin == i)
            add_condition(b, coefficients, c);
    for (int64_t j = 0; j < drive->parts; j++) {
        int64_t node = i * drive->parts + j;
        er_gear_step *now = &steps[node % 2], *before = &steps[(node + 1) % 2];
        er_gear_step_at(drive, coefficients, misses, i, j, now);
        add_equation(b, coefficients, misses, i, j, before, now);
    }
}

/* Solves for the groups in the store before `next`, and writes what may change. */
static void write_changes(band *b, int64_t next)
{
    int64_t begin = b->first * b->stride, count = next * b->stride - begin, twice = b->first + b->fit.drive.degree + 2;
    memset(b->solution + count, 0, (size_t)b->width * sizeof(double));
    for (int64_t u = count - 1; u >= 0; u--) {
        const double *row = b->rows + u * b->room;
        double sum = b->right[u];
        for (int k = 1; k < b->width; k++)
            sum -= row[k] * b->solution[u + k];
        b->solution[u] = sum / row[0];
    }
    for (int64_t group = b->first; group < next; group++)
        for (int64_t r = 0; r < b->stride; r++) {
            double change = b->solution[group * b->stride + r - begin];
            double *step = b->step + (b->at.begin + group) * b->stride + r;
            if (!is_free(b, group, r))
                continue;
            if (b->first > 0 && group < twice)
                b->cut = fmax(b->cut, fabs(change - *step));
            b->largest = fmax(b->largest, fabs(change));
            *step = change;
        }
}

/* Empties the store but for the last groups before `next`, and what these reach. */
static void keep_last(band *b, int64_t next)
{
    int64_t first = next - b->lag, gone = (first - b->first) * b->stride;
    int64_t stay = (b->lag + b->fit.drive.degree + 1) * b->stride;
    memmove(b->rows, b->rows + gone * b->room, (size_t)(stay * b->room) * sizeof(double));
    memmove(b->right, b->right + gone, (size_t)stay * sizeof(double));
    b->first = first;
}

static bool follow_stretch(band *b, const er_link_kernel *kernel, const double *coefficients, const double *misses, double damping)
{
    const er_gear_drive *drive = &b->fit.drive;
    int64_t reach = drive->degree + 1;
    er_gear_step steps[2];
    coefficients += b->at.begin;
    misses += b->at.begin * drive->parts;
    for (int64_t group = 0; group < reach; group++)
        clear_group(b, group);
    for (int64_t i = 0; i < drive->count; i++) {
        if (i - b->first == b->capacity) {
            write_changes(b, i);
            keep_last(b, i);
        }
        clear_group(b, i + reach);
        add_interval(b, coefficients, misses, damping, i, steps);
        if (!eliminate_group(b, kernel, i))
            return false;
    }
    for (int64_t group = drive->count; group < drive->count + reach; group++)
        if (!eliminate_group(b, kernel, group))
            return false;
    write_changes(b, drive->count + reach);
    return true;
}

static er_solved solve_stretch(const er_drive_fit *fit, const er_link_kernel *kernel, er_stretch at,
                               const double *coefficients, const double *misses, double damping, int64_t lag,
                               double *step)
{
    for (;; lag *= 2) {
        band b = band_of(fit, at, lag);
        int64_t rows = rows_of(&b);
        double *memory = calloc((size_t)(rows * (b.room + 2) + b.width), sizeof *memory);
        bool positive;
        if (memory == NULL)
            return ER_NO_MEMORY;
        b.rows = memory;
        b.right = memory + rows * b.room;
        b.solution = b.right + rows;
        b.step = step;
        positive = follow_stretch(&b, kernel, coefficients, misses, damping);
        free(memory);
        if (!positive)
            return ER_NOT_POSITIVE;
        if (!(b.cut > fmax(agreed, minded * b.largest)))
            return ER_SOLVED;
    }
}

er_solved er_drive_fit_step(const er_drive_fit *fit, int64_t count, const er_stretch *stretches, const double *coefficients,
                            const double *misses, double damping, int64_t lag, double *step)
{
    const er_link_kernel kernel = er_best_link_kernel();
    int64_t size = (fit->drive.count + fit->drive.degree + 1) * (fit->drive.parts + 1);
    memset(step, 0, (size_t)size * sizeof *step);
    for (int64_t k = 0; k < count; k++) {
        er_solved solved = solve_stretch(fit, &kernel, stretches[k], coefficients, misses, damping, lag, step);
        if (solved != ER_SOLVED)
            return solved;
    }
    return ER_SOLVED;
}
