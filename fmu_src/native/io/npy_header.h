/* The header of an array in NumPy's format: {'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }. */
#ifndef ER_NPY_HEADER_H
#define ER_NPY_HEADER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    char kind;     /* of an entry: 'f', 'i', 'u', 'U' .. */
    unsigned size; /* the number behind it: bytes, or letters of a 'U' */
    bool big;      /* the most significant byte comes first */
    bool column_major;
    int axes; /* 0 to 2 */
    uint64_t shape[2];
} er_npy_header;

/* Reads a header as NumPy writes it, its keys in any order; elastic_robot/npz.py reads the same. */
bool er_npy_header_parse(er_npy_header *header, const char *text, size_t length);

#endif
