/* What acts on the tool over a step: a wrench that may change, a contact spring, a contact that lifts off.
 *
 * The spring at the TCP pulls with K (a - p) at p, the TCP, towards its anchor a, which moves
 * evenly over a step.  It exerts no moment.  Base axes.
 */
#ifndef ER_LOAD_H
#define ER_LOAD_H

#include <stdbool.h>

#include "../io/failure.h"
#include "contact.h"

typedef struct {
    double position[3];             /* a at the beginning [m] */
    double velocity[3];             /* of a [m/s] */
    double stiffness[ER_SYMMETRIC]; /* K [N/m] */
} er_anchor;

/* Whether there is a spring: K is not zero. */
bool er_anchor_holds(const er_anchor *anchor);

/* Refuses a K that is not positive semidefinite. */
bool er_anchor_require(const er_anchor *anchor, er_failure *failure);

/* K v */
void er_anchor_times(const double stiffness[ER_SYMMETRIC], const double v[3], double out[3]);

/* From the TCP to the anchor [m] at a time after the beginning [s]. */
void er_anchor_gap(const er_anchor *anchor, double elapsed, const double tcp[3], double gap[3]);

/* Derivative of the pull: dK gap + K (da - dp) along a change of K, a and p [N]. */
void er_anchor_along(const er_anchor *anchor, const double gap[3], const er_anchor *change,
                     const double tcp_change[3], double force[3]);

typedef struct {
    double wrench[6]; /* on the robot at the TCP at the beginning, base axes [N, N m] */
    double rate[6];   /* of the wrench [N/s, N m/s] */
    er_anchor anchor;
    er_contact contact;
} er_load;

/* Wrench and anchor as they are after a time [s]. */
void er_load_move(er_load *load, double elapsed);

/* Whether the wrench changes. */
bool er_load_changes(const er_load *load);

/* Whether a spring or a contact answers to where the TCP is. */
bool er_load_yields(const er_load *load);

/* The wrench of a load at rest, what spring and contact exert at the beginning among it. */
void er_load_wrench(const er_load *load, const double tcp[3], double wrench[6]);

/* Stiffness of spring and contact at rest [N/m]. */
void er_load_support(const er_load *load, const double tcp[3], double stiffness[ER_SYMMETRIC]);

/* Derivatives of the force of both at rest [N] and of their stiffness [N/m] along changes of load and TCP. */
void er_load_force_along(const er_load *load, const double tcp[3], const er_load *change,
                         const double tcp_change[3], double force[3]);
void er_load_support_along(const er_load *load, const double tcp[3], const er_load *change,
                           double stiffness[ER_SYMMETRIC]);

#endif
