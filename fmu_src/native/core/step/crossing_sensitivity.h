/* What the columns of sensitivities lack where a step ends at a change of law. */
#ifndef ER_CROSSING_SENSITIVITY_H
#define ER_CROSSING_SENSITIVITY_H

#include "columns.h"

/* Corrects the columns where a coordinate or an element is about to change its law at the end of a step. */
void er_sensitivity_cross(er_sensitivity *sensitivity, const er_run *r, const er_state *state,
                          const er_step *step, const er_crossing *crossing);

/* Corrects them where a servo has reached or left its torque limit at the end of a step and obeys another law. */
void er_sensitivity_limit(er_sensitivity *sensitivity, const er_run *r, const er_state *state, const er_step *step,
                          int motor, er_servo_law before);

/* An element of hysteresis slips from now on: its elongation does not depend on anything. */
void er_sensitivity_slip(er_sensitivity *sensitivity, int element);

#endif
