/* Decompression of deflate's format (RFC 1951). */
#include "table_file.h"

#include <string.h>

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

bool er_inflate(const unsigned char *in, size_t in_size, unsigned char *out, size_t out_size)
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
