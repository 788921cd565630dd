/* Arrays from NumPy's NPZ, a zip archive of .npy files, stored as numpy.savez stores them.
 *
 * The header of an array is a text: {'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }.
 */
#ifndef ER_NPZ_H
#define ER_NPZ_H

#include "data_table.h"

/* Reads the arrays `columns` (text) and `data` (numbers, two axes) of an archive in memory from malloc, in which the
 * table's data may be kept. */
bool er_npz_parse(er_data_table *table, unsigned char *archive, size_t size, er_failure *failure);

#endif
