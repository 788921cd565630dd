/* The equations of motion of chain and motors solved for their accelerations, and how these follow all that they
 * depend on. */
#ifndef ER_FREE_MOTION_H
#define ER_FREE_MOTION_H

#include "drive_outputs.h"

/* The equation of motion solved for the accelerations of the elastic coordinates:
 *
 *     x'' = -M^-1 (M theta'' + h - J^T w - J_p^T K (a - p) - J_c^T F + S(x) + d x'),
 *
 * theta'' that of the drives, and how x'' follows all that it depends on.  elastic_robot/residual.py is the
 * same in Python.
 *
 * Solves for the present state, drives and load, into model->free; false if the mass matrix is singular. */
bool er_free_motion_solve(er_model *model);

/* Derivative of x'' along a change of drives, load and state [rad/s^2]; x'' has been solved for. */
void er_free_motion_along(er_model *model, const er_change *change, double *acceleration);

/* Acceleration of a motor [rad/s^2], and z' of its servo [N m/s]. */
double er_model_motor_acceleration(const er_model *model, int d);
double er_motor_acceleration_along(const er_model *model, const er_change *change, int d);
double er_model_integral_growth(const er_model *model, int d);
double er_integral_growth_along(const er_model *model, const er_change *change, int d);

/* Accelerations of all drives, of the motors that move by themselves theirs. */
void er_model_accelerations(const er_model *model, double *drives);
void er_accelerations_along(const er_model *model, const er_change *change, double *drives);

#endif
