/* What a model is made of: what it remembers, one flat block, er_memory, and what follows from that block and from
 * files, so that copying the block saves and restores a simulation. */
#ifndef ER_MEMORY_H
#define ER_MEMORY_H

#include <stddef.h>
#include <string.h>
#include "../step/columns.h"

#define ER_MAX_PATH 1024

/* What acts on the robot at the present time. */
typedef struct {
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS]; /* of the drives */
    er_load load; /* on the tool; its anchor is where it is now */
    double torque[ER_MAX_JOINTS]; /* of motors without a servo [N m] */
} er_held;

/* How a simulation starts: in equilibrium, of elements of hysteresis without load before, or with x = 0, or in
 * equilibrium from smaller or larger x: elements slip upwards or downwards. */
typedef enum { ER_FROM_UNLOADED,
               ER_UNDEFLECTED,
               ER_FROM_BELOW,
               ER_FROM_ABOVE,
               ER_INITIALS } er_initial;

/* What is fixed when a simulation starts. */
typedef struct {
    int curve; /* law of the gears, by its place in TORQUE_CURVES */
    bool quasistatic; /* equilibrium at every step's end instead of the equation of motion */
    er_initial initial; /* how a simulation starts */
    er_drive_kind drive; /* how drives follow their commands */
    double tolerance; /* error allowed at the TCP over a path [m], in dynamic mode */
    char trajectory[ER_MAX_PATH]; /* file of the joint motion; empty: commands */
} er_options;

/* All that a simulation remembers. */
typedef struct {
    er_options options;
    er_parameters parameters;
    double origin; /* when the model's time is 0 [s]: late times have few digits for seconds */
    uint64_t trajectory_fingerprint; /* hash of the trajectory's samples; 0: none */
    er_held held;
    er_past past; /* what the last step leaves to a moving robot without a trajectory */
    bool opposite[2]; /* quaternions of the elastic and the rigid tool: w was below 0 at the start */
    er_state state;   /* the last, of which few robots have all */
} er_memory;

/* Copies what a robot makes use of; a path has nothing behind its end. */
void er_memory_copy(const er_robot *robot, er_memory *to, const er_memory *from);

/* A posture of the elastic or the rigid robot, kept for the next that asks. */
typedef struct {
    double theta[ER_MAX_ANGLES];
    bool opposite;
    er_placement at; /* without bodies */
    double pose[7];
} er_posture;

/* The equation of motion solved for x'' at the present state . */
typedef struct {
    double acceleration[ER_MAX_ANGLES];            /* x'' [rad/s^2] */
    double mass[ER_MAX_ANGLES * ER_MAX_ANGLES];    /* factors of M */
    int pivot[ER_MAX_ANGLES];
    double gap[3];                                 /* from the TCP to the anchor [m] */
    er_contact_motion contact;                     /* where there is one */
    double wrench[6];                              /* on the tool, of spring and contact too */
    er_motion motion;
    double balance[ER_MAX_JOINTS];                 /* slopes of the balancers [N m/rad] */
    bool linked; /* the tangent has been prepared */
    er_links links;
} er_free_motion;

/* How a small shift of the state grows (growth.c); the shift is a column of the sensitivity. */
typedef struct {
    double recent;  /* crossings of late */
    bool is_carried; /* the shift follows the motion */
    double since;   /* [s] */
    bool has_grown; /* beyond all measure, until the next reset */
} er_growth;

typedef struct {
    er_robot robot;
    er_memory memory;
    er_kernel kernel;
    er_trajectory trajectory;
    char *resources; /* folder where relative paths are sought as well, or NULL; freed with the model */
    char loaded_path[ER_MAX_PATH]; /* file that the trajectory was read from */
    size_t hint;                   /* place in the trajectory */
    /* What means and gears were derived from. */
    int derived_law;
    double derived_tolerance; /* 0: nothing yet */
    er_parameters derived_parameters;
    er_means means;
    er_gears gears;
    er_workspace work;
    er_sensitivity sensitivity; /* of the present state, for derivatives */
    bool watches_growth;        /* somebody wants to hear of it */
    er_growth growth;
    er_turns turns;
    er_posture posture[2];      /* elastic and rigid, that were asked for last */
    er_free_motion free;        /* of the present state, for model exchange */
} er_model;

/* A change of drives, wrench, state and parameters; entries as in er_held, er_state and er_parameters. */
typedef struct er_change {
    er_held held;
    double x[ER_MAX_ANGLES], v[ER_MAX_ANGLES];
    er_parameters parameters;
    double elongation[ER_MAX_ELEMENTS]; /* these last, as few robots have any */
    er_motor_change motors;
} er_change;

/* Nothing changes, of what a robot has. */
static inline void er_change_nothing(const er_robot *robot, er_change *change)
{
    memset(change, 0, er_all_elements(robot) > 0 ? sizeof *change : offsetof(er_change, elongation));
}

#endif
