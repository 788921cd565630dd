/* Errors: one sentence that says where, what was expected and what was got.
 *
 * A function that can fail returns false and leaves the sentence in the er_failure it was given.
 */
#ifndef ER_FAILURE_H
#define ER_FAILURE_H

#include <stdbool.h>

#define ER_FAILURE_TEXT 1600

typedef struct {
    bool may_retry; /* another value, step or state may do */
    char text[ER_FAILURE_TEXT];
} er_failure;

/* Writes the sentence (as printf does, cut to the buffer) and returns false. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
bool er_fail(er_failure *failure, const char *format, ...);

/* Marks a failure that leaves all as it was as one that another value, step or state may avoid; false. */
static inline bool er_let_retry(er_failure *failure)
{
    failure->may_retry = true;
    return false;
}

#define ER_ESCAPED_TEXT (2 * ER_FAILURE_TEXT)

/* The text with some characters doubled, cut to the buffer. */
void er_escape(const char *text, const char *doubled, char escaped[ER_ESCAPED_TEXT]);

#define ER_NUMBER_TEXT 32

/* A number as Python shows it: 1.0, -1e-09, nan. */
const char *er_shown(double value, char text[ER_NUMBER_TEXT]);

#endif
