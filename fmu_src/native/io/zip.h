/* Members of a zip archive in memory, stored or deflated (PKWARE, APPNOTE.TXT). */
#ifndef ER_ZIP_H
#define ER_ZIP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "failure.h"

/* Decompresses deflate's format (RFC 1951): fills `out`, whose size must be that of the decompressed data;
 * false if the data are broken or do not end where `in` does. */
bool er_inflate(const unsigned char *in, size_t in_size, unsigned char *out, size_t out_size);

/* The content of a member, with its checksum verified; NULL with the reason if it is not there or broken.
 * It lies in the archive, or in `unpacked`, which is to be freed in any case.  Nothing is allocated that
 * the archive's own size does not bear out. */
const unsigned char *er_zip_member(const unsigned char *archive, size_t size, const char *name,
                                   size_t *content_size, unsigned char **unpacked,
                                   er_failure *failure);

/* An unsigned number of some bytes, the least significant first. */
static inline uint64_t er_little(const unsigned char *at, int bytes)
{
    uint64_t value = 0;
    while (bytes-- > 0)
        value = value << 8 | at[bytes];
    return value;
}

#endif
