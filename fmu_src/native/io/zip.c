#include "zip.h"

#include <string.h>

/* Sizes of the zip records' fixed parts. */
enum { LOCAL_HEADER = 30, CENTRAL_HEADER = 46, END_RECORD = 22, MOST_COMMENT = 65535 };
enum { STORED = 0, ENCRYPTED = 1 };
/* A size that stands in the zip64 extra field instead. */
#define IN_EXTRA UINT64_C(0xffffffff)
#define ZIP64_FIELD 1
typedef struct {
    const unsigned char *bytes;
    size_t size;
} slice;

/* Where a member lies, and what its content shall be. */
typedef struct {
    uint64_t flags, method, checksum, packed, full, offset;
} entry;

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
static void read_zip64_sizes(const unsigned char *extra, size_t length, entry *member)
{
    uint64_t *values[3] = {&member->full, &member->packed, &member->offset};
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

static bool find_entry(slice zip, const char *name, entry *member, er_failure *failure)
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
            *member = (entry){er_little(central + 8, 2), er_little(central + 10, 2),
                             er_little(central + 16, 4), er_little(central + 20, 4),
                             er_little(central + 24, 4), er_little(central + 42, 4)};
            read_zip64_sizes(central + CENTRAL_HEADER + name_size, extra, member);
            return true;
        }
        at += CENTRAL_HEADER + name_size + extra + (size_t)er_little(central + 32, 2);
    }
    return er_fail(failure, "the archive has no array '%.*s'", (int)(length - strlen(".npy")), name);
}

/* Where the member's bytes begin, or NULL. */
static const unsigned char *stored_bytes(slice zip, const entry *e)
{
    const unsigned char *local = zip.bytes + e->offset;
    uint64_t start;
    if (e->offset > zip.size || zip.size - e->offset < LOCAL_HEADER || memcmp(local, "PK\3\4", 4) != 0 ||
        (e->flags & ENCRYPTED) != 0 || e->full != e->packed)
        return NULL;
    start = e->offset + LOCAL_HEADER + er_little(local + 26, 2) + er_little(local + 28, 2);
    return start > zip.size || e->packed > zip.size - start ? NULL : zip.bytes + start;
}

const unsigned char *er_zip_member(const unsigned char *archive, size_t size, const char *name, size_t *content_size,
                                   er_failure *failure)
{
    slice zip = {archive, size};
    entry e = {0};
    const unsigned char *content;
    if (!find_entry(zip, name, &e, failure))
        return NULL;
    if (e.method != STORED) {
        er_fail(failure, "the archive's member %s is compressed: write it with numpy.savez, not savez_compressed", name);
        return NULL;
    }
    content = stored_bytes(zip, &e);
    if (content == NULL)
        er_fail(failure, "the archive's member %s is broken", name);
    else if (er_checksum(content, (size_t)e.full) != e.checksum)
        er_fail(failure, "the archive's member %s is damaged: its checksum is another", name);
    else {
        *content_size = (size_t)e.full;
        return content;
    }
    return NULL;
}
