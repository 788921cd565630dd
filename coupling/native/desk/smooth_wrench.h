/* A wrench without what is faster than nodes can follow (docs/inverse.md, 1): its mean over each cell of a grid, on
 * which means over ER_CELLS cells are taken, twice and four times.
 */
#ifndef ER_SMOOTH_WRENCH_H
#define ER_SMOOTH_WRENCH_H

#include <stdint.h>

#include "export.h"

#define ER_AXES 6   /* of a wrench */
#define ER_CELLS 16 /* of a mean's width */

/* A wrench straight between instants, at which it may jump; beyond its ends the outermost values hold. */
typedef struct {
    int64_t count;                /* of the instants, at least two */
    double cell;                  /* width of a cell [s]; the first one begins at the first instant */
    const double *instants;       /* rising [s], (count) */
    const double *before, *behind; /* just before and just behind each [N, N m], (count, 6) */
} er_wrench_history;

/* Smoothed wrenches at times [s], (count, 6), straight between the middles of cells; at times that fall or jump far it
 * starts anew. */
ER_EXPORT void er_smooth_wrench(const er_wrench_history *history, int64_t count, const double *times, double *wrench);

#endif
