/* Tables of numbers with named columns: CSV with a header line, or NumPy's NPZ. */
#ifndef ER_TABLE_FILE_H
#define ER_TABLE_FILE_H

#include "data_table.h"

/* Reads a file; the failure says what was expected and got, but not in which file.  What is read and what is
 * refused is one list, docs/fmu.md#trajectories. */
bool er_table_read(er_data_table *table, const char *path, er_failure *failure);

void er_table_free(er_data_table *table);

/* Number of the column with a name, and how many of them there are. */
int er_table_column(const er_data_table *table, const char *name, int *count);

#endif
