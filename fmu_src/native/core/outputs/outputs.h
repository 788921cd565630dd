/* Outputs of tool and gears, and beside each its derivative along a change. */
#ifndef ER_OUTPUTS_H
#define ER_OUTPUTS_H

#include "tangent.h"

/* Pose of the elastic and of the rigid TCP: x, y, z, qx, qy, qz, qw; qw >= 0 where the model's time begins,
 * continuous from there on. */
void er_model_tcp(er_model *model, double pose[7]);
void er_tcp_along(er_model *model, const er_change *change, double pose[7]);
void er_model_rigid(er_model *model, double pose[7]);
void er_rigid_along(er_model *model, const er_change *change, double pose[7]);

/* Begins with qw >= 0 in the present posture. */
void er_model_orient(er_model *model);

/* Velocity [m/s] and angular velocity [rad/s] of the TCP; in quasi-static mode those of the rigid robot. */
void er_model_velocity(const er_model *model, double velocity[6]);
void er_velocity_along(const er_model *model, const er_change *change, double velocity[6]);

/* TCP minus rigid TCP [m] and the rotation vector between them [rad]. */
void er_model_deviation(const er_model *model, double deviation[6]);
void er_deviation_along(const er_model *model, const er_change *change, double deviation[6]);

/* How the contact is touched at the present state, and its wrench at the TCP; none without a contact.  Changes of its
 * force [N] and of the way to its plane [m]. */
void er_model_contact(const er_model *model, er_contact_motion *motion, double wrench[6]);
void er_contact_of_model_along(const er_model *model, const er_change *change, double force[3], double *gap);

/* Torque of the gear of entry k of x on its link [N m]. */
double er_model_gear_torque(const er_model *model, int k);
double er_gear_torque_along(const er_model *model, const er_change *change, int k);

#endif
