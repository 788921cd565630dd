#include "spline.h"

#include <math.h>

/* The interval of a place that is counted in intervals; the outermost ones go on. */
static int64_t interval_at(const er_spline *spline, double place)
{
    if (!(place >= 1.0))
        return 0;
    if (place >= (double)spline->intervals)
        return spline->intervals - 1;
    return (int64_t)place;
}

void er_spline_at(const er_spline *spline, int64_t terms, const double *powers, int64_t count, const double *times,
                  double *values)
{
    enum { WIDTH = ER_MOST_DEGREE + 1 };
    int64_t width = spline->degree + 1, quantities = spline->quantities;
    double padded[WIDTH][WIDTH] = {{0.0}}; /* so that all loops have the same length */
    for (int64_t p = 0; p < terms; p++)
        for (int64_t j = 0; j < width; j++)
            padded[p][j] = powers[p * width + j];
    for (int64_t k = 0; k < count; k++, values += quantities) {
        double place = (times[k] - spline->start) / spline->spacing, weights[WIDTH];
        int64_t first = interval_at(spline, place);
        const double *row = spline->coefficients + first * quantities;
        place -= (double)first;
        for (int j = 0; j < WIDTH; j++)
            weights[j] = padded[WIDTH - 1][j];
        for (int p = WIDTH - 2; p >= 0; p--)
            for (int j = 0; j < WIDTH; j++)
                weights[j] = weights[j] * place + padded[p][j];
        for (int64_t q = 0; q < quantities; q++)
            values[q] = weights[0] * row[q];
        for (int64_t j = 1; j < width; j++)
            for (int64_t q = 0; q < quantities; q++)
                values[q] += weights[j] * row[j * quantities + q];
    }
}
