/* The arithmetic of a step for its four stages at once: positions, inverse dynamics, Newton's method.
 *
 * It is written once, in kernel_body.h, and compiled for plain C and, where compiler and processor
 * have it, with the four stages in the lanes of AVX2 registers.
 */
#ifndef ER_KERNEL_H
#define ER_KERNEL_H

#include "../elements/motors.h"
#include "../load/commands.h"

/* The motion of the chain in each state. */
typedef struct {
    ER_ALIGNED er_lanes sine[ER_MAX_ANGLES], cosine[ER_MAX_ANGLES]; /* of theta */
    ER_ALIGNED er_lanes rate[ER_MAX_ANGLES];                        /* theta' [rad/s] */
    ER_ALIGNED er_lanes acceleration[ER_MAX_ANGLES];                /* theta'' [rad/s^2] */
} er_motion;

/* Drives at the nodes of a step, [joint][node]; and the time since the load's start [s]. */
typedef struct {
    ER_ALIGNED er_lanes elapsed;
    ER_ALIGNED er_lanes q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS];
} er_nodes;

/* Drives that follow commands, a time `elapsed` after the step's start. */
typedef void er_drive_function(int joints, const er_command_powers powers, er_nodes *nodes);

/* Angles of the drives that theirs at the nodes are counted from [rad], with sines and cosines. */
typedef struct {
    double angle[ER_MAX_JOINTS], sine[ER_MAX_JOINTS], cosine[ER_MAX_JOINTS];
} er_reference;

/* The chain's motion at the nodes: drives and elastic coordinates, by [x][node]. */
typedef void er_move_function(const er_robot *robot, const er_nodes *nodes,
                              const er_reference *reference, const er_lanes *x, const er_lanes *v,
                              const er_lanes *acceleration, er_motion *motion);

/* A vector in each state, in base axes or in the frame behind a rotation. */
typedef er_lanes er_vector[3];

/* Force, then moment in each state, in base axes [N, N m]. */
typedef er_lanes er_pull[6];

/* Position of the TCP in the base frame [m], from sines and cosines alone. */
typedef void er_reach_function(const er_robot *robot, const er_motion *motion, int states, er_vector position);

/* Loads [N m], [x][state]; on the robot at the TCP act in base axes `wrench`, the same in all states, and
 * the force and moment `pull` of each; NULL for none. */
typedef void er_loads_function(const er_robot *robot, const er_motion *motion, int states,
                               const double gravity[3], const double *wrench, const er_lanes *pull, er_lanes *load);

/* Positions and rates at the stages of a step of length h [s] from those at its start and the stage accelerations. */
typedef void er_stages_function(int count, double h, const double *x, const double *v,
                                const er_lanes *acceleration, er_lanes *stage_x, er_lanes *stage_v);

/* Takes positions and rates at the start of a step of length h [s] to its end. */
typedef void er_finish_function(int count, double h, const er_lanes *acceleration, double *x, double *v);

/* The same values in all states: [x][state]. */
typedef void er_spread_function(int count, const double *values, er_lanes *lanes);

/* An entry of two complex systems that are solved side by side. */
typedef struct {
    double re[ER_PAIRS], im[ER_PAIRS];
} er_complex_pair;

/* The same as a factor: multiplied lane by lane with a pair, re and, with its parts exchanged, im add up
 * to the product. */
typedef struct {
    double re[2 * ER_PAIRS], im[2 * ER_PAIRS]; /* re, re; im, -im */
} er_factor;

/* The inverses of two complex symmetric n x n matrices by rows, of which the lower triangles count and are
 * overwritten, as A^-1 = (L^-T D^-1) L^-1 of A = L D L^T: L^-1 below the diagonal, the other factor from it
 * on.  Products with both take no longer than solving with L would, and none of them waits for another. There is no
 * pivoting, because the matrices are M + l D + l^2 K with positive definite M, D, K and |arg l| < pi/2: turned by -arg
 * l their numerical range lies in the right half plane.  False if a pivot is not finite. */
typedef bool er_invert_function(int n, er_complex_pair *matrix, er_factor *inverse);

/* One pass of Newton's method: takes the solution for these residuals off the stage accelerations
 * and returns its length. */
typedef double er_improve_function(int n, const er_factor *inverse, const er_lanes *residual, er_lanes *acceleration);

/* Length of the solution of the first system, the one next to the real axis, for a real right-hand
 * side: the error estimate's filter. */
typedef double er_filter_function(int n, const er_factor *inverse, const double *defect);

