/* The robot as data: the chain of its rotations, its bodies and the start values of its parameters.
 *
 * Units are SI: m, kg, s, rad, N.  Frames as in elastic_robot/__init__.py: the base is fixed; a
 * body's frame has its origin on its joint's axis and is parallel to the base at zero posture.
 */
#ifndef ER_ROBOT_DATA_H
#define ER_ROBOT_DATA_H

#include <math.h>

#include "../../io/lines.h"

/* Numerical settings, the same for the model in Python: elastic_robot/settings.py says what each is.
 *
 * They are read with the robot.  What is not among them belongs to the C core alone.
 */
#define ER_EACH_SETTING(DO)                                                                         \
    DO(tcp_per_local_error)                                                                         \
    DO(tcp_per_local_error_with_backlash)                                                               \
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
    DO(across_backlash)                                                                                 \
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

/* A robot larger than this is refused when it is read; so no array depends on the robot. */
#define ER_MAX_JOINTS 12
#define ER_MAX_ANGLES (3 * ER_MAX_JOINTS) /* each joint's own rotation and two tilts */
#define ER_MAX_KNOTS 64                   /* points of a joint's own torque table */
#define ER_MAX_STOPS 6                    /* elements of a gear's hysteresis */
#define ER_MAX_ELEMENTS ((ER_MAX_STOPS + 1) * ER_MAX_JOINTS) /* and one of each motor's friction */
#define ER_MAX_COORDINATES (ER_MAX_ANGLES + ER_MAX_JOINTS)   /* entries of x, then motors */
#define ER_MAX_ERRORS 8                   /* sines of a gear's kinematic error */
#define ER_MAX_BALANCER_POINTS 256
#define ER_MAX_GUID 64

/* An axis along none of the coordinates. */
enum { ER_ASKEW = -1 };

/* Mass distribution in a body's frame, about its origin. */
typedef struct {
    double mass;       /* [kg] */
    double moment[3];  /* mass times centre of mass [kg m] */
    double inertia[6]; /* xx, yy, zz, xy, xz, yz about the origin [kg m^2] */
} er_body;

/* One rotation of the chain, with the body behind it. */
typedef struct {
    double axis[3];   /* unit vector, in the body's axes */
    int along;        /* the coordinate axis that it has or is opposite to, 0 to 2, or ER_ASKEW */
    double origin[3]; /* in the frame before it [m] */
    bool shifted;     /* the origin is not zero: a joint, not a tilt */
    bool loaded;      /* there is a body */
    int drive;        /* number of the joint that drives it, or -1 */
    int elastic;      /* its place in x, or -1 */
    er_body body;
} er_rotation;

/* Points of the characteristic curve of a joint that has its own. */
typedef struct {
    int points; /* 0: no table */
    double angle[ER_MAX_KNOTS];  /* rising [rad] */
    double torque[ER_MAX_KNOTS]; /* rising [N m] */
} er_table;

/* An element of a gear's hysteresis or of a motor's friction: a spring in series with dry friction. */
typedef struct {
    int coordinate; /* the entry of x that it acts on; of motors, their number behind the last entry */
    double share;   /* of the torque at which all of the coordinate's elements slip */
    double angle;   /* elongation at which it slips [rad] */
} er_element;

/* A sine of a gear's kinematic error: amplitude sin(order q + phase), q that of the drive. */
typedef struct {
    double amplitude, order, phase; /* [rad, 1, rad] */
} er_error_sine;

/* A torque on the link of an entry of x, about the axis of its joint, over the joint's angle. */
typedef struct {
    int coordinate;
    int points;
    double angle[ER_MAX_BALANCER_POINTS];  /* rising [rad] */
    double torque[ER_MAX_BALANCER_POINTS]; /* [N m] */
    double slope[ER_MAX_BALANCER_POINTS];  /* [N m/rad] */
} er_balancer;

/* Motor and servo of a joint, seen at the gear's output. */
typedef struct {
    int joint, coordinate;  /* that it drives, and the entry of x of its gear */
    double inertia;         /* of the rotor [kg m^2] */
    double slip_angle;      /* of its friction [rad] */
    double viscous;         /* [N m s/rad] */
    double stribeck;        /* part of the friction at rest that is lost at higher rates */
    double stribeck_rate;   /* at which 63 % of that are lost [rad/s] */
    double position_gain;   /* rate over angle [1/s] */
    double rate_gain;       /* torque over rate [N m s/rad] */
    double integral_gain;   /* torque over angle, of the integrated rate [N m/rad] */
    double feed_forward;    /* part of the commanded rate that is fed forward */
    double torque_limit;    /* [N m]; infinite: none */
    double load_friction;   /* friction over the gear's torque */
} er_motor;

/* The numbers that may change while the model runs; the first m entries of each array count. */
typedef struct {
    double gravity[3];                /* base axes [m/s^2] */
    double stiffness[ER_MAX_ANGLES];  /* [N m/rad] */
    double damping[ER_MAX_ANGLES];    /* [N m s/rad] */
    double backlash[ER_MAX_ANGLES];   /* half width of the backlash [rad]; 0 for tilts */
    double hysteresis[ER_MAX_ANGLES]; /* torque at which all elements slip [N m]; 0 without any */
    double friction[ER_MAX_JOINTS];   /* of each motor at rest [N m] */
} er_parameters;

typedef struct {
    char guid[ER_MAX_GUID];
    int joints;   /* n */
    int elastics; /* m, entries of x */
    int angles;   /* rotations of the chain */
    int errors;   /* sines of all gears, in the order of their joints */
    int balancers;
    er_rotation rotation[ER_MAX_ANGLES];
    int drive_angle[ER_MAX_JOINTS];   /* place of each drive among the rotations */
    int elastic_angle[ER_MAX_ANGLES]; /* place of each entry of x among the rotations */
    int elastic_joint[ER_MAX_ANGLES]; /* joint (from 0) that owns each entry of x */
    int elastic_tilt[ER_MAX_ANGLES];  /* 0: torsion about the joint's axis; 1, 2: its tilts */
    double reach[ER_MAX_ANGLES];      /* of each entry of x to the TCP, all joints in a line [m] */
    double tool_position[3];          /* TCP in the last body's frame [m] */
    double tool_rotation[9];          /* body_from_tool, by rows */
    er_table table[ER_MAX_ANGLES];    /* by entry of x */
    int elements;                     /* of hysteresis, in the order of their entries of x */
    er_element element[ER_MAX_ELEMENTS]; /* those, then that of each motor */
    int first_element[ER_MAX_COORDINATES + 1]; /* the first of each coordinate, and behind the last */
    int motors;
    er_motor motor[ER_MAX_JOINTS];
    int motor_of[ER_MAX_COORDINATES];  /* that moves a coordinate, or is it; -1: none */
    int joint_motor[ER_MAX_JOINTS];    /* that of a joint; -1: none */
    er_parameters parameters;         /* start values */
    er_settings settings;
    int first_error[ER_MAX_JOINTS + 1];   /* the first of each joint, and behind the last */
    er_error_sine error[ER_MAX_ERRORS * ER_MAX_JOINTS];
    er_balancer balancer[ER_MAX_JOINTS];
} er_robot;

/* Elements of gears and motors. */
static inline int er_all_elements(const er_robot *robot)
{
    return robot->elements + robot->motors;
}

/* Reads the lines that `coupling.native.robot_text` writes, up to `end`. */
bool er_robot_parse(er_robot *robot, er_lines *lines);

#endif
