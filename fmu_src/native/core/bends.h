/* Where the torque curve of a coordinate is not smooth: the edges of its play, the knots of a spline. */
#ifndef ER_BENDS_H
#define ER_BENDS_H

#include "curves.h"

/* Angles at which the slope or the curvature of a law jumps, rising [rad]; between two of them lies a
 * piece, number p between angle p - 1 and angle p. */
typedef struct {
    int count;
    double angle[ER_MAX_KNOTS];
} er_bends;

void er_bends_find(const er_curve *curve, int k, er_bends *bends);

/* The piece that x lies on, if it lay on `piece` before: a bend is passed `slack` [rad] behind it only, so
 * that rounding does not undo it. */
int er_bends_piece(const er_bends *bends, int piece, double x, double slack);

/* How far x is from where it would leave a piece downwards and upwards [rad]; 1 where it cannot. */
void er_bends_distance(const er_bends *bends, int piece, double x, double slack, double distance[2]);

#endif
