/* Derivatives of a placement along a change of its angles, and of the static loads in it. */
#ifndef ER_PLACEMENT_TANGENT_H
#define ER_PLACEMENT_TANGENT_H

#include "chain.h"

/* How everything moves along a direction; base axes. */
typedef struct {
    double tool_position[3];         /* of the TCP */
    double turn[3];                  /* small rotation of the tool [rad] */
    double axis[ER_MAX_ANGLES][3];   /* of z_i */
    double lever[ER_MAX_ANGLES][3];  /* of z_i x (TCP - o_i) */
    double weight[ER_MAX_ANGLES][3]; /* of z_i x first moment about o_i of the bodies beyond */
} er_placement_tangent;

/* Along a change of theta; `weight` only where the placement has bodies and `bodies` asks for it. */
void er_placement_along(const er_robot *robot, const er_placement *placement, const double *theta,
                        bool bodies, er_placement_tangent *tangent);

/* Derivative of er_static_torque along that and a change of the wrench [N m]. */
void er_static_torque_along(const er_robot *robot, const er_placement *placement,
                            const er_placement_tangent *along, const double gravity[3],
                            const double wrench[6], const double wrench_change[6], double *torque);

/* Derivative of er_static_torque_gradient along that and a change of the wrench [N m/rad]. */
void er_static_torque_gradient_along(const er_robot *robot, const er_placement *placement,
                                     const er_placement_tangent *along, const double gravity[3],
                                     const double wrench[6], const double wrench_change[6],
                                     double *gradient);

#endif
