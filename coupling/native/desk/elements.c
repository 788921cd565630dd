#include "elements.h"

#include <math.h>
#include <string.h>

/* Changes of the wind-up that turn nothing [rad]: far above rounding, worth micronewton metres. */
#define NO_TURN 1e-12

/* Where a path is, and where it has turned last: from there on each element moves as the wind-up does, until it slips. */
typedef struct {
    double last, cell; /* the last wind-up [rad]; in units of NO_TURN */
    int way;           /* -1, 0: it has not moved, 1 */
    double turn;       /* wind-up where it has turned last [rad] */
    double *at_turn;   /* elongations there [rad] */
} element_path;

static element_path begin_path(const er_gear_elements *elements, double wind_up, const double *start, double *at_turn)
{
    memcpy(at_turn, start, (size_t)elements->count * sizeof *start);
    return (element_path){wind_up, rint(wind_up / NO_TURN), 0, wind_up, at_turn};
}

static void find_elongations(const er_gear_elements *elements, const element_path *path, double *elongation)
{
    double moved = path->last - path->turn;
    for (int64_t e = 0; e < elements->count; e++) {
        double a = elements->slip_angle[e];
        elongation[e] = fmin(fmax(path->at_turn[e] + moved, -a), a);
    }
}

static void move_on(const er_gear_elements *elements, double wind_up, element_path *path)
{
    double cell = rint(wind_up / NO_TURN);
    int way = (cell > path->cell) - (cell < path->cell);
    if (way * path->way < 0) {
        find_elongations(elements, path, path->at_turn);
        path->turn = path->last;
    }
    path->way = way != 0 ? way : path->way;
    path->cell = cell;
    path->last = wind_up;
}

void er_elements_along(const er_gear_elements *elements, int64_t count, const double *wind_up, const double *start,
                       double *elongation)
{
    double *at_turn = elongation + (count - 1) * elements->count; /* the last row is filled last */
    element_path path = begin_path(elements, wind_up[0], start, at_turn);
    for (int64_t k = 0; k < count; k++, elongation += elements->count) {
        move_on(elements, wind_up[k], &path);
        find_elongations(elements, &path, elongation);
    }
}

void er_elements_hold(const er_gear_drive *drive, const er_gear_elements *elements, const double *wind_up,
                      const double *start, double *impulse, double *slope, double *elongation, double *room)
{
    const double share = 0.5 * drive->step / ER_FINE;
    double *s = room + elements->count;
    element_path path = begin_path(elements, wind_up[0], start, room);
    memset(slope, 0, (size_t)(drive->count * drive->parts * 2 * ER_QUARTERS) * sizeof *slope);
    for (int64_t node = 0; node < drive->count * drive->parts; node++, wind_up += ER_QUARTERS) {
        move_on(elements, wind_up[0], &path);
        find_elongations(elements, &path, elongation + node * elements->count);
        for (int half = 0; half < 2; half++, slope += ER_QUARTERS, impulse++) {
            double sum = 0.0;
            for (int f = 0; f < ER_FINE; f++) {
                const double *weights = drive->fine + (half * ER_FINE + f) * ER_QUARTERS;
                double x = 0.0, sticks = 0.0;
                for (int p = 0; p < ER_QUARTERS; p++)
                    x += weights[p] * wind_up[p];
                move_on(elements, x, &path);
                find_elongations(elements, &path, s);
                for (int64_t e = 0; e < elements->count; e++) {
                    double stiffness = elements->slip_torque[e] / elements->slip_angle[e];
                    sum += stiffness * s[e];
                    sticks += fabs(s[e]) < elements->slip_angle[e] ? stiffness : 0.0;
                }
                for (int p = 0; p < ER_QUARTERS; p++)
                    slope[p] += share * sticks * weights[p];
            }
            *impulse = share * sum;
        }
    }
}
