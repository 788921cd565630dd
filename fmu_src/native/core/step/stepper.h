/* Time stepper of the robot under prescribed drives and a held wrench.
 *
 * Four-stage Gauss collocation in the accelerations, simplified Newton iteration, step length from an
 * estimate of the local error.  Each coordinate obeys one smooth law (its region) through a whole
 * step; where the collocation polynomial leaves a region, and where the drives' third derivative
 * jumps, the step is ended.  elastic_robot/motion.py solves the same equation by SciPy. */
#ifndef ER_STEPPER_H
#define ER_STEPPER_H

#include "run.h"

/* Bytes of a state that a robot makes use of, and a copy of them. */
size_t er_state_size(const er_robot *robot);
void er_state_copy(const er_robot *robot, er_state *to, const er_state *from);

/* Begins an integration at the x and v that are in the state, and its elements of hysteresis. */
void er_state_start(er_state *state, const er_robot *robot, const er_gears *gears, double time);

/* Integrates to a time.  If that fails, the state is somewhere in between. */
bool er_advance(er_state *state, const er_system *system, const er_means *means, double end,
                er_workspace *work, er_failure *failure);

#endif
