/* Numbers from text, whatever the host's locale is. */
#ifndef ER_NUMBER_H
#define ER_NUMBER_H

#include <stdbool.h>

/* Reads a decimal number (no hexadecimal one, no nan, no inf) at *cursor and moves it behind.
 * Correctly rounded.  Returns false, with *cursor as it was, where there is none. */
bool er_read_number(const char **cursor, double *value);

#endif
