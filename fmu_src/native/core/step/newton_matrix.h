/* The matrices of Newton's method for a step's stages. */
#ifndef ER_NEWTON_MATRIX_H
#define ER_NEWTON_MATRIX_H

#include "run.h"

/* Has the inverses of M + l h D + (l h)^2 K for the eigenvalues l of A1 in the workspace, for a step of length h from
 * a state.  The mass matrix of an earlier posture nearby is kept.  False if they are not finite. */
bool er_linearise(const er_run *r, const er_state *state, double h);

/* Has the matrices of a state's linearisation in the workspace, which may hold them already. */
void er_linearise_as(const er_run *r, const er_state *state);

/* Lets the next step have matrices of its own. */
void er_relinearise(er_workspace *work);

#endif
