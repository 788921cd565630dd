/* The elastic robot as one object: reset, step, outputs, and how these follow a change of what they are computed from.
 * elastic_robot/robot.py is the same in Python.
 *
 * What it remembers is one flat block, er_memory; the rest of the object follows from that block and
 * from files, so that copying the block saves and restores a simulation.
 */
#ifndef ER_MODEL_H
#define ER_MODEL_H

#include <stddef.h>
#include <string.h>

#include "sensitivity.h"

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

/* The equation of motion solved for x'' at the present state (free_motion.c). */
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
    er_turns turns;
    er_posture posture[2];      /* elastic and rigid, that were asked for last */
    er_free_motion free;        /* of the present state, for model exchange */
} er_model;

/* Returns a model with the robot's start values, to be freed; NULL if it does not fit into memory. */
er_model *er_model_create(const er_robot *robot);
void er_model_free(er_model *model);

/* Starts the model's time at `origin` [s], at rest relative to the drives, with the memory's options and
 * parameters.  Commands are looked at where there is no trajectory. */
bool er_model_reset(er_model *model, double origin, const er_command *command, const er_load *load,
                    er_failure *failure);

/* Moves on to a time since the origin under a load that begins now, and tells the state where that began;
 * the memory is as before if it fails. */
bool er_model_step(er_model *model, double end, const er_command *command, const er_load *load,
                   er_state *began, er_failure *failure);

/* Holds drives and load as they are at a time, the master's; a command is the motion at that time. */
void er_model_hold(er_model *model, double time, const er_command *command, const er_load *load);

/* Whether a trajectory, if there is one, covers a time. */
bool er_model_covers(er_model *model, double time, er_failure *failure);

/* The first time after one at which a drive's third derivative jumps; infinite if there is none. */
double er_model_next_kink(er_model *model, double time);

/* How the drives held now follow time: along a trajectory, or not at all. */
void er_model_held_by_time(er_model *model, er_held *change);

/* Lets changed parameters take effect from the present time on. */
void er_model_take_parameters(er_model *model, const er_parameters *parameters);

/* Replaces the memory; the trajectory is read again where it is another one.  `computed`: the memory
 * has been reset since its options were set.  The model is as before if that fails. */
bool er_model_restore(er_model *model, const er_memory *memory, bool computed, er_failure *failure);

/* Takes a step of a dynamic robot from a state and the past at that time again, solved to rounding, and
 * carries model->sensitivity along; the memory stays as it is. */
bool er_model_follow(er_model *model, const er_state *state, const er_past *past, double end,
                     const er_command *command, const er_load *load, er_failure *failure);

/* What moves its drives (model_drives.c).
 *
 * Has the trajectory of this path in the model, with the samples of `fingerprint` unless that is 0. */
bool er_model_require_trajectory(er_model *model, const char *path, uint64_t fingerprint, er_failure *failure);

/* The drives of the trajectory, or those that follow a command through a step. */
er_drives er_model_drives(er_model *model, double start, double end, const er_command *command);

/* Drives at a time, and the load as it is a while after its beginning; false if they do not cover it. */
bool er_model_find_held(const er_model *model, const er_drives *drives, double time, const er_load *load,
                        double elapsed, er_held *held, er_failure *failure);

/* Rest (statics.c, anchored_statics.c).
 *
 * Elastic coordinates at rest, S(x) + H = J^T w + J_p^T (K (a - p) + k max(0, d) n) - g, by the rules of
 * docs/model.md: only the torque H of elements of hysteresis has a memory. */
bool er_equilibrium(const er_robot *robot, const er_gears *gears, const er_history *history,
                    const double gravity[3], const double *q, const er_load *load, double *x,
                    er_failure *failure);

/* Rest by the way downhill in energy, which a contact spring, a contact and elements of hysteresis ask for; false
 * if there is none. */
bool er_anchored_equilibrium(const er_robot *robot, const er_gears *gears, const er_history *history,
                             const double gravity[3], const double *q, const er_load *load, double *x);

/* How a placement moves along a change of its angles; base axes. */
typedef struct {
    double tool_position[3];         /* of the TCP */
    double turn[3];                  /* small rotation of the tool [rad] */
    double axis[ER_MAX_ANGLES][3];   /* of z_i */
    double lever[ER_MAX_ANGLES][3];  /* of z_i x (TCP - o_i) */
    double weight[ER_MAX_ANGLES][3]; /* of z_i x first moment about o_i of the bodies beyond */
} er_placement_tangent;

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

/* Placements of the elastic or the rigid robot and how they move. */
typedef struct {
    er_placement at;
    er_placement_tangent along;
} er_moved;

/* At the present state along a change; with bodies where `bodies` asks for them. */
void er_move_along(const er_model *model, const er_change *change, bool rigid, bool bodies, er_moved *moved);

/* Change of x that keeps the model's state an equilibrium along a change of drives, wrench and parameters;
 * each coordinate stays on its branch.  False if there is none. */
bool er_equilibrium_along(const er_model *model, const er_change *acting, double *x);

