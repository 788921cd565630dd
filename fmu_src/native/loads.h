/* Inverse dynamics of several states at once: M theta'' + h - J^T w in the rows of x.
 *
 * The recursive Newton-Euler algorithm in the bodies' frames.  It is written once, in loads_kernel.h,
 * and compiled for plain C and, where compiler and processor have it, for four states in the lanes
 * of AVX2 registers.
 */
#ifndef ER_LOADS_H
#define ER_LOADS_H

#include "robot_data.h"

/* States that one call takes. */
#define ER_LANES 4

#if defined(__GNUC__)
#define ER_ALIGNED __attribute__((aligned(32)))
#else
#define ER_ALIGNED
#endif

/* Quantities of several states: [angle][state]. */
typedef double er_lanes[ER_LANES];

/* The motion of the chain in each state. */
typedef struct {
    ER_ALIGNED er_lanes sine[ER_MAX_ANGLES], cosine[ER_MAX_ANGLES]; /* of theta */
    ER_ALIGNED er_lanes rate[ER_MAX_ANGLES];                        /* theta' [rad/s] */
    ER_ALIGNED er_lanes acceleration[ER_MAX_ANGLES];                /* theta'' [rad/s^2] */
} er_motion;

/* Sines and cosines of theta = reference + change, from those of the reference.
 *
 * changes: small or not [rad]; reference: sine and cosine per angle. */
typedef void er_turn_function(int angles, const double *reference_sine,
                              const double *reference_cosine, const er_lanes *change,
                              er_motion *motion);

/* Loads [N m], [x][state]; `wrench` on the robot at the TCP in base axes, NULL for none. */
typedef void er_loads_function(const er_robot *robot, const er_motion *motion, int states,
                               const double gravity[3], const double *wrench, er_lanes *load);

typedef struct {
    er_turn_function *turn;
    er_loads_function *loads;
} er_kernel;

/* The fastest kernel of this processor. */
er_kernel er_best_kernel(void);

/* Plain C. */
er_kernel er_plain_kernel(void);

#endif
