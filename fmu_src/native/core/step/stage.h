/* Drives, motion, pull and contact at the nodes of a step. */
#ifndef ER_STAGE_H
#define ER_STAGE_H

#include "run.h"

/* Drives at its stages and its end, and the sines that their changes are counted from. */
void er_drive_step(const er_run *r, double time, double h);

/* The chain's motion at the nodes of a step, into w->motion, from w->x, w->v and the accelerations. */
void er_stage_motion(const er_run *r, const er_nodes *nodes, const er_lanes *acceleration);

/* From the TCP to the anchor at this motion, into w->gap. */
void er_stage_gap(const er_run *r, const er_nodes *nodes, int states);

/* How the sphere of a contact moves there, into w->contact, from w->x and w->v. */
void er_stage_contact(const er_run *r, const er_nodes *nodes, int states);

/* The spring's force across this gap, that of a contact that is touched and what the wrench has gained,
 * w->pull; NULL without all three. */
const er_lanes *er_stage_pull(const er_run *r, const er_nodes *nodes, int states, bool touching);

/* Depth of the contact at a state [m]. */
double er_contact_depth(const er_run *r, const er_state *state);

/* Rate of its depth at the end of the step solved last [m/s]; its motion there is in w->contact then. */
double er_end_approach(const er_run *r, const er_step *step);

/* Depths of the contact along a solved step that starts from there. */
void er_step_depths(const er_run *r, const er_state *state, const er_start *from, er_step *step);

#endif
