/* What acts on the tool over a step: a wrench that may change, a contact spring, a contact that lifts off. */
#ifndef ER_LOAD_H
#define ER_LOAD_H

#include "anchor.h"
#include "contact.h"

/* What acts together. */
typedef struct {
    double wrench[6]; /* on the robot at the TCP at the beginning, base axes [N, N m] */
    double rate[6];   /* of the wrench [N/s, N m/s] */
    er_anchor anchor;
    er_contact contact;
} er_load;

/* Wrench and anchor as they are after a time [s]. */
void er_load_advance(er_load *load, double elapsed);

/* Whether the wrench changes. */
bool er_load_changes(const er_load *load);

/* Whether a spring or a contact answers to where the TCP is. */
bool er_load_yields(const er_load *load);

/* The wrench of a load at rest, what spring and contact exert at the beginning among it. */
void er_load_wrench(const er_load *load, const double tcp[3], double wrench[6]);

/* Stiffness of spring and contact at rest [N/m]. */
void er_load_support(const er_load *load, const double tcp[3], double stiffness[ER_SYMMETRIC]);

/* Adds what that is to the elastic coordinates, J_p^T K J_p [N m/rad], to a matrix of them. */
void er_load_support_chain(const er_load *load, const er_robot *robot, const er_placement *placement, double *matrix);

/* Derivatives of the force of both at rest [N] and of their stiffness [N/m] along changes of load and TCP. */
void er_load_force_along(const er_load *load, const double tcp[3], const er_load *change,
                         const double tcp_change[3], double force[3]);
void er_load_support_along(const er_load *load, const double tcp[3], const er_load *change,
                           double stiffness[ER_SYMMETRIC]);

#endif
