/* Torques of the drives, and beside each its derivative along a change. */
#ifndef ER_DRIVE_OUTPUTS_H
#define ER_DRIVE_OUTPUTS_H

#include "outputs.h"

/* What a drive feels of its gear, of entry k of x, and the torque of its motor at the gear's output [N m]. */
double er_model_felt_torque(const er_model *model, int k);
double er_felt_torque_along(const er_model *model, const er_change *change, int k);
double er_model_motor_torque(const er_model *model, int k);
double er_motor_torque_along(const er_model *model, const er_change *change, int k);

/* What a motor's servo wants beside its rate, w [rad/s]. */
double er_model_rate_error(const er_model *model, int d);
double er_rate_error_along(const er_model *model, const er_change *change, int d);
/* Change of the motors' initial state. */
void er_start_motors_along(const er_model *model, const er_change *change, er_motor_change *motors);

#endif
