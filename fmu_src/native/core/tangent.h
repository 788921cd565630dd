/* How the equilibrium and the outputs follow a change of what they are computed from. */
#ifndef ER_TANGENT_H
#define ER_TANGENT_H

#include <stddef.h>
#include <string.h>

#include "model.h"

/* How a placement moves along a change of its angles; base axes. */
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

/* A change of drives, wrench, state and parameters; entries as in er_held, er_state and er_parameters. */
typedef struct er_change {
    er_held held;
    double x[ER_MAX_ANGLES], v[ER_MAX_ANGLES];
    er_parameters parameters;
    double elongation[ER_MAX_ELEMENTS]; /* these last, as few robots have any */
    er_motor_change motors;
} er_change;

/* Nothing changes, of what a robot has. */
static inline void er_change_nothing(const er_robot *robot, er_change *change)
{
    memset(change, 0, er_all_elements(robot) > 0 ? sizeof *change : offsetof(er_change, elongation));
}

/* Changes of the chain's angles and rates, of the motors where they move by themselves; of the rigid robot those of
 * the commands. */
void er_angles_along(const er_model *model, const er_change *change, bool rigid, double *theta);
void er_rates_along(const er_model *model, const er_change *change, bool rigid, double *rate);
void er_chain_accelerations_along(const er_model *model, const er_change *change, double *acceleration);

/* Change of the motors' initial state. */
void er_start_motors_along(const er_model *model, const er_change *change, er_motor_change *motors);

/* Changes of what the drives do. */
void er_motor_angle_along(const er_model *model, const er_change *change, double *angles);
void er_motor_rate_along(const er_model *model, const er_change *change, double *rates);
double er_motor_torque_along(const er_model *model, const er_change *change, int k);
double er_wanted_along(const er_model *model, const er_change *change, int d);
double er_motor_acceleration_along(const er_model *model, const er_change *change, int d);
double er_integral_growth_along(const er_model *model, const er_change *change, int d);
void er_accelerations_along(const er_model *model, const er_change *change, double *drives);


/* Placements of the elastic or the rigid robot and how they move. */
typedef struct {
    er_placement at;
    er_placement_tangent along;
} er_moved;

/* At the present state along a change; with bodies where `bodies` asks for them. */
void er_move_along(const er_model *model, const er_change *change, bool rigid, bool bodies, er_moved *moved);

/* Change of x that keeps the model's state an equilibrium along a change of drives, wrench and parameters;
 * each coordinate stays on its branch.  False if there is none. */
bool er_equilibrium_along(const er_model *model, const er_change *acting, double *x);

/* Derivatives of the model's outputs along a change; arrays as those of er_model_tcp and so on. */
void er_tcp_along(er_model *model, const er_change *change, double pose[7]);
void er_rigid_along(er_model *model, const er_change *change, double pose[7]);
void er_velocity_along(const er_model *model, const er_change *change, double velocity[6]);
double er_gear_torque_along(const er_model *model, const er_change *change, int k);
double er_felt_torque_along(const er_model *model, const er_change *change, int k);
void er_deviation_along(const er_model *model, const er_change *change, double deviation[6]);
bool er_compliance_along(const er_model *model, const er_change *change, double compliance[6]);

/* Changes of the contact's force [N] and of the way to its plane [m]; none without a contact. */
void er_contact_of_model_along(const er_model *model, const er_change *change, double force[3], double *gap);

/* free_motion.c: the equation of motion solved for the accelerations of the elastic coordinates:
 *
 *     x'' = -M^-1 (M theta'' + h - J^T w - J_p^T K (a - p) - J_c^T F + S(x) + d x'),
 *
 * theta'' that of the drives, and how x'' follows all that it depends on.  elastic_robot/residual.py is the
 * same in Python.
 *
 * Solves for the present state, drives and load, into model->free; false if the mass matrix is singular. */
bool er_free_motion_find(er_model *model);

/* Derivative of x'' along a change of drives, load and state [rad/s^2]; x'' has been solved for. */
void er_free_motion_along(er_model *model, const er_change *change, double *acceleration);

#endif