/* What the tangent of the loads needs to know about the motion at one rotation. */
typedef struct {
    er_vector turn[3];                  /* rows of R: frame before it from frame behind it; about a
                                           coordinate axis, its sine and cosine in the first row */
    er_lanes rate;                      /* about its axis */
    er_vector carry[3];                 /* rows of d(omega x (omega x r))/d omega before it, r its origin */
    er_vector sling[3];                 /* behind it, r the body's first moment */
    er_vector wobble[3];                /* of d(omega x I omega)/d omega */
    er_vector push_by, spin_by, rate_by; /* what comes of push, omega, omega' before, x axis */
    er_vector force_by, moment_by;      /* axis x the load of all beyond it */
} er_link;

/* All rotations of the chain, and the wrench at the tool. */
typedef struct {
    ER_ALIGNED er_link link[ER_MAX_ANGLES];
    ER_ALIGNED er_vector base[3];       /* rows of base_from_last */
    ER_ALIGNED er_vector force, moment; /* wrench and pull on the TCP, in the last frame */
    bool loaded;                        /* they are not zero */
} er_links;

/* A direction in which the motion of the chain changes: theta, theta', theta''. */
typedef struct {
    ER_ALIGNED er_lanes angle[ER_MAX_ANGLES], rate[ER_MAX_ANGLES], acceleration[ER_MAX_ANGLES];
} er_direction;

/* Prepares the tangent of the loads at a motion; the arguments are those of the loads. */
typedef void er_link_function(const er_robot *robot, const er_motion *motion,
                              const double gravity[3], const double *wrench, const er_lanes *pull, er_links *links);

/* The direction that the stages of a step of length h [s] take when x, x' at its start and the stage accelerations
 * change, the drives at rest; and what springs and dampers of these slopes [x][state] carry then [N m]. */
typedef void er_direct_function(const er_robot *robot, double h, const double *x, const double *v,
                                const er_lanes *acceleration, const er_lanes *slope,
                                const double *damping, er_direction *direction, er_lanes *load);

/* Adds what straight springs and dampers carry in each state: slope (x - zero) + damping v. */
typedef void er_carry_function(int count, int states, const double *slope, const double *zero,
                               const double *damping, const er_lanes *x, const er_lanes *v, er_lanes *load);

/* Displacement of the TCP along a direction of the motion [m], base axes. */
typedef void er_shift_function(const er_robot *robot, const er_links *links,
                               const er_direction *direction, er_vector shift);

/* Adds the derivative of the loads along a direction of the motion, of the wrench and of the pull, each
 * NULL for none. */
typedef void er_tangent_function(const er_robot *robot, const er_links *links,
                                 const er_direction *direction, const double *wrench,
                                 const er_lanes *pull, er_lanes *load);

/* w and z of motors at the stages of a step of length h [s], from p''. */
typedef void er_motor_stages_function(const er_robot *robot, int motors, double h, const er_nodes *nodes,
                                      const er_lanes *acceleration, er_motor_work *work);

/* Wind-ups of x and v of the chain; and keeps what acts on gears beside their torque: the residual so far. */
typedef void er_motor_wind_up_function(const er_robot *robot, int motors, const er_nodes *nodes, int states,
                                       const er_lanes *x, const er_lanes *v, const er_lanes *residual,
                                       er_motor_work *work);

/* Residuals of motors from those of the chain, where the gears' torques are now, and p''; with the torques at which
 * they slip, and those that motors without servo exert, NULL with servos [N m]. */
typedef void er_motor_residual_function(const er_robot *robot, int motors, const double *slip_torque,
                                        const double *torque, const er_nodes *nodes, const er_lanes *acceleration,
                                        const er_lanes *residual, er_motor_work *work);

/* Takes the motors' residuals into those of their gears before a pass of Newton's method, and what the pass has done
 * to the gears' accelerations into the motors' behind it; returns the square of the length of that [rad^2/s^4]. */
typedef void er_motor_before_function(const er_robot *robot, int motors, const er_lanes *acceleration,
                                      er_lanes *residual, er_motor_work *work);
typedef double er_motor_after_function(const er_robot *robot, int motors, const er_lanes *acceleration,
                                       const er_motor_work *work, er_lanes *motor_acceleration);

typedef struct {
    er_drive_function *drive;
    er_move_function *move;
    er_reach_function *reach;
    er_loads_function *loads;
    er_carry_function *carry;
    er_stages_function *stages;
    er_finish_function *finish;
    er_spread_function *spread;
    er_invert_function *invert;
    er_improve_function *improve;
    er_filter_function *filter;
    er_link_function *link;
    er_direct_function *direct;
    er_shift_function *shift;
    er_tangent_function *tangent;
    er_motor_stages_function *motor_stages;
    er_motor_wind_up_function *motor_wind_up;
    er_motor_residual_function *motor_residual;
    er_motor_before_function *motor_before;
    er_motor_after_function *motor_after;
} er_kernel;

/* The fastest kernel of this processor. */
er_kernel er_best_kernel(void);

/* Plain C. */
er_kernel er_plain_kernel(void);

#endif
