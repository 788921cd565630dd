/* What acts on the tool over a step: a wrench that may change, a contact spring, a contact that lifts off.
 *
 * The spring at the TCP pulls with K (a - p) at p, the TCP, towards its anchor a, which moves
 * evenly over a step.  It exerts no moment.  Base axes.
 */
#ifndef ER_LOAD_H
#define ER_LOAD_H

#include "chain.h"

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

/* Contact of a sphere at the TCP with a plane that only pushes: it lifts off.
 *
 * The plane goes through the anchor and moves with it; n points out of it, to the robot's side.  With the
 * penetration d = R - n . (p - a) of the sphere of radius R and its rate d' there act, at the sphere's
 * lowest point, where d > 0
 *
 *     N = k d max(0, 1 + c d') along n,    -mu N s / sqrt(s . s + v^2) across,
 *
 * s the velocity across n of that point relative to the plane: Hunt's and Crossley's law with an exponent
 * of 1 (docs/references.md, Hunt1975), and Coulomb's regularised by the slip speed v.  Both are continuous
 * where the contact begins and ends.  Base axes; elastic_robot/plane_contact.py is the same in Python.
 */

typedef struct {
    double stiffness;   /* k [N/m]; 0: there is no contact */
    double dissipation; /* c [s/m] */
    double radius;      /* R [m] */
    double friction;    /* mu */
    double slip_speed;  /* v [m/s] */
    double normal[3];   /* n, of any length */
} er_contact;

/* How the sphere stands to the plane. */
typedef struct {
    double normal[3];   /* n, of length 1 */
    double depth;       /* d [m]; below 0: the way to the plane */
    double velocity[3]; /* of its lowest point, relative to the plane [m/s] */
} er_touch;

/* Without a contact, as a simulation starts. */
er_contact er_contact_none(void);

static inline bool er_contact_holds(const er_contact *contact)
{
    return contact->stiffness != 0.0;
}

/* Refuses a normal without a direction. */
bool er_contact_require(const er_contact *contact, er_failure *failure);

/* How a sphere stands that is at rest relative to the plane; `gap` leads from the TCP to the anchor [m]. */
er_touch er_contact_touch(const er_contact *contact, const double gap[3]);

/* d' [m/s] */
double er_contact_approach(const er_touch *touch);

/* Force on the sphere [N].  It is that of a penetration, continued to a little below 0. */
void er_contact_force(const er_contact *contact, const er_touch *touch, double force[3]);

/* Its derivative along changes of contact and touch [N]; that of the normal counts in `along`. */
void er_contact_along(const er_contact *contact, const er_touch *touch, const er_contact *change,
                      const er_touch *along, double force[3]);

/* The change of a touch along that of the contact and of the gap; velocities are those given already. */
void er_contact_touch_along(const er_contact *contact, const er_touch *touch, const double gap[3],
                            const er_contact *change, const double gap_change[3], er_touch *along);

/* -dF/dp [N/m] and -dF/dp' [N s/m], their symmetric parts without what the friction has of N. */
void er_contact_matrices(const er_contact *contact, const er_touch *touch,
                         double stiffness[ER_SYMMETRIC], double damping[ER_SYMMETRIC]);

/* What acts together. */
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

/* Adds what that is to the elastic coordinates, J_p^T K J_p [N m/rad], to a matrix of them. */
void er_load_support_chain(const er_load *load, const er_robot *robot, const er_placement *placement, double *matrix);

/* Derivatives of the force of both at rest [N] and of their stiffness [N/m] along changes of load and TCP. */
void er_load_force_along(const er_load *load, const double tcp[3], const er_load *change,
                         const double tcp_change[3], double force[3]);
void er_load_support_along(const er_load *load, const double tcp[3], const er_load *change,
                           double stiffness[ER_SYMMETRIC]);

/* The sphere in motion: how it stands to the plane, what it feels, and how that follows the motion of the chain. */
typedef struct {
    er_touch touch;
    double gap[3];                       /* from the TCP to the anchor [m] */
    double offset[3];                    /* from the TCP to the sphere's lowest point [m] */
    double turning[3];                   /* of the tool [rad/s] */
    double wrench[6];                    /* of the contact at the TCP [N, N m], whether it presses or not */
    double lever[ER_MAX_ANGLES][3];      /* velocity of the lowest point per theta_i' [m] */
    double lever_rate[ER_MAX_ANGLES][3]; /* derivative of that velocity by theta_i [m/s] */
} er_contact_motion;

/* Fills it in for angles of the chain and their rates, a time after the load's beginning [s]. */
void er_contact_move(const er_robot *robot, const er_load *load, double elapsed, const double *theta,
                     const double *rate, er_contact_motion *motion);

/* The wrench where the sphere is in the plane; none where it is not. */
void er_contact_wrench(const er_contact_motion *motion, double wrench[6]);

/* How the sphere's place changes along a change of angles, rates and load, its anchor where it is then. */
void er_contact_place_along(const er_robot *robot, const er_load *load, const er_contact_motion *motion,
                            const double *theta, const double *rate, const er_load *change,
                            er_touch *along);

/* Derivative of the wrench along such a change. */
void er_contact_wrench_along(const er_robot *robot, const er_load *load, const er_contact_motion *motion,
                             const double *theta, const double *rate, const er_load *change,
                             double wrench[6]);

#endif
