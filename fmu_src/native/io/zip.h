/* Members of a zip archive in memory, stored as they are (PKWARE, APPNOTE.TXT). */
#ifndef ER_ZIP_H
#define ER_ZIP_H

#include "file.h"

/* The content of one, which lies in the archive, with its checksum verified; NULL with the reason if it is not there,
 * compressed or broken. */
const unsigned char *er_zip_member(const unsigned char *archive, size_t size, const char *name, size_t *content_size,
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
