/* Numerical settings, the same for the model in Python: elastic_robot/settings.py says what each is.
 *
 * They are read with the robot.  What is not among them belongs to the C core alone.
 */
#ifndef ER_SETTINGS_H
#define ER_SETTINGS_H

#include <math.h>

#define ER_EACH_SETTING(DO)                                                                         \
    DO(tcp_per_local_error)                                                                         \
    DO(tcp_per_local_error_with_play)                                                               \
    DO(longest_step)                                                                                \
    DO(first_step)                                                                                  \
    DO(shortest_step)                                                                               \
    DO(most_tries)                                                                                  \
    DO(most_tries_per_longest)                                                                      \
    DO(usual_speed)                                                                                 \
    DO(usual_local_error)                                                                           \
    DO(most_step)                                                                                   \
    DO(most_deflection)                                                                             \
    DO(shift_by_jump)                                                                               \
    DO(safety)                                                                                      \
    DO(strongest_cut)                                                                               \
    DO(fastest_growth)                                                                              \
    DO(smallest_growth)                                                                             \
    DO(stretch)                                                                                     \
    DO(cut_after_failure)                                                                           \
    DO(iteration)                                                                                   \
    DO(most_passes)                                                                                 \
    DO(usual_passes)                                                                                \
    DO(same_length)                                                                                 \
    DO(slack)                                                                                       \
    DO(slack_of_width)                                                                              \
    DO(landing)                                                                                     \
    DO(landing_iteration)                                                                           \
    DO(most_landings)                                                                               \
    DO(neutral_torque)                                                                              \
    DO(equilibrium_step)                                                                            \
    DO(most_equilibrium_passes)                                                                     \
    DO(slow_equilibrium)                                                                            \
    DO(across_play)                                                                                 \
    DO(closest_samples)                                                                             \
    DO(most_sample)                                                                                 \
    DO(tries_per_sample)                                                                            \
    DO(time_slack)                                                                                  \
    DO(time_slack_of_time)                                                                          \
    DO(stop_slack)                                                                                  \
    DO(neighbour_ratio)

#define ER_DECLARE_SETTING(name) double name;
typedef struct {
    ER_EACH_SETTING(ER_DECLARE_SETTING)
} er_settings;

/* How far the sums of communication steps near a time may be apart [s]. */
static inline double er_time_rounding(const er_settings *settings, double time)
{
    return settings->time_slack_of_time * fabs(time);
}

/* How far from a time is still that time [s]. */
static inline double er_slack_at(const er_settings *settings, double time)
{
    return settings->time_slack + er_time_rounding(settings, time);
}

#endif
