/* Forces of the teeth of a mill on its actual way, each on what all passes before it have left. */
#ifndef ER_CUT_H
#define ER_CUT_H

#include <stdint.h>

#include "export.h"

/* Passes before that a tooth may cut the surface of, at most. */
#define ER_MOST_PASSES 64

typedef struct {
    int64_t teeth, passes;
    double radius;              /* [m] */
    double lag;                 /* of an edge with the height above the tip [rad/m] */
    double speed;               /* of the spindle [rad/s] */
    double rubs;                /* height above the surface up to which an edge rubs [m] */
    const double *tip;          /* angles of the tips at time 0 [rad], (teeth) */
    const double *delay;        /* since the passes before [s], (teeth, passes) */
    const double *further;      /* how far a tooth reaches beyond those, and beyond them a quarter of a turn
                                 * further up its edge [m], (teeth, passes, 2) */
    const double *coefficients; /* K_tc, K_rc, K_ac [Pa], K_te, K_re, K_ae [N/m], (6) */
} er_mill;

typedef struct {
    int64_t count, arcs;
    const double *time;   /* rising [s], (count) */
    const double *feed;   /* unit vectors along the feed in the part's plane, (count, 2) */
    const double *start;  /* of engaged arcs, angles within 0 and pi [rad], (count, arcs) */
    const double *end;    /* their ends, (count, arcs) */
    const double *depth;  /* their axial depths [m], (count, arcs) */
    const double *share;  /* part of the edge force that acts [1], (count) */
} er_engagement;

/* Forces [N] and moments about the tip's centre [N m] in the axes of the cut, (count, 6).  `way`: positions in the
 * part's plane [m], (rows, 2), at rising times [s], straight in between and held beyond the ends. */
ER_EXPORT void er_mill_wrench(const er_mill *mill, const er_engagement *cut, int64_t rows, const double *way_time,
                              const double *way, double *wrench);

#endif
