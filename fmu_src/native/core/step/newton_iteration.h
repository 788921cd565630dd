/* The collocation equations of one step, solved by simplified Newton iteration. */
#ifndef ER_NEWTON_ITERATION_H
#define ER_NEWTON_ITERATION_H

#include "run.h"

/* Solves the collocation equations of a step from the accelerations in it; false if that fails.
 * `accuracy` is the error that the iteration may leave in x [rad]. */
bool er_solve_step(const er_run *r, const er_state *state, double h, double accuracy, er_step *step);

#endif
