/* Where a zip archive's members are, and whether they are as the archive says. */
#include "table_file.h"

#include <stdlib.h>
#include <string.h>

/* Sizes of the zip records' fixed parts. */
enum { LOCAL_HEADER = 30, CENTRAL_HEADER = 46, END_RECORD = 22, MOST_COMMENT = 65535 };
enum { STORED = 0, DEFLATED = 8, ENCRYPTED = 1 };
/* A size that stands in the zip64 extra field instead. */
#define IN_EXTRA UINT64_C(0xffffffff)
#define ZIP64_FIELD 1
/* Deflate's longest copy, 258 bytes, takes at least 2 bits. */
#define MOST_RATIO 1032

typedef struct {
    const unsigned char *bytes;
    size_t size;
} slice;

/* Where a member lies, and what its content shall be. */
typedef struct {
    uint64_t flags, method, checksum, packed, full, offset;
} entry;

/* CRC-32, sixteen bytes at a time: table k tells what a byte does k bytes further on. */
static uint32_t checksum_of(const unsigned char *bytes, size_t size)
{
    enum { SPAN = 16 };
    uint32_t table[SPAN][256], value = UINT32_C(0xffffffff);
    for (uint32_t k = 0; k < 256; k++) {
        table[0][k] = k;
        for (int bit = 0; bit < 8; bit++)
            table[0][k] = table[0][k] >> 1 ^ (table[0][k] & 1 ? UINT32_C(0xedb88320) : 0);
    }
    for (int s = 1; s < SPAN; s++)
        for (int k = 0; k < 256; k++)
            table[s][k] = table[s - 1][k] >> 8 ^ table[0][table[s - 1][k] & 255];
    for (; size >= SPAN; size -= SPAN, bytes += SPAN) {
        uint32_t next = 0;
        for (int k = 0; k < 4; k++)
            next ^= table[SPAN - 1 - k][bytes[k] ^ (value >> 8 * k & 255)];
        for (int k = 4; k < SPAN; k++)
            next ^= table[SPAN - 1 - k][bytes[k]];
        value = next;
    }
    for (; size > 0; size--)
        value = value >> 8 ^ table[0][(value ^ *bytes++) & 255];
    return ~value;
}

/* The record at the archive's end; its comment reaches to the last byte. */
static const unsigned char *find_end_record(slice zip)
{
    size_t last, furthest;
    if (zip.size < END_RECORD)
        return NULL;
    last = zip.size - END_RECORD;
    furthest = last > MOST_COMMENT ? last - MOST_COMMENT : 0;
    for (size_t at = last + 1; at-- > furthest;)
        if (memcmp(zip.bytes + at, "PK\5\6", 4) == 0 && er_little(zip.bytes + at + 20, 2) == last - at)
            return zip.bytes + at;
    return NULL;
}

/* Sizes and offset that do not fit into the central header stand, in this order, in an extra field. */
static void widen(const unsigned char *extra, size_t length, entry *found)
{
    uint64_t *values[3] = {&found->full, &found->packed, &found->offset};
    while (length >= 4) {
        size_t field = (size_t)er_little(extra + 2, 2), at = 4;
        if (field + 4 > length)
            return;
        if (er_little(extra, 2) == ZIP64_FIELD)
            for (int k = 0; k < 3; k++)
                if (*values[k] == IN_EXTRA && at + 8 <= field + 4) {
                    *values[k] = er_little(extra + at, 8);
                    at += 8;
                }
        extra += field + 4;
        length -= field + 4;
    }
}

static bool find_entry(slice zip, const char *name, entry *found, er_failure *failure)
{
    const unsigned char *end = find_end_record(zip);
    size_t at, length = strlen(name);
    if (end == NULL)
        return er_fail(failure, "it is no zip archive, or cut short");
    at = (size_t)er_little(end + 16, 4);
    for (size_t entries = (size_t)er_little(end + 10, 2); entries > 0; entries--) {
        const unsigned char *central = zip.bytes + at;
        size_t name_size, extra, rest;
        if (at > zip.size || zip.size - at < CENTRAL_HEADER || memcmp(central, "PK\1\2", 4) != 0)
            return er_fail(failure, "the archive's directory is broken");
        name_size = (size_t)er_little(central + 28, 2);
        extra = (size_t)er_little(central + 30, 2);
        rest = zip.size - at - CENTRAL_HEADER;
        if (name_size + extra > rest)
            return er_fail(failure, "the archive's directory is broken");
        if (name_size == length && memcmp(central + CENTRAL_HEADER, name, length) == 0) {
            *found = (entry){er_little(central + 8, 2), er_little(central + 10, 2),
                             er_little(central + 16, 4), er_little(central + 20, 4),
                             er_little(central + 24, 4), er_little(central + 42, 4)};
            widen(central + CENTRAL_HEADER + name_size, extra, found);
            return true;
        }
        at += CENTRAL_HEADER + name_size + extra + (size_t)er_little(central + 32, 2);
    }
    return er_fail(failure, "the archive has no array '%.*s'", (int)(length - strlen(".npy")), name);
}

/* Where the member's bytes begin, or NULL. */
static const unsigned char *packed_bytes(slice zip, const entry *e)
{
    const unsigned char *local = zip.bytes + e->offset;
    uint64_t start;
    if (e->offset > zip.size || zip.size - e->offset < LOCAL_HEADER ||
        memcmp(local, "PK\3\4", 4) != 0 || (e->flags & ENCRYPTED) != 0)
        return NULL;
    start = e->offset + LOCAL_HEADER + er_little(local + 26, 2) + er_little(local + 28, 2);
    if (start > zip.size || e->packed > zip.size - start)
        return NULL;
    if (e->method == STORED ? e->full != e->packed
                            : e->method != DEFLATED || e->full > MOST_RATIO * e->packed)
        return NULL;
    return zip.bytes + start;
}

const unsigned char *er_zip_member(const unsigned char *archive, size_t size, const char *name,
                                   size_t *content_size, unsigned char **unpacked,
                                   er_failure *failure)
{
    slice zip = {archive, size};
    entry e = {0};
    const unsigned char *content;
    *unpacked = NULL;
    if (!find_entry(zip, name, &e, failure))
        return NULL;
    content = packed_bytes(zip, &e);
    if (content == NULL) {
        er_fail(failure, "the archive's member %s is broken", name);
        return NULL;
    }
    if (e.method == DEFLATED) {
        *unpacked = malloc((size_t)e.full + 1);
        if (*unpacked == NULL) {
            er_fail(failure, "the archive's member %s does not fit into memory", name);
            return NULL;
        }
        if (!er_inflate(content, (size_t)e.packed, *unpacked, (size_t)e.full)) {
            er_fail(failure, "the archive's member %s is broken", name);
            return NULL;
        }
        content = *unpacked;
    }
    if (checksum_of(content, (size_t)e.full) != e.checksum) {
        er_fail(failure, "the archive's member %s is damaged: its checksum is another", name);
        return NULL;
    }
    *content_size = (size_t)e.full;
    return content;
}
