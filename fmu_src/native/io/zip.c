/* Members of a zip archive: where they are, decompressed, and whether they are as the archive says. */
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

/* Deflate's format (RFC 1951): the longest code, the numbers of symbols of both codes, the one at a block's end. */
enum { MOST_BITS = 15,
       LITERALS = 288,
       DISTANCES = 30,
       END_OF_BLOCK = 256 };

typedef struct {
    const unsigned char *in;
    size_t in_size, in_at;
    unsigned char *out;
    size_t out_size, out_at;
    unsigned buffer; /* bits read but not used, lowest first */
    int held;
    bool broken;
} stream;

/* A canonical Huffman code: how many codes have each length, and their symbols in order. */
typedef struct {
    short count[MOST_BITS + 1], symbol[LITERALS];
} code;

static unsigned take_bits(stream *s, int count)
{
    unsigned value;
    while (s->held < count) {
        if (s->in_at == s->in_size) {
            s->broken = true;
            return 0;
        }
        s->buffer |= (unsigned)s->in[s->in_at++] << s->held;
        s->held += 8;
    }
    value = s->buffer & ((1u << count) - 1u);
    s->buffer >>= count;
    s->held -= count;
    return value;
}

typedef enum { COMPLETE,
               SINGLE,
               NO_CODE } build;

/* Of a single bit, or empty, a code may be where it need not be used; otherwise lengths must tell apart
 * just as many symbols as there are. */
static build build_code(code *c, const unsigned char *length, int symbols)
{
    short first[MOST_BITS + 2];
    int left = 1, used = 0;
    memset(c->count, 0, sizeof c->count);
    for (int k = 0; k < symbols; k++)
        c->count[length[k]]++;
    c->count[0] = 0;
    first[1] = 0;
    for (int bits = 1; bits <= MOST_BITS; bits++)
        first[bits + 1] = (short)(first[bits] + c->count[bits]);
    for (int k = 0; k < symbols; k++)
        if (length[k] != 0)
            c->symbol[first[length[k]]++] = (short)k;
    for (int bits = 1; bits <= MOST_BITS; bits++) {
        left = 2 * left - c->count[bits];
        used += c->count[bits];
        if (left < 0)
            return NO_CODE;
    }
    if (left == 0)
        return COMPLETE;
    return used == 0 || (used == 1 && c->count[1] == 1) ? SINGLE : NO_CODE;
}

static int take_symbol(stream *s, const code *c)
{
    int value = 0, first = 0, index = 0;
    for (int bits = 1; bits <= MOST_BITS && !s->broken; bits++) {
        value |= (int)take_bits(s, 1);
        if (value - first < c->count[bits])
            return c->symbol[index + value - first];
        index += c->count[bits];
        first = (first + c->count[bits]) << 1;
        value <<= 1;
    }
    s->broken = true;
    return END_OF_BLOCK;
}

static void put(stream *s, unsigned char byte)
{
    if (s->out_at == s->out_size)
        s->broken = true;
    else
        s->out[s->out_at++] = byte;
}

static void copy_stored(stream *s)
{
    unsigned length, complement;
    s->buffer = 0;
    s->held = 0;
    length = take_bits(s, 16);
    complement = take_bits(s, 16);
    if ((length ^ complement) != 0xffffu)
        s->broken = true;
    while (length-- > 0 && !s->broken)
        put(s, (unsigned char)take_bits(s, 8));
}

static void copy_coded(stream *s, const code *literals, const code *distances)
{
    static const short length_base[29] = {3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27,
                                          31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258};
    static const short length_bits[29] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2,
                                          2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0};
    while (!s->broken) {
        int symbol = take_symbol(s, literals);
        if (symbol < END_OF_BLOCK) {
            put(s, (unsigned char)symbol);
        } else if (symbol == END_OF_BLOCK) {
            return;
        } else if (symbol - 257 >= 29) {
            s->broken = true;
        } else {
            int length = length_base[symbol - 257] + (int)take_bits(s, length_bits[symbol - 257]);
            int d = take_symbol(s, distances), extra = d < 4 ? 0 : d / 2 - 1;
            size_t distance;
            if (d >= DISTANCES) {
                s->broken = true;
                return;
            }
            distance = (d < 4 ? (size_t)d : (size_t)(2 + d % 2) << extra) + 1 + take_bits(s, extra);
            if (distance > s->out_at)
                s->broken = true;
            while (length-- > 0 && !s->broken)
                put(s, s->out[s->out_at - distance]);
        }
    }
}

