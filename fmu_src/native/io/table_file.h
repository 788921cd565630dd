/* Tables of numbers with named columns: CSV with a header line, or NumPy's NPZ. */
#ifndef ER_TABLE_FILE_H
#define ER_TABLE_FILE_H

#include <stddef.h>

#include "failure.h"

#define ER_MAX_TABLE_COLUMNS 256
#define ER_MAX_NAME 32

typedef struct {
    size_t rows;
    int columns;
    char name[ER_MAX_TABLE_COLUMNS][ER_MAX_NAME];
    double *data; /* by rows */
} er_data_table;

/* Reads a file; the failure says what was expected and got, but not in which file. */
bool er_table_read(er_data_table *table, const char *path, er_failure *failure);

void er_table_free(er_data_table *table);

/* Number of the column with a name, or -1. */
int er_table_column(const er_data_table *table, const char *name);

#endif
