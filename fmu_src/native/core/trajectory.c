#include "trajectory.h"

#include <math.h>
#include <string.h>

/* The interval that holds a time: the largest k with time[k] <= time, at most the last but one.
 * From the hint on in strides that double, then by halves. */
static size_t interval(const er_trajectory *t, double time, size_t *hint)
{
    size_t low = *hint, high, last = t->samples - 1, stride = 1;
    if (low == 0 || t->time[low] <= time) {
        for (high = low + 1; high < last && t->time[high] <= time; stride *= 2) {
            low = high;
            high = last - low > stride ? low + stride : last;
        }
    } else {
        for (high = low; low > 0 && t->time[low] > time; stride *= 2) {
            high = low;
            low = low > stride ? low - stride : 0;
        }
    }
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (t->time[middle] <= time)
            low = middle;
        else
            high = middle;
    }
    return *hint = low;
}

bool er_drives_cover(const er_drives *drives, double time, double slack, er_failure *failure)
{
    const er_trajectory *t = drives->trajectory;
    double s = time - drives->start, last;
    if (t == NULL)
        return true;
    last = t->time[t->samples - 1];
    if (s >= -slack && s <= last + slack)
        return true;
    return er_fail(failure, "time: expected %.9g to %.9g s, the trajectory's, got %.9g s", t->start,
                   t->start + last, t->start + s);
}

/* Weights of rise, rates and accelerations at both ends of an interval, for the value of its quintic or
 * for one of that's derivatives. */
typedef struct {
    double rise, rate[2], bend[2];
} weights;

static double weighted(const weights *w, double rise, const double *left, const double *right, int n)
{
    return w->rise * rise + (w->rate[0] * left[n] + w->rate[1] * right[n]) +
           (w->bend[0] * left[2 * n] + w->bend[1] * right[2 * n]);
}

/* q, q', q'' a part u of an interval of length h behind its start; by joint, two neighbouring rows. */
static void along_quintic(int n, const double *left, const double *right, double h, double u, double *q,
                          double *qd, double *qdd)
{
    double u2 = u * u, u3 = u2 * u, d = 1.0 / h;
    const weights value = {
        u3 * (10.0 - u * (15.0 - 6.0 * u)),
        {h * u * (1.0 - u2 * (6.0 - u * (8.0 - 3.0 * u))), h * u3 * (-4.0 + u * (7.0 - 3.0 * u))},
        {h * h * 0.5 * u2 * (1.0 - u * (3.0 - u * (3.0 - u))), h * h * 0.5 * u3 * (1.0 - u * (2.0 - u))},
    };
    const weights rate = {
        d * 30.0 * u2 * (1.0 - u * (2.0 - u)),
        {1.0 - u2 * (18.0 - u * (32.0 - 15.0 * u)), u2 * (-12.0 + u * (28.0 - 15.0 * u))},
        {h * u * (1.0 - u * (4.5 - u * (6.0 - 2.5 * u))), h * u2 * (1.5 - u * (4.0 - 2.5 * u))},
    };
    const weights bend = {
        d * d * 60.0 * u * (1.0 - u * (3.0 - 2.0 * u)),
        {d * u * (-36.0 + u * (96.0 - 60.0 * u)), d * u * (-24.0 + u * (84.0 - 60.0 * u))},
        {1.0 - u * (9.0 - u * (18.0 - 10.0 * u)), u * (3.0 - u * (12.0 - 10.0 * u))},
    };
    for (int i = 0; i < n; i++) {
        double rise = right[i] - left[i];
        q[i] = left[i] + weighted(&value, rise, left + i, right + i, n);
        qd[i] = weighted(&rate, rise, left + i, right + i, n);
        qdd[i] = weighted(&bend, rise, left + i, right + i, n);
    }
}

