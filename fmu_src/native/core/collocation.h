/* The collocation equations of one step, solved by simplified Newton iteration. */
#ifndef ER_COLLOCATION_H
#define ER_COLLOCATION_H

#include "stepper.h"

/* The parts of an integration that its functions share. */
typedef struct {
    const er_system *system;
    const er_settings *settings;
    const er_means *means;
    er_workspace *work;
    int m;
} er_run;

/* Solves the collocation equations of a step from the accelerations in it; false if that fails.
 * `accuracy` is the error that the iteration may leave in x [rad]. */
bool er_solve_step(const er_run *r, const er_state *state, double h, double accuracy, er_step *step);

/* Depth of the contact at a state [m]. */
double er_contact_depth(const er_run *r, const er_state *state);

/* Rate of its depth at the end of the step solved last [m/s]; its motion there is in w->contact then. */
double er_end_approach(const er_run *r, const er_step *step);

/* The chain's motion at the nodes of a step, into w->motion, from w->x, w->v and the accelerations. */
void er_stage_motion(const er_run *r, const er_nodes *nodes, const er_lanes *acceleration);

/* From the TCP to the anchor at this motion, into w->gap. */
void er_stage_gap(const er_run *r, const er_nodes *nodes, int states);

/* How the sphere of a contact moves there, into w->contact, from w->x and w->v. */
void er_stage_contact(const er_run *r, const er_nodes *nodes, int states);

/* The spring's force across this gap, that of a contact that is touched and what the wrench has gained,
 * w->pull; NULL without all three. */
const er_lanes *er_stage_pull(const er_run *r, const er_nodes *nodes, int states, bool touching);

#endif
