/* Contact of a sphere at the TCP with a plane that only pushes: it lifts off.
 *
 * The plane goes through the anchor and moves with it; n points out of it, to the robot's side.  With the penetration
 * d = R - n . (p - a) of the sphere of radius R and its rate d' there act, at the sphere's lowest point, where d > 0
 *
 *     N = k d max(0, 1 + c d') along n,    -mu N s / sqrt(s . s + v^2) across,
 *
 * s the velocity across n of that point relative to the plane: Hunt's and Crossley's law with an exponent of 1
 * (docs/references.md, Hunt1975), and Coulomb's regularised by the slip speed v.  Both are continuous where the
 * contact begins and ends.  Base axes; elastic_robot/plane_contact.py is the same in Python. */
#ifndef ER_CONTACT_H
#define ER_CONTACT_H

#include "../chain/chain.h"

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

#endif
