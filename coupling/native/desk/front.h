/* Normal equations along a quintic spline, eliminated node by node as they come.
 *
 * The unknowns of a node are the changes of one coefficient of every quantity; those that meet in an interval are
 * the front, six nodes.  A node to which nothing more is added is eliminated, and its factors are kept for the way
 * back in a store of so many nodes; a full store is gone back over from where the front stands, as if nothing changed
 * beyond, and emptied but for its last nodes, which that has disturbed: what is so far behind does not feel it.
 */
#ifndef ER_FRONT_H
#define ER_FRONT_H

#include <stdint.h>

#include "link_kernel.h"

#define ER_ALIGNMENT (sizeof(double) * ER_LANES)

/* The first aligned place in a memory that is larger by ER_ALIGNMENT than what is needed. */
static inline void *er_aligned(void *memory)
{
    return (char *)memory + (ER_ALIGNMENT - (uintptr_t)memory % ER_ALIGNMENT) % ER_ALIGNMENT;
}

#define ER_REACH 6 /* coefficients that meet in an interval */

typedef struct {
    const er_link_kernel *kernel;
    int quantities, size;                      /* of a node; padded to a multiple of ER_LANES */
    double *block[ER_REACH][ER_REACH];         /* of nodes by their numbers modulo ER_REACH: size x size */
    double *right[ER_REACH];
    int64_t room, lag;                         /* nodes of the store, and those that stay when it is emptied */
    int64_t first, next;                       /* that are in it: first to next - 1 */
    int64_t row;                               /* numbers of a node in the store */
    double *store, *solution;
    void *memory;
} er_front;

/* Makes a front; false if it does not fit into memory. */
bool er_front_create(er_front *front, const er_link_kernel *kernel, int quantities, int64_t lag);
void er_front_free(er_front *front);

/* Goes to node 0, of which nothing is known. */
void er_front_start(er_front *front);

/* The block of two nodes of the front, i at or before k. */
static inline double *er_front_block(const er_front *front, int64_t i, int64_t k)
{
    return front->block[i % ER_REACH][k % ER_REACH];
}

static inline double *er_front_right(const er_front *front, int64_t node)
{
    return front->right[node % ER_REACH];
}

/* Eliminates the next node, which meets `reach` others behind it; false if the matrix is not positive definite. */
bool er_front_eliminate(er_front *front, int reach);

static inline bool er_front_is_full(const er_front *front)
{
    return front->next - front->first == front->room;
}

/* Solves for the nodes in the store, with no change behind them: rows of `solution` from front->first on. */
void er_front_go_back(er_front *front);

/* Empties the store but for the last nodes, `lag` of them. */
void er_front_keep_last(er_front *front);

/* The change of the quantities of a node that was gone back over. */
static inline const double *er_front_change(const er_front *front, int64_t node)
{
    return front->solution + (node - front->first) * front->size;
}

#endif
