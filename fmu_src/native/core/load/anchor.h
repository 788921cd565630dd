/* A contact spring: it pulls at the TCP p with K (a - p) towards its anchor a, which moves evenly over a step.
 *
 * It exerts no moment.  Base axes. */
#ifndef ER_ANCHOR_H
#define ER_ANCHOR_H

#include "../chain/chain.h"

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

#endif
