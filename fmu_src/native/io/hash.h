/* FNV-1a, 64 bits: tells data apart that differ by accident. */
#ifndef ER_HASH_H
#define ER_HASH_H

#include <stddef.h>
#include <stdint.h>

#define ER_HASH_START UINT64_C(14695981039346656037)

/* Hash of some bytes behind those that `start` is the hash of. */
static inline uint64_t er_hash(const void *data, size_t size, uint64_t start)
{
    const unsigned char *bytes = data;
    for (size_t k = 0; k < size; k++)
        start = (start ^ bytes[k]) * UINT64_C(1099511628211);
    return start;
}

#endif
