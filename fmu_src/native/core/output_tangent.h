/* How the equilibrium and the outputs follow a change of what they are computed from. */
#ifndef ER_OUTPUT_TANGENT_H
#define ER_OUTPUT_TANGENT_H

#include "model.h"
#include "placement_tangent.h"

/* A change of drives, wrench, state and parameters; entries as in er_held, er_state and er_parameters. */
typedef struct er_change {
    er_held held;
    double x[ER_MAX_ANGLES], v[ER_MAX_ANGLES];
    er_parameters parameters;
} er_change;

/* Change of x that keeps the model's state an equilibrium along a change of drives, wrench and parameters;
 * each coordinate stays on its branch.  False if there is none. */
bool er_equilibrium_along(const er_model *model, const er_change *acting, double *x);

/* Derivatives of the model's outputs along a change; arrays as those of er_model_tcp and so on. */
void er_tcp_along(er_model *model, const er_change *change, double pose[7]);
void er_rigid_along(er_model *model, const er_change *change, double pose[7]);
void er_velocity_along(const er_model *model, const er_change *change, double velocity[3]);
void er_deviation_along(const er_model *model, const er_change *change, double deviation[6]);
bool er_compliance_along(const er_model *model, const er_change *change, double compliance[6]);

/* Changes of the contact's force [N] and of the way to its plane [m]; none without a contact. */
void er_contact_of_model_along(const er_model *model, const er_change *change, double force[3], double *gap);

#endif