static void copy_fixed(stream *s)
{
    unsigned char length[LITERALS];
    code literals, distances;
    memset(length, 8, 144);
    memset(length + 144, 9, 112);
    memset(length + 256, 7, 24);
    memset(length + 280, 8, 8);
    build_code(&literals, length, LITERALS);
    memset(length, 5, DISTANCES);
    build_code(&distances, length, DISTANCES);
    copy_coded(s, &literals, &distances);
}

static void copy_dynamic(stream *s)
{
    static const unsigned char order[19] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5,
                                            11, 4, 12, 3, 13, 2, 14, 1, 15};
    unsigned char length[LITERALS + 32] = {0};
    code lengths, literals, distances;
    int literal_count = (int)take_bits(s, 5) + 257, distance_count = (int)take_bits(s, 5) + 1;
    int length_count = (int)take_bits(s, 4) + 4, k = 0;
    if (literal_count > 286 || distance_count > DISTANCES)
        s->broken = true;
    for (int i = 0; i < length_count; i++)
        length[order[i]] = (unsigned char)take_bits(s, 3);
    s->broken |= build_code(&lengths, length, 19) != COMPLETE;
    while (k < literal_count + distance_count && !s->broken) {
        int symbol = take_symbol(s, &lengths), repeat = 1;
        unsigned char value = (unsigned char)symbol;
        if (symbol == 16) {
            repeat = 3 + (int)take_bits(s, 2);
            s->broken |= k == 0;
            value = k > 0 ? length[k - 1] : 0;
        } else if (symbol == 17 || symbol == 18) {
            repeat = symbol == 17 ? 3 + (int)take_bits(s, 3) : 11 + (int)take_bits(s, 7);
            value = 0;
        } else if (symbol > 18) {
            s->broken = true;
        }
        if (k + repeat > literal_count + distance_count)
            s->broken = true;
        while (repeat-- > 0 && !s->broken)
            length[k++] = value;
    }
    if (s->broken || length[END_OF_BLOCK] == 0 ||
        build_code(&literals, length, literal_count) == NO_CODE ||
        build_code(&distances, length + literal_count, distance_count) == NO_CODE) {
        s->broken = true;
        return;
    }
    copy_coded(s, &literals, &distances);
}

/* Fills `out`, whose size must be that of the decompressed data; false if the data are broken or do not end where `in`
 * does. */
static bool inflate(const unsigned char *in, size_t in_size, unsigned char *out, size_t out_size)
{
    stream s = {in, in_size, 0, out, out_size, 0, 0, 0, false};
    bool last = false;
    while (!last && !s.broken) {
        last = take_bits(&s, 1) != 0;
        switch (take_bits(&s, 2)) {
        case 0: copy_stored(&s); break;
        case 1: copy_fixed(&s); break;
        case 2: copy_dynamic(&s); break;
        default: s.broken = true;
        }
    }
    return !s.broken && s.out_at == out_size && s.in_at == in_size;
}

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
        if (!inflate(content, (size_t)e.packed, *unpacked, (size_t)e.full)) {
            er_fail(failure, "the archive's member %s is broken", name);
            return NULL;
        }
        content = *unpacked;
    }
    if (er_checksum(content, (size_t)e.full) != e.checksum) {
        er_fail(failure, "the archive's member %s is damaged: its checksum is another", name);
        return NULL;
    }
    *content_size = (size_t)e.full;
    return content;
}
