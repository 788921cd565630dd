/* Arrays from NumPy's NPZ: a zip archive of .npy files, stored or deflated. */
#ifndef ER_NPZ_H
#define ER_NPZ_H

#include "table_file.h"

/* Reads the arrays `columns` (text) and `data` (numbers, two axes) of an archive in memory. */
bool er_npz_parse(er_data_table *table, const unsigned char *archive, size_t size,
                  er_failure *failure);

#endif
