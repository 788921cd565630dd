/* Decompression of the deflate format (RFC 1951). */
#ifndef ER_INFLATE_H
#define ER_INFLATE_H

#include <stdbool.h>
#include <stddef.h>

/* Fills `out`, whose size must be that of the decompressed data; false if the data are broken or do not
 * end where `in` does. */
bool er_inflate(const unsigned char *in, size_t in_size, unsigned char *out, size_t out_size);

#endif
