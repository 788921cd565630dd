/* The equation of motion solved for the accelerations of the elastic coordinates:
 *
 *     x'' = -M^-1 (M theta'' + h - J^T w - J_p^T K (a - p) - J_c^T F + S(x) + d x'),
 *
 * theta'' that of the drives, and how x'' follows all that it depends on.  elastic_robot/residual.py is the
 * same in Python.
 */
#ifndef ER_FREE_MOTION_H
#define ER_FREE_MOTION_H

#include "output_tangent.h"

/* Solves for the present state, drives and load, into model->free; false if the mass matrix is singular. */
bool er_free_motion_find(er_model *model);

/* Derivative of x'' along a change of drives, load and state [rad/s^2]; x'' has been solved for. */
void er_free_motion_along(er_model *model, const er_change *change, double *acceleration);

#endif
