/* A whole file in memory. */
#ifndef ER_TEXT_FILE_H
#define ER_TEXT_FILE_H

#include <stddef.h>
#include <stdio.h>

/* fopen for a path in UTF-8, on Windows too. */
FILE *er_open(const char *path);

/* Returns the content with a zero byte behind it, to be freed; NULL with errno set if there is none. */
char *er_read_file(const char *path, size_t *size);

#endif