void er_drives_at(const er_drives *drives, double time, double *q, double *qd, double *qdd)
{
    const er_trajectory *t = drives->trajectory;
    const double *row;
    double s = time - drives->start, h;
    size_t k;
    if (t == NULL) {
        for (int i = 0; i < drives->joints; i++)
            er_command_at(drives->powers[i], s, &q[i], &qd[i], &qdd[i]);
        return;
    }
    if (s < 0.0)
        s = 0.0;
    if (s > t->time[t->samples - 1])
        s = t->time[t->samples - 1];
    k = interval(t, s, drives->hint);
    row = t->row + k * er_trajectory_width(t) + 1;
    h = t->time[k + 1] - t->time[k];
    along_quintic(t->joints, row, row + er_trajectory_width(t), h, (s - t->time[k]) / h, q, qd, qdd);
}

/* q''' a part u of an interval behind its start, likewise. */
static void bend_along_quintic(int n, const double *left, const double *right, double h, double u,
                               double *third)
{
    double d = 1.0 / h;
    const weights by_time = {
        d * d * d * (60.0 - u * (360.0 - 360.0 * u)),
        {d * d * (-36.0 + u * (192.0 - 180.0 * u)), d * d * (-24.0 + u * (168.0 - 180.0 * u))},
        {d * (-9.0 + u * (36.0 - 30.0 * u)), d * (3.0 - u * (24.0 - 30.0 * u))},
    };
    for (int i = 0; i < n; i++)
        third[i] = weighted(&by_time, right[i] - left[i], left + i, right + i, n);
}

void er_drives_by_time(const er_drives *drives, double time, double *q, double *qd, double *qdd)
{
    const er_trajectory *t = drives->trajectory;
    size_t bytes = (size_t)drives->joints * sizeof *q, k;
    double position[ER_MAX_JOINTS], s = time - drives->start, h;
    const double *row;
    memset(q, 0, bytes);
    memset(qd, 0, bytes);
    memset(qdd, 0, bytes);
    if (t == NULL || s < 0.0 || s > t->time[t->samples - 1])
        return;
    er_drives_at(drives, time, position, q, qd);
    k = interval(t, s, drives->hint);
    row = t->row + k * er_trajectory_width(t) + 1;
    h = t->time[k + 1] - t->time[k];
    bend_along_quintic(t->joints, row, row + er_trajectory_width(t), h, (s - t->time[k]) / h, qdd);
}

double er_drives_next_kink(const er_drives *drives, double time, double end, double jump)
{
    const er_trajectory *t = drives->trajectory;
    if (t == NULL)
        return end;
    for (size_t k = interval(t, fmax(time - drives->start, 0.0), drives->hint) + 1; k + 1 < t->samples;
         k++) {
        double at = t->time[k] + drives->start;
        if (at >= end)
            break;
        if (t->jump[k] > jump && at > time) /* the difference rounds: `time` may be this sample's */
            return at;
    }
    return end;
}

#define ORDERS ER_COMMAND_ORDERS
#define POWERS ER_COMMAND_POWERS

/* A value that counts as far as it lies between zero and its bound: it is the median of the three. */
typedef struct {
    double value, bound;
} limited;

static double median(limited x)
{
    double low = x.bound < 0.0 ? x.bound : 0.0, high = x.bound > 0.0 ? x.bound : 0.0;
    double below = x.value < high ? x.value : high;
    return below > low ? below : low;
}

/* Derivative of the median along a change of value and bound: of those of the three that are the median,
 * the one that stays in the middle. */
static double one_sided(limited x, double value, double bound)
{
    const double at[3] = {0.0, x.value, x.bound}, change[3] = {0.0, value, bound};
    double middle = median(x), tied[3] = {0.0};
    int below = 0, count = 0;
    for (int k = 0; k < 3; k++) {
        int place = count;
        below += at[k] < middle;
        if (at[k] != middle)
            continue;
        for (; place > 0 && tied[place - 1] > change[k]; place--)
            tied[place] = tied[place - 1];
        tied[place] = change[k];
        count++;
    }
    return tied[below == 0 ? 1 : 0];
}

/* At a corner the mean of both sides. */
static double median_along(limited x, limited change)
{
    return 0.5 * (one_sided(x, change.value, change.bound) -
                  one_sided(x, -change.value, -change.bound));
}

/* What limits need to know of a drive and of both steps. */
typedef struct {
    double rate, acceleration; /* last commanded */
    double end[ORDERS];        /* where the drive arrived */
    double per_known, counts;  /* 1 over the length of the last step; as far as it counts here [s] */
} history;

