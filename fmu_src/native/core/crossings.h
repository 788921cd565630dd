/* Where a step's polynomial first leaves the region in which a coordinate obeys one smooth law. */
#ifndef ER_CROSSINGS_H
#define ER_CROSSINGS_H

#include "gear.h"
#include "gauss.h"

typedef struct {
    int coordinate;  /* or ER_DEPTH */
    double boundary; /* value that it passes [rad], or [m] */
    int outward;     /* 1: rises through the boundary, -1: falls */
    int region;      /* the region beyond */
    double fraction; /* place in the step, in (0, 1] */
} er_crossing;

/* In er_crossing: no coordinate, the depth of a contact. */
enum { ER_DEPTH = -1 };

/* A contact begins this far behind the plane [m], so that rounding does not undo it, and ends at it: what
 * presses never pulls. */
#define ER_CONTACT_SLACK 1e-11

/* The earlier of a crossing, if one was `found`, and that of a contact's depth at the start, the nodes and
 * the end of a step. */
bool er_earlier_contact(bool touching, const double depth[ER_CONTROL], bool found, er_crossing *first);

/* The first crossing of a step of length h from x, v with the given stage accelerations, if any. */
bool er_first_crossing(const er_gears *gears, const er_settings *settings, const int *region,
                       double tolerance, double h, const double *x, const double *v,
                       const er_lanes *acceleration, er_crossing *first);

#endif
