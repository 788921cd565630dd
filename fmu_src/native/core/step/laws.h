/* Steps that end where a law changes, and the laws that a state obeys from there on. */
#ifndef ER_LAWS_H
#define ER_LAWS_H

#include "run.h"

/* Stage accelerations to start from: the last step's polynomial, continued, or those of a part of a step that was tried. */
void er_guess(const er_run *r, const er_state *state, double h, er_step *step);
void er_guess_part(const er_run *r, double ratio, const er_step *tried, er_step *step);

/* Solves a step as one of the tries that are left. */
bool er_try_step(const er_run *r, const er_state *state, double h, double accuracy, er_step *step);

/* Shortens a solved step until it ends on the boundary that it crosses, in w->landed. */
bool er_land(const er_run *r, const er_state *state, const er_step *step, const er_crossing *crossing);

/* Has the state at the end of a step obey what is beyond its crossing. */
void er_take_crossing(const er_run *r, er_state *state, const er_step *step, const er_crossing *crossing);

/* A step that lands on what another coordinate crosses may end just behind a motor's reversal, which no later step
 * has in it. */
void er_stick_reversed(const er_run *r, er_state *state);

/* Whether the contact presses, and the laws of servos at their torque limits: inputs may have moved plane and commands
 * since. */
void er_obey_inputs(const er_run *r, er_state *state);

#endif
