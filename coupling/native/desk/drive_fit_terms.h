/* Terms of the fit of a drive that its value and its steps have in common. */
#ifndef ER_DRIVE_FIT_TERMS_H
#define ER_DRIVE_FIT_TERMS_H

#include "drive_fit.h"

/* The fit of a stretch: its arrays begin where that does, but for the conditions. */
static inline er_drive_fit part_of(const er_drive_fit *fit, er_stretch at)
{
    er_drive_fit part = *fit;
    part.drive = er_gear_part(&fit->drive, at.begin, at.end);
    part.bend += at.begin;
    return part;
}

static inline double bend_at(const er_drive_fit *fit, const double *coefficients, int64_t k)
{
    const double *c = coefficients + k;
    return fit->smoothing * ((c[2] - 2.0 * c[1] + c[0]) / (fit->cycle * fit->cycle) - fit->bend[k]);
}

static inline double condition_error(const er_drive_fit *fit, const double *coefficients, int64_t c)
{
    int64_t width = fit->drive.degree + 1;
    double sum = -fit->condition_value[c];
    for (int64_t k = 0; k < width; k++)
        sum += fit->condition_weights[c * width + k] * coefficients[fit->condition_first[c] + k];
    return sum;
}

#endif
