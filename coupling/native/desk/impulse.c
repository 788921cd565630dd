#include "impulse.h"

#include <math.h>

/* Pivots of the spline's matrix until they do not change any more. */
enum { PIVOTS = 40 };

/* Second differences m of the spline from those of the samples, d: m[i-1] + 4 m[i] + m[i+1] = 6 d[i], and at the ends
 * m[0] - 2 m[1] + m[2] = 0, so that m[1] = d[1]. */
static void find_bends(const er_sampled_torque *s)
{
    const double *y = s->torque;
    double *m = s->work, pivot[PIVOTS] = {4.0};
    int64_t last = s->count - 1;
    for (int k = 1; k < PIVOTS; k++)
        pivot[k] = 4.0 - 1.0 / pivot[k - 1];
    m[1] = y[2] - 2.0 * y[1] + y[0];
    m[last - 1] = y[last] - 2.0 * y[last - 1] + y[last - 2];
    for (int64_t i = 2; i < last - 1; i++) {
        double before = i == 2 ? m[1] : m[i - 1] / pivot[i - 3 < PIVOTS ? i - 3 : PIVOTS - 1];
        m[i] = 6.0 * (y[i + 1] - 2.0 * y[i] + y[i - 1]) - before;
    }
    for (int64_t i = last - 2; i > 1; i--)
        m[i] = (m[i] - m[i + 1]) / pivot[i - 2 < PIVOTS ? i - 2 : PIVOTS - 1];
    m[0] = 2.0 * m[1] - m[2];
    m[last] = 2.0 * m[last - 1] - m[last - 2];
}

/* Integral over the first part u of piece i, in distances of samples. */
static double integral(const er_sampled_torque *s, int64_t i, double u)
{
    const double *y = s->torque + i, *m = s->work + i;
    double v = 1.0 - u, u2 = u * u, v2 = v * v;
    double straight = y[0] * (u - 0.5 * u2) + y[1] * 0.5 * u2;
    return straight + (m[1] * u2 * (0.25 * u2 - 0.5) + m[0] * (0.5 * v2 - 0.25 * v2 * v2 - 0.25)) / 6.0;
}

void er_impulses(const er_sampled_torque *sampled, int64_t steps, double length, double *impulse)
{
    int64_t last = sampled->count - 1, piece = 0;
    find_bends(sampled);
    for (int64_t k = 0; k < steps; k++) {
        double from = (double)k * length / sampled->spacing, to = (double)(k + 1) * length / sampled->spacing;
        double end = fmin(to, (double)last), at = fmin(from, end), sum = sampled->torque[last] * (to - fmax(from, end));
        while (piece < last - 1 && (double)(piece + 1) <= at)
            piece++;
        for (;; piece++) {
            double stop = piece < last - 1 ? fmin(end, (double)(piece + 1)) : end;
            sum += integral(sampled, piece, stop - (double)piece) - integral(sampled, piece, at - (double)piece);
            at = stop;
            if (piece == last - 1 || !(at < end))
                break;
        }
        impulse[k] = sampled->spacing * sum;
    }
}
