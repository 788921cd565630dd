/* How placements and the equilibrium follow a change; the compliance there, and how it does. */
#ifndef ER_TANGENT_H
#define ER_TANGENT_H

#include "memory.h"

/* How a placement moves along a change of its angles; base axes. */
typedef struct {
    double tool_position[3];         /* of the TCP */
    double turn[3];                  /* small rotation of the tool [rad] */
    double axis[ER_MAX_ANGLES][3];   /* of z_i */
    double lever[ER_MAX_ANGLES][3];  /* of z_i x (TCP - o_i) */
    double weight[ER_MAX_ANGLES][3]; /* of z_i x first moment about o_i of the bodies beyond */
} er_placement_tangent;

/* Placements of the elastic or the rigid robot and how they move. */
typedef struct {
    er_placement at;
    er_placement_tangent along;
} er_placement_change;

/* At the present state along a change; with bodies where `bodies` asks for them. */
void er_placement_change_at(const er_model *model, const er_change *change, bool rigid, bool bodies, er_placement_change *out);

/* Change of x that keeps the model's state an equilibrium along a change of drives, wrench and parameters;
 * each coordinate stays on its branch.  False if there is none. */
bool er_equilibrium_along(const er_model *model, const er_change *acting, double *x);

/* Static compliance of the TCP at the present state, on its spring and contact: xx, xy, xz, yy, yz, zz [m/N].
 *
 * A gear inside its backlash counts with the stiffness of its flank, elements of hysteresis while they stick. */
bool er_model_compliance(const er_model *model, double compliance[6], er_failure *failure);
bool er_compliance_along(const er_model *model, const er_change *change, double compliance[6]);

#endif
