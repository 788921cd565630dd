/* Tables of numbers with named columns: CSV with a header line, or NumPy's NPZ. */
#ifndef ER_TABLE_FILE_H
#define ER_TABLE_FILE_H

#include <stddef.h>
#include <stdint.h>

#include "file.h"

#define ER_MAX_TABLE_COLUMNS 256
#define ER_MAX_NAME 32

typedef struct {
    size_t rows;
    int columns;
    char name[ER_MAX_TABLE_COLUMNS][ER_MAX_NAME];
    double *data; /* by rows */
} er_data_table;

/* Reads a file; the failure says what was expected and got, but not in which file.  What is read and what is
 * refused is one list, docs/fmu.md#trajectories, and the same in elastic_robot/table_file.py. */
bool er_table_read(er_data_table *table, const char *path, er_failure *failure);

/* The same of a file's content, with a zero byte behind it.  `is_npz`: its name ends in .npz. */
bool er_table_parse(er_data_table *table, const char *content, size_t size, bool is_npz, er_failure *failure);

void er_table_free(er_data_table *table);

/* Number of the column with a name, and how many of them there are. */
int er_table_column(const er_data_table *table, const char *name, int *count);

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
