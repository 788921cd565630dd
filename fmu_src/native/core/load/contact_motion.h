/* The sphere of a contact in motion. */
#ifndef ER_CONTACT_MOTION_H
#define ER_CONTACT_MOTION_H

#include "load.h"

/* How it stands to the plane, what it feels, and how that follows the motion of the chain. */
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
void er_contact_motion_at(const er_robot *robot, const er_load *load, double elapsed, const double *theta,
                     const double *rate, er_contact_motion *motion);

/* The wrench where the sphere is in the plane; none where it is not. */
void er_contact_wrench(const er_contact_motion *motion, double wrench[6]);

/* How the sphere's place changes along a change of angles, rates and load, its anchor where it is then. */
void er_contact_place_along(const er_robot *robot, const er_load *load, const er_contact_motion *motion,
                            const double *theta, const double *rate, const er_load *change, er_touch *along);

/* Derivative of the wrench along such a change. */
void er_contact_wrench_along(const er_robot *robot, const er_load *load, const er_contact_motion *motion,
                             const double *theta, const double *rate, const er_load *change, double wrench[6]);

#endif
