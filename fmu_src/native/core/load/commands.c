#include "commands.h"

#include <math.h>
#include <stddef.h>

#define ORDERS ER_COMMAND_ORDERS
#define POWERS ER_COMMAND_POWERS

/* A value that counts as far as it lies between zero and its bound: it is the median of the three. */
typedef struct {
    double value, bound;
} limited;

static double limited_median(limited x)
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
    double middle = limited_median(x), tied[3] = {0.0};
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
    return 0.5 * (one_sided(x, change.value, change.bound) - one_sided(x, -change.value, -change.bound));
}

/* What limits need to know of a drive and of both steps. */
typedef struct {
    double rate, acceleration; /* last commanded */
    double end[ORDERS];        /* where the drive arrived */
    double per_known, counts;  /* 1 over the length of the last step; as far as it counts here [s] */
} history;

/* What q'' would gain over one more step as long as the last one, and what the drive missed in angle and
 * rate; linear but for what the history subtracts. */
static void find_command_limits(const double command[ORDERS], const history *past, limited *gained,
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
static void follow_command(const er_robot *robot, const er_past *past, const er_command *command,
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
        bool has_jerk = !isnan(command->jerk[i]);
        limited gained, angle, rate;
        put_command(given, has_jerk ? command->jerk[i] : 0.0, powers[i]);
        if (followed) {
            find_command_limits(given, &last, &gained, &angle, &rate);
            if (!has_jerk)
                powers[i][3] = per * limited_median(gained) / 6.0;
            add_offset(limited_median(angle), limited_median(rate), per_length, powers[i]);
        }
        for (int k = 0; slopes != NULL && k < ORDERS; k++) {
            double unit[ORDERS] = {0.0};
            limited of_gained, of_angle, of_rate;
            unit[k] = 1.0;
            put_command(unit, 0.0, slopes[i][k]);
            if (!followed)
                continue;
            find_command_limits(unit, &none, &of_gained, &of_angle, &of_rate);
            if (!has_jerk)
                slopes[i][k][3] = per * median_along(gained, of_gained) / 6.0;
            add_offset(median_along(angle, of_angle), median_along(rate, of_rate), per_length, slopes[i][k]);
        }
    }
}

void er_command_follow(const er_robot *robot, const er_past *past, const er_command *command,
                       double length, er_command_powers powers)
{
    follow_command(robot, past, command, length, powers, NULL);
}

void er_command_along(const er_robot *robot, const er_past *past, const er_command *command,
                      double length, er_command_slopes slopes)
{
    er_command_powers powers;
    follow_command(robot, past, command, length, powers, slopes);
}
