/* What the columns of sensitivities lack where a step ends at a change of law. */
#ifndef ER_CROSSING_SENSITIVITY_H
#define ER_CROSSING_SENSITIVITY_H

#include "columns.h"

/* Correct the columns at the end of a step where, beyond it, a coordinate obeys the law beyond the edge of its backlash,
 * an element slips, a contact begins, or a servo has reached or left its torque limit. */
void er_sensitivity_edge(er_sensitivity *sensitivity, const er_run *r, const er_state *state, const er_step *step,
                         const er_crossing *crossing);
void er_sensitivity_release(er_sensitivity *sensitivity, const er_run *r, const er_state *state, const er_step *step,
                            const er_crossing *crossing);
void er_sensitivity_contact(er_sensitivity *sensitivity, const er_run *r, const er_state *state, const er_step *step,
                            const er_crossing *crossing);
void er_sensitivity_limit(er_sensitivity *sensitivity, const er_run *r, const er_state *state, const er_step *step,
                          const er_crossing *crossing);

/* An element of hysteresis slips from now on: its elongation does not depend on anything. */
void er_sensitivity_slip(er_sensitivity *sensitivity, int element);

#endif
