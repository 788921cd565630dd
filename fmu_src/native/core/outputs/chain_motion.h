/* Angles and rates of drives and chain, and beside each its derivative along a change. */
#ifndef ER_CHAIN_MOTION_H
#define ER_CHAIN_MOTION_H

#include "memory.h"

/* Motors that move by themselves: none of them under ideal drives, and in quasi-static mode. */
int er_model_motors(const er_model *model);

/* What the gears make of the drives' angles, without wind-up [rad]. */
void er_model_driven(const er_model *model, double *angles);

/* Angles and rates of the chain, those of the motors in it; of the rigid robot those of the commands. */
void er_model_angles(const er_model *model, bool rigid, double *theta);
void er_angles_along(const er_model *model, const er_change *change, bool rigid, double *theta);
void er_model_rates(const er_model *model, bool rigid, double *rate);
void er_rates_along(const er_model *model, const er_change *change, bool rigid, double *rate);
/* Angles and rates of all drives at the gears' output [rad, rad/s], of the motors that move by themselves theirs. */
void er_model_motor_angle(const er_model *model, double *angles);
void er_motor_angle_along(const er_model *model, const er_change *change, double *angles);
void er_model_motor_rate(const er_model *model, double *rates);
void er_motor_rate_along(const er_model *model, const er_change *change, double *rates);

/* Accelerations of the chain where the drives have theirs [rad/s^2], and by these alone; and how they change. */
void er_chain_accelerations(const er_model *model, const double *drives, double *acceleration);
void er_chain_accelerations_along(const er_model *model, const er_change *change, const double *drives,
                                  const double *drives_along, double *acceleration);

#endif
