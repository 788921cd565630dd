/* A table of numbers with named columns in memory. */
#ifndef ER_DATA_TABLE_H
#define ER_DATA_TABLE_H

#include "file.h"

#define ER_MAX_TABLE_COLUMNS 256
#define ER_MAX_NAME 32

typedef struct {
    size_t rows;
    int columns;
    char name[ER_MAX_TABLE_COLUMNS][ER_MAX_NAME];
    double *data; /* by rows */
} er_data_table;

static inline bool er_is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

/* What a message may show of a file that may be anything. */
static inline char er_printable(char c)
{
    return c >= ' ' && c <= '~' ? c : '?';
}

#endif
