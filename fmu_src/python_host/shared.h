/* The slave's real values in memory that both know: what needs no Python is done here.
 *
 * A state is kept for each value.  In doubt a call goes to the slave, which says what is wrong with it.
 */
#ifndef ER_SHARED_H
#define ER_SHARED_H

#include <stdbool.h>

#include "inner.h"

/* States, as elastic_robot/shared_values.py has them. */
enum { ER_ASK = 0, ER_SETTABLE = 1, ER_READABLE = 2, ER_WAS_READ = 3 };

/* The value reference that the slave answers with the place of its values, the first time. */
#define ER_SHARED_REFERENCE 0xffffffffu

typedef struct {
    double *values;
    unsigned char *states;
    size_t count;
} er_shared;

/* Asks a new slave for its values; leaves none if it does not tell. */
void er_shared_attach(er_shared *shared, const er_inner *functions, fmi2Component instance);

/* Sets, or reads, all values of a list; false, with nothing done, if one of them calls for the slave. */
bool er_shared_set(const er_shared *shared, const fmi2ValueReference references[], size_t count,
                   const fmi2Real values[]);
bool er_shared_get(const er_shared *shared, const fmi2ValueReference references[], size_t count,
                   fmi2Real values[]);

#endif