/* What q'' would gain over one more step as long as the last one, and what the drive missed in angle and
 * rate; linear but for what the history subtracts. */
static void find_limits(const double command[ORDERS], const history *past, limited *gained,
                        limited *angle, limited *rate)
{
    double c = past->counts, missed = command[2] - past->end[2];
    double mean = (command[1] - past->rate) * past->per_known;
    *gained = (limited){4.0 * command[2] + 2.0 * past->acceleration - 6.0 * mean,
                        2.0 * (command[2] - past->acceleration)};
    *angle = (limited){command[0] - past->end[0], 0.5 * c * c * missed};
    *rate = (limited){command[1] - past->end[1], c * missed};
}

/* q + q' s + q'' s^2 / 2 + j s^3 / 6 */
static void put_command(const double command[ORDERS], double jerk, double powers[POWERS])
{
    powers[0] = command[0];
    powers[1] = command[1];
    powers[2] = 0.5 * command[2];
    powers[3] = jerk / 6.0;
    powers[4] = 0.0;
}

/* Adds (1 - u)^3 (a + (3 a + b) u), u = s / h, that begins with -angle and -rate; `per` is 1 / h. */
static void add_offset(double angle, double rate, double per, double powers[POWERS])
{
    double a = -angle * per, b = -rate, c = 3.0 * a + b, per2 = per * per;
    powers[0] -= angle;
    powers[1] += b;
    powers[2] += 3.0 * (a - c) * per;
    powers[3] += (3.0 * c - a) * per2;
    powers[4] -= c * (per2 * per);
}

bool er_command_counts(const er_robot *robot, double length)
{
    return length > robot->settings.shortest_step * robot->settings.longest_step;
}

/* The drives over a step, and, unless NULL, how they follow the command. */
static void follow(const er_robot *robot, const er_past *past, const er_command *command,
                   double length, er_command_powers powers, er_command_slopes slopes)
{
    double ratio = robot->settings.neighbour_ratio;
    double counts = fmin(past->length, ratio * length), per = 1.0 / fmax(past->length, length / ratio);
    double per_known = 1.0 / past->length, per_length = 1.0 / length;
    const history none = {0.0, 0.0, {0.0, 0.0, 0.0}, per_known, counts};
    bool followed = past->length > 0.0 && er_command_counts(robot, length);
    for (int i = 0; i < robot->joints; i++) {
        const double given[ORDERS] = {command->q[i], command->qd[i], command->qdd[i]};
        const history last = {past->rate[i], past->acceleration[i], {past->q[i], past->qd[i], past->qdd[i]}, per_known, counts};
        bool told = !isnan(command->jerk[i]);
        limited gained, angle, rate;
        put_command(given, told ? command->jerk[i] : 0.0, powers[i]);
        if (followed) {
            find_limits(given, &last, &gained, &angle, &rate);
            if (!told)
                powers[i][3] = per * median(gained) / 6.0;
            add_offset(median(angle), median(rate), per_length, powers[i]);
        }
        for (int k = 0; slopes != NULL && k < ORDERS; k++) {
            double unit[ORDERS] = {0.0};
            limited of_gained, of_angle, of_rate;
            unit[k] = 1.0;
            put_command(unit, 0.0, slopes[i][k]);
            if (!followed)
                continue;
            find_limits(unit, &none, &of_gained, &of_angle, &of_rate);
            if (!told)
                slopes[i][k][3] = per * median_along(gained, of_gained) / 6.0;
            add_offset(median_along(angle, of_angle), median_along(rate, of_rate), per_length,
                       slopes[i][k]);
        }
    }
}

void er_command_follow(const er_robot *robot, const er_past *past, const er_command *command,
                       double length, er_command_powers powers)
{
    follow(robot, past, command, length, powers, NULL);
}

void er_command_along(const er_robot *robot, const er_past *past, const er_command *command,
                      double length, er_command_slopes slopes)
{
    er_command_powers powers;
    follow(robot, past, command, length, powers, slopes);
}
