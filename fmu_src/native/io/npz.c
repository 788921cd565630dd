#include "npz.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "zip.h"

typedef struct {
    char kind;     /* of an entry: 'f', 'i', 'u', 'U' .. */
    unsigned size; /* the number behind it: bytes, or letters of a 'U' */
    bool big;      /* the most significant byte comes first */
    bool column_major;
    int axes; /* 0 to 2 */
    uint64_t shape[2];
} npy_header;

enum { SIZE_DIGITS = 7,
       AXIS_DIGITS = 13 };
#define MOST_AXIS (UINT64_C(1) << 40)

typedef struct {
    const char *at, *end;
} cursor;

static void skip_header_blanks(cursor *c)
{
    while (c->at < c->end && (*c->at == ' ' || *c->at == '\n'))
        c->at++;
}

/* Passes blanks, then a word if it stands there. */
static bool take_word(cursor *c, const char *word)
{
    size_t length = strlen(word);
    skip_header_blanks(c);
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

static bool read_kind(cursor *c, npy_header *header)
{
    uint64_t size;
    char order;
    if (!take_word(c, "'") || c->end - c->at < 2)
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

static bool read_shape(cursor *c, npy_header *header)
{
    if (!take_word(c, "("))
        return false;
    for (header->axes = 0; !take_word(c, ")");) {
        uint64_t length;
        skip_header_blanks(c);
        if (!take_number(c, AXIS_DIGITS, &length) || header->axes == 2 || length > MOST_AXIS)
            return false;
        header->shape[header->axes++] = length;
        if (!take_word(c, ","))
            return take_word(c, ")");
    }
    return true;
}

static bool read_order(cursor *c, npy_header *header)
{
    header->column_major = take_word(c, "True");
    return header->column_major || take_word(c, "False");
}

/* Reads a header as NumPy writes it, its keys in any order. */
static bool parse_header(npy_header *header, const char *text, size_t length)
{
    static const struct {
        const char *key;
        bool (*read)(cursor *, npy_header *);
    } parts[3] = {{"'descr'", read_kind}, {"'fortran_order'", read_order}, {"'shape'", read_shape}};
    cursor c = {text, text + length};
    unsigned seen = 0;
    if (!take_word(&c, "{"))
        return false;
    while (!take_word(&c, "}")) {
        unsigned part = 0;
        while (part < 3 && !take_word(&c, parts[part].key))
            part++;
        if (part == 3 || (seen >> part & 1u) != 0 || !take_word(&c, ":") || !parts[part].read(&c, header))
            return false;
        seen |= 1u << part;
        if (!take_word(&c, ",")) {
            if (!take_word(&c, "}"))
                return false;
            break;
        }
    }
    skip_header_blanks(&c);
    return c.at == c.end && seen == 7;
}

/* One array: its bytes and what the header says of them. */
typedef struct {
    const unsigned char *content; /* the whole .npy */
    const unsigned char *data;
    size_t bytes;
    npy_header header;
} array;

static bool open_array(const unsigned char *archive, size_t size, const char *name, const char *file,
                       array *a, er_failure *failure)
{
    size_t content_size = 0, prefix, length;
    a->content = er_zip_member(archive, size, file, &content_size, failure);
    if (a->content == NULL)
        return false;
    if (content_size < 12 || memcmp(a->content, "\x93NUMPY", 6) != 0 || a->content[6] < 1 || a->content[6] > 3)
        return er_fail(failure, "the array '%s' is not in NumPy's format", name);
    prefix = a->content[6] == 1 ? 10 : 12;
    length = (size_t)er_little(a->content + 8, prefix == 10 ? 2 : 4);
    if (length > content_size - prefix)
        return er_fail(failure, "the array '%s' is cut short", name);
    if (!parse_header(&a->header, (const char *)a->content + prefix, length))
        return er_fail(failure, "the array '%s' has a header that is not NumPy's", name);
    a->data = a->content + prefix + length;
    a->bytes = content_size - prefix - length;
    return true;
}

/* Whether the bytes are as many as the header says, for entries of a size. */
static bool require_size(const array *a, const char *name, size_t item, er_failure *failure)
{
    uint64_t left = a->bytes / item, rows = a->header.shape[0];
    uint64_t columns = a->header.axes == 2 ? a->header.shape[1] : 1;
    bool fits = rows == 0 || columns == 0 ? left == 0 : left % rows == 0 && left / rows == columns;
    return (a->bytes % item == 0 && fits) ||
           er_fail(failure, "the array '%s' has %lu bytes, not those of its header", name, (unsigned long)a->bytes);
}

static uint64_t bits_at(const unsigned char *at, size_t size, bool big)
{
    uint64_t value = 0;
    if (!big)
        return er_little(at, (int)size);
    for (size_t k = 0; k < size; k++)
        value = value << 8 | at[k];
    return value;
}

static char letter_at(const unsigned char *letters, size_t k, bool big)
{
    uint64_t letter = bits_at(letters + 4 * k, 4, big);
    return letter < 128 ? (char)letter : '?';
}

/* Without zeros at its end and blanks around it, cut to the buffer: no name that is sought is as long. */
static void take_name(char *name, const unsigned char *letters, size_t count, bool big)
{
    size_t length = 0;
    while (count > 0 && letter_at(letters, count - 1, big) == '\0')
        count--;
    while (count > 0 && er_is_blank(letter_at(letters, count - 1, big)))
        count--;
    for (; count > 0 && er_is_blank(letter_at(letters, 0, big)); count--)
        letters += 4;
    for (; length < count && length + 1 < ER_MAX_NAME; length++)
        name[length] = er_printable(letter_at(letters, length, big));
    name[length] = '\0';
}

static bool take_names(er_data_table *table, const array *a, er_failure *failure)
{
    size_t letters = a->header.kind == 'U' ? a->header.size : 0;
    if (letters == 0 || a->header.axes != 1)
        return er_fail(failure, "the array 'columns' is not a list of texts");
    if (!require_size(a, "columns", 4 * letters, failure))
        return false;
    if (a->header.shape[0] > ER_MAX_TABLE_COLUMNS)
        return er_fail(failure, "expected at most %d columns, got more", ER_MAX_TABLE_COLUMNS);
    table->columns = (int)a->header.shape[0];
    for (int k = 0; k < table->columns; k++)
        take_name(table->name[k], a->data + (size_t)k * 4 * letters, letters, a->header.big);
    return true;
}

/* A number of one of the kinds that is_number() knows. */
static double number_at(const array *a, size_t entry)
{
    size_t size = a->header.size;
    uint64_t bits = bits_at(a->data + size * entry, size, a->header.big);
    if (a->header.kind == 'u')
        return (double)bits;
    if (a->header.kind == 'i') {
        uint64_t sign = UINT64_C(1) << (8 * size - 1);
        return bits < sign ? (double)bits : -(double)(sign - (bits - sign));
    }
    if (size == 4) {
        uint32_t narrow = (uint32_t)bits;
        float value;
        memcpy(&value, &narrow, sizeof value);
        return (double)value;
    } else {
        double value;
        memcpy(&value, &bits, sizeof value);
        return value;
    }
}

static bool is_number(const npy_header *header)
{
    unsigned size = header->size;
    bool power = size == 1 || size == 2 || size == 4 || size == 8;
    return header->kind == 'f' ? size == 4 || size == 8
                               : (header->kind == 'i' || header->kind == 'u') && power;
}

/* Whether the table lies in the file as this machine keeps it. */
static bool is_native(const npy_header *header)
{
    const double one = 1.0;
    unsigned char bytes[sizeof one];
    memcpy(bytes, &one, sizeof one);
    return header->kind == 'f' && header->size == sizeof one && !header->column_major &&
           header->big == (bytes[0] != 0);
}

static bool take_data(er_data_table *table, const array *a, unsigned char *archive, er_failure *failure)
{
    size_t rows = (size_t)a->header.shape[0], columns = (size_t)a->header.shape[1];
    if (!is_number(&a->header) || a->header.axes != 2)
        return er_fail(failure, "the array 'data' is not a table of numbers");
    if (!require_size(a, "data", a->header.size, failure))
        return false;
    if (columns != (size_t)table->columns)
        return er_fail(failure, "%d column names over %lu columns", table->columns, (unsigned long)columns);
    table->rows = columns > 0 ? rows : 0;
    if (table->rows == 0)
        return true;
    if (is_native(&a->header)) {
        table->data = memmove(archive, a->data, a->bytes);
        return true;
    }
    table->data = malloc(rows * columns * sizeof *table->data);
    if (table->data == NULL)
        return er_fail(failure, "it does not fit into memory");
    for (size_t i = 0; i < rows; i++)
        for (size_t j = 0; j < columns; j++)
            table->data[i * columns + j] =
                number_at(a, a->header.column_major ? j * rows + i : i * columns + j);
    return true;
}

bool er_npz_parse(er_data_table *table, unsigned char *archive, size_t size, er_failure *failure)
{
    array columns = {0}, data = {0};
    return open_array(archive, size, "columns", "columns.npy", &columns, failure) &&
           take_names(table, &columns, failure) && open_array(archive, size, "data", "data.npy", &data, failure) &&
           take_data(table, &data, archive, failure);
}
