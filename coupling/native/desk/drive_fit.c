#include "drive_fit.h"

#include "drive_fit_terms.h"

static bool is_in(er_stretch at, int64_t interval)
{
    return at.begin <= interval && interval < at.end;
}

static double value_of(const er_drive_fit *fit, er_stretch at, const double *coefficients, const double *misses)
{
    const er_drive_fit part = part_of(fit, at);
    const er_gear_drive *drive = &part.drive;
    const double *c = coefficients + at.begin, *m = misses + at.begin * drive->parts;
    er_gear_step steps[2];
    int64_t nodes = drive->count * drive->parts;
    double objective = m[nodes] * m[nodes], equations = 0.0;
    for (int64_t node = 0; node < nodes; node++) {
        er_gear_step *now = &steps[node % 2], *before = &steps[(node + 1) % 2];
        double defect;
        er_gear_step_at(drive, c, m, node / drive->parts, node % drive->parts, now);
        defect = er_gear_defect(drive, c, m, node, before, now);
        equations += defect * defect;
        objective += m[node] * m[node];
    }
    for (int64_t k = 0; k < drive->count + drive->degree - 2; k++) {
        double bend = bend_at(&part, c, k);
        objective += bend * bend;
    }
    for (int64_t k = 0; k < fit->conditions; k++)
        if (is_in(at, fit->condition_first[k])) {
            double error = condition_error(fit, coefficients, k);
            equations += error * error;
        }
    return 0.5 * (objective + fit->counted * fit->counted * equations);
}

double er_drive_fit_value(const er_drive_fit *fit, int64_t count, const er_stretch *stretches,
                          const double *coefficients, const double *misses)
{
    double value = 0.0;
    for (int64_t k = 0; k < count; k++)
        value += value_of(fit, stretches[k], coefficients, misses);
    return value;
}