/* Change of the motors' initial state. */
void er_start_motors_along(const er_model *model, const er_change *change, er_motor_change *motors);

/* Outputs (outputs.c, drive_outputs.c, free_motion.c), and behind each its derivative along a change.
 *
 * Pose of the elastic and of the rigid TCP: x, y, z, qx, qy, qz, qw; qw >= 0 where the model's time begins,
 * continuous from there on. */
void er_model_tcp(er_model *model, double pose[7]);
void er_tcp_along(er_model *model, const er_change *change, double pose[7]);
void er_model_rigid(er_model *model, double pose[7]);
void er_rigid_along(er_model *model, const er_change *change, double pose[7]);

/* Begins with qw >= 0 in the present posture. */
void er_model_orient(er_model *model);

/* Velocity [m/s] and angular velocity [rad/s] of the TCP; in quasi-static mode those of the rigid robot. */
void er_model_velocity(const er_model *model, double velocity[6]);
void er_velocity_along(const er_model *model, const er_change *change, double velocity[6]);

/* TCP minus rigid TCP [m] and the rotation vector between them [rad]. */
void er_model_deviation(const er_model *model, double deviation[6]);
void er_deviation_along(const er_model *model, const er_change *change, double deviation[6]);

/* How the contact is touched at the present state, and its wrench at the TCP; none without a contact.  Changes of its
 * force [N] and of the way to its plane [m]. */
void er_model_contact(const er_model *model, er_contact_motion *motion, double wrench[6]);
void er_contact_of_model_along(const er_model *model, const er_change *change, double force[3], double *gap);

/* Static compliance of the TCP at the present state, on its spring and contact: xx, xy, xz, yy, yz, zz [m/N].
 *
 * A gear inside its backlash counts with the stiffness of its flank, elements of hysteresis while they stick. */
bool er_model_compliance(const er_model *model, double compliance[6], er_failure *failure);
bool er_compliance_along(const er_model *model, const er_change *change, double compliance[6]);

/* Torque of the gear of entry k of x on its link [N m], and what its drive feels of it. */
double er_model_gear_torque(const er_model *model, int k);
double er_gear_torque_along(const er_model *model, const er_change *change, int k);
double er_model_felt_torque(const er_model *model, int k);
double er_felt_torque_along(const er_model *model, const er_change *change, int k);

/* Motors that move by themselves: none of them under ideal drives, and in quasi-static mode. */
int er_model_motors(const er_model *model);

/* What the gears make of the drives' angles, without wind-up [rad]. */
void er_model_driven(const er_model *model, double *angles);

/* Angles and rates of the chain, those of the motors in it; of the rigid robot those of the commands.  And the
 * accelerations of the drives alone. */
void er_model_angles(const er_model *model, bool rigid, double *theta);
void er_angles_along(const er_model *model, const er_change *change, bool rigid, double *theta);
void er_model_rates(const er_model *model, bool rigid, double *rate);
void er_rates_along(const er_model *model, const er_change *change, bool rigid, double *rate);
void er_model_chain_accelerations(const er_model *model, double *acceleration);
void er_chain_accelerations_along(const er_model *model, const er_change *change, double *acceleration);

/* Angles and rates of all drives at the gears' output [rad, rad/s], of the motors that move by themselves theirs; and
 * the torque of the motor of the gear of entry k of x there [N m]. */
void er_model_motor_angle(const er_model *model, double *angles);
void er_motor_angle_along(const er_model *model, const er_change *change, double *angles);
void er_model_motor_rate(const er_model *model, double *rates);
void er_motor_rate_along(const er_model *model, const er_change *change, double *rates);
double er_model_motor_torque(const er_model *model, int k);
double er_motor_torque_along(const er_model *model, const er_change *change, int k);

/* What a motor's servo wants beside its rate, w [rad/s]; its acceleration [rad/s^2], and z' [N m/s]; the accelerations
 * of all drives, of the motors that move by themselves theirs. */
double er_model_wanted(const er_model *model, int d);
double er_wanted_along(const er_model *model, const er_change *change, int d);
double er_model_motor_acceleration(const er_model *model, int d);
double er_motor_acceleration_along(const er_model *model, const er_change *change, int d);
double er_model_integral_growth(const er_model *model, int d);
double er_integral_growth_along(const er_model *model, const er_change *change, int d);
void er_model_accelerations(const er_model *model, double *drives);
void er_accelerations_along(const er_model *model, const er_change *change, double *drives);

/* The equation of motion solved for the accelerations of the elastic coordinates (free_motion.c):
 *
 *     x'' = -M^-1 (M theta'' + h - J^T w - J_p^T K (a - p) - J_c^T F + S(x) + d x'),
 *
 * theta'' that of the drives, and how x'' follows all that it depends on.  elastic_robot/residual.py is the
 * same in Python.
 *
 * Solves for the present state, drives and load, into model->free; false if the mass matrix is singular. */
bool er_free_motion_find(er_model *model);

/* Derivative of x'' along a change of drives, load and state [rad/s^2]; x'' has been solved for. */
void er_free_motion_along(er_model *model, const er_change *change, double *acceleration);

#endif
