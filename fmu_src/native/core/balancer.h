/* Balancers: torques on links over the angles of their joints, cubics between points, straight beyond them. */
#ifndef ER_BALANCER_H
#define ER_BALANCER_H

#include "robot_data.h"

/* Torque of a balancer at an angle of its joint, and its derivatives by that. */
typedef struct {
    double torque, slope, bend; /* [N m, N m/rad, N m/rad^2] */
} er_balance;

er_balance er_balance_at(const er_balancer *balancer, double angle);

/* Adds the torques of a robot at rest to those that its gears must carry [N m], and their slopes to the gradient of
 * these [N m/rad], m x m by rows; q of the chain, x may be NULL. */
void er_balance_torque(const er_robot *robot, const double *q, const double *x, double *torque);
void er_balance_gradient(const er_robot *robot, const double *q, const double *x, double *gradient);

#endif
