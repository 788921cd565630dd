/* Where a step leaves the region in which a coordinate obeys one smooth law, or a contact begins or ends. */
#ifndef ER_CROSSINGS_H
#define ER_CROSSINGS_H

#include "run.h"

/* The first crossing of a coordinate in a solved step, if any. */
bool er_first_crossing(const er_run *r, const er_state *state, const er_step *step, er_crossing *first);

/* The earlier of a crossing, if one was `found`, and that of a contact's depth at the start, the nodes and
 * the end of a step. */
bool er_earlier_contact(bool touching, const double depth[ER_CONTROL], bool has_first, er_crossing *first);

#endif
