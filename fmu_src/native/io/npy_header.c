#include "npy_header.h"

#include <string.h>

enum { SIZE_DIGITS = 7, AXIS_DIGITS = 13 };
#define MOST_AXIS (UINT64_C(1) << 40)

typedef struct {
    const char *at, *end;
} cursor;

static void skip_blanks(cursor *c)
{
    while (c->at < c->end && (*c->at == ' ' || *c->at == '\n'))
        c->at++;
}

/* Passes blanks, then a word if it stands there. */
static bool take(cursor *c, const char *word)
{
    size_t length = strlen(word);
    skip_blanks(c);
    if ((size_t)(c->end - c->at) < length || memcmp(c->at, word, length) != 0)
        return false;
    c->at += length;
    return true;
}

static bool take_number(cursor *c, int most_digits, uint64_t *value)
{
    int digits = 0;
    for (*value = 0; c->at < c->end && *c->at >= '0' && *c->at <= '9' && digits < most_digits; digits++)
        *value = 10 * *value + (uint64_t)(*c->at++ - '0');
    return digits > 0;
}

static bool read_kind(cursor *c, er_npy_header *header)
{
    uint64_t size;
    char order;
    if (!take(c, "'") || c->end - c->at < 2)
        return false;
    order = c->at[0];
    header->kind = c->at[1];
    c->at += 2;
    if (order == '\0' || strchr("<>|", order) == NULL ||
        !((header->kind >= 'a' && header->kind <= 'z') || (header->kind >= 'A' && header->kind <= 'Z')) ||
        !take_number(c, SIZE_DIGITS, &size) || c->at == c->end || *c->at != '\'')
        return false;
    c->at++;
    header->big = order == '>';
    header->size = (unsigned)size;
    return order != '|' || size == 1;
}

static bool read_shape(cursor *c, er_npy_header *header)
{
    if (!take(c, "("))
        return false;
    for (header->axes = 0; !take(c, ")");) {
        uint64_t length;
        skip_blanks(c);
        if (!take_number(c, AXIS_DIGITS, &length) || header->axes == 2 || length > MOST_AXIS)
            return false;
        header->shape[header->axes++] = length;
        if (!take(c, ","))
            return take(c, ")");
    }
    return true;
}

static bool read_order(cursor *c, er_npy_header *header)
{
    header->column_major = take(c, "True");
    return header->column_major || take(c, "False");
}

bool er_npy_header_parse(er_npy_header *header, const char *text, size_t length)
{
    static const struct {
        const char *key;
        bool (*read)(cursor *, er_npy_header *);
    } parts[3] = {{"'descr'", read_kind}, {"'fortran_order'", read_order}, {"'shape'", read_shape}};
    cursor c = {text, text + length};
    unsigned seen = 0;
    if (!take(&c, "{"))
        return false;
    while (!take(&c, "}")) {
        unsigned part = 0;
        while (part < 3 && !take(&c, parts[part].key))
            part++;
        if (part == 3 || (seen >> part & 1u) != 0 || !take(&c, ":") || !parts[part].read(&c, header))
            return false;
        seen |= 1u << part;
        if (!take(&c, ",")) {
            if (!take(&c, "}"))
                return false;
            break;
        }
    }
    skip_blanks(&c);
    return c.at == c.end && seen == 7;
}
