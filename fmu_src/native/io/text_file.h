/* A whole file in memory. */
#ifndef ER_TEXT_FILE_H
#define ER_TEXT_FILE_H

#include <stddef.h>
#include <stdint.h>

#include "failure.h"

/* A larger file is refused [bytes]. */
#define ER_MOST_BYTES (UINT64_C(1) << 30)

/* Whether there is something of a name in UTF-8, a file or else. */
bool er_exists(const char *path);

/* Returns the content of a file, its name in UTF-8, with a zero byte behind it, to be freed; NULL with the
 * reason if there is none. */
char *er_read_file(const char *path, size_t *size, er_failure *failure);

#endif
