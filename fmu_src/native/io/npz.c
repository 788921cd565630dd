#include "npz.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "inflate.h"

/* Sizes of the zip records' fixed parts, and marks in them (PKWARE, APPNOTE.TXT). */
enum { LOCAL_HEADER = 30, CENTRAL_HEADER = 46, END_RECORD = 22, MOST_COMMENT = 65535 };
enum { STORED = 0, DEFLATED = 8 };
/* A size that stands in the zip64 extra field instead. */
#define IN_EXTRA UINT64_C(0xffffffff)
#define ZIP64_FIELD 1
#define MOST_MEMBER (UINT64_C(1) << 33)

typedef struct {
    const unsigned char *bytes;
    size_t size;
} slice;

/* One array: its bytes and what the header says of them. */
typedef struct {
    unsigned char *unpacked;      /* to be freed; NULL: it lies in the archive as it is */
    const unsigned char *content; /* the whole .npy */
    const unsigned char *data;
    size_t bytes, shape[2];
    char kind;        /* 'f' or 'U' */
    size_t item;      /* bytes of an entry */
    bool column_major;
} array;

static uint64_t little(const unsigned char *at, int bytes)
{
    uint64_t value = 0;
    while (bytes-- > 0)
        value = value << 8 | at[bytes];
    return value;
}

static const unsigned char *find_end_record(slice zip)
{
    size_t furthest = zip.size > END_RECORD + MOST_COMMENT ? zip.size - END_RECORD - MOST_COMMENT : 0;
    for (size_t at = zip.size - END_RECORD + 1; at-- > furthest;)
        if (memcmp(zip.bytes + at, "PK\5\6", 4) == 0)
            return zip.bytes + at;
    return NULL;
}

/* Sizes and offset that do not fit into the central header stand, in this order, in an extra field. */
static void widen(const unsigned char *extra, size_t length, uint64_t *values[3])
{
    while (length >= 4) {
        size_t field = (size_t)little(extra + 2, 2), at = 4;
        if (field + 4 > length)
            return;
        if (little(extra, 2) == ZIP64_FIELD)
            for (int k = 0; k < 3; k++)
                if (*values[k] == IN_EXTRA && at + 8 <= field + 4) {
                    *values[k] = little(extra + at, 8);
                    at += 8;
                }
        extra += field + 4;
        length -= field + 4;
    }
}

static bool unpack(slice zip, const unsigned char *central, size_t room, array *a, size_t *size)
{
    uint64_t packed = little(central + 20, 4), full = little(central + 24, 4);
    uint64_t offset = little(central + 42, 4), start, method = little(central + 10, 2);
    uint64_t *values[3] = {&full, &packed, &offset};
    size_t name = (size_t)little(central + 28, 2), extra = (size_t)little(central + 30, 2);
    if (CENTRAL_HEADER + name + extra > room)
        return false;
    widen(central + CENTRAL_HEADER + name, extra, values);
    if (offset > zip.size || zip.size - offset < LOCAL_HEADER || full > MOST_MEMBER)
        return false;
    start = offset + LOCAL_HEADER + little(zip.bytes + offset + 26, 2) +
            little(zip.bytes + offset + 28, 2);
    if (start > zip.size || packed > zip.size - start)
        return false;
    *size = (size_t)full;
    a->content = zip.bytes + start;
    if (method == STORED)
        return packed == full;
    a->content = a->unpacked = malloc((size_t)full + 1);
    return method == DEFLATED && a->unpacked != NULL &&
           er_inflate(zip.bytes + start, (size_t)packed, a->unpacked, (size_t)full);
}

/* Finds the content of a member of the archive; false if it is not there or broken. */
static bool member(slice zip, const char *wanted, array *a, size_t *size)
{
    const unsigned char *end = zip.size >= END_RECORD ? find_end_record(zip) : NULL;
    size_t at, entries, length = strlen(wanted);
    if (end == NULL)
        return false;
    at = (size_t)little(end + 16, 4);
    for (entries = (size_t)little(end + 10, 2); entries > 0; entries--) {
        const unsigned char *central = zip.bytes + at;
        size_t name;
        if (at > zip.size || zip.size - at < CENTRAL_HEADER || memcmp(central, "PK\1\2", 4) != 0)
            return false;
        name = (size_t)little(central + 28, 2);
        if (name > zip.size - at - CENTRAL_HEADER)
            return false;
        if (name == length && memcmp(central + CENTRAL_HEADER, wanted, length) == 0)
            return unpack(zip, central, zip.size - at, a, size);
        at += CENTRAL_HEADER + name + (size_t)little(central + 30, 2) +
              (size_t)little(central + 32, 2);
    }
    return false;
}

/* What stands behind a key of the header, a Python dictionary as text. */
static const char *value_of(const char *header, const char *key)
{
    const char *found = strstr(header, key);
    if (found == NULL)
        return NULL;
    found += strlen(key);
    while (*found == ' ' || *found == ':' || *found == '\'')
        found++;
    return found;
}

static bool parse_header(array *a, size_t size, er_failure *failure, const char *name)
{
    unsigned version = size > 12 ? a->content[6] : 0;
    size_t prefix = version == 1 ? 10 : 12, length, count = 1;
    char header[1024];
    const char *descr, *order, *shape;
    if (size <= 12 || memcmp(a->content, "\x93NUMPY", 6) != 0)
        return er_fail(failure, "the array %s is not in NumPy's format", name);
    length = (size_t)little(a->content + 8, version == 1 ? 2 : 4);
    if (length >= sizeof header || length > size - prefix)
        return er_fail(failure, "the array %s has a header that is too long", name);
    memcpy(header, a->content + prefix, length);
    header[length] = '\0';
    descr = value_of(header, "'descr'");
    order = value_of(header, "'fortran_order'");
    shape = value_of(header, "'shape'");
    if (descr == NULL || order == NULL || shape == NULL || (*descr != '<' && *descr != '|'))
        return er_fail(failure, "the array %s has another byte order or no header", name);
    a->kind = descr[1];
    a->item = (size_t)atoi(descr + 2) * (a->kind == 'U' ? 4 : 1);
    a->column_major = *order == 'T';
    a->shape[0] = a->shape[1] = 1;
    shape++;
    for (int k = 0; k < 2 && *shape >= '0' && *shape <= '9'; k++) {
        char *behind;
        a->shape[k] = (size_t)strtoull(shape, &behind, 10);
        if (a->shape[k] > MOST_MEMBER)
            return er_fail(failure, "the array %s is too large", name);
        count *= a->shape[k] > 0 ? a->shape[k] : 1;
        shape = behind + strspn(behind, ", ");
    }
    a->data = a->content + prefix + length;
    a->bytes = size - prefix - length;
    if (a->item == 0 || a->shape[0] == 0 || a->shape[1] == 0 || a->bytes / a->item < count)
        return er_fail(failure, "the array %s is empty or cut short", name);
    return true;
}

static bool open_array(slice zip, const char *name, array *a, er_failure *failure)
{
    char file[32];
    size_t size = 0;
    snprintf(file, sizeof file, "%s.npy", name);
    if (!member(zip, file, a, &size))
        return er_fail(failure, "expected the arrays 'columns' and 'data', got no readable '%s'",
                       name);
    return parse_header(a, size, failure, name);
}

static bool take_names(er_data_table *table, const array *a, er_failure *failure)
{
    if (a->kind != 'U' || a->shape[1] != 1 || a->shape[0] > ER_MAX_COLUMNS)
        return er_fail(failure, "the array 'columns' is not a list of at most %d texts",
                       ER_MAX_COLUMNS);
    table->columns = (int)a->shape[0];
    for (int k = 0; k < table->columns; k++) {
        char *name = table->name[k];
        for (size_t c = 0; c < a->item / 4 && c + 1 < ER_MAX_NAME; c++) {
            uint64_t letter = little(a->data + (size_t)k * a->item + 4 * c, 4);
            name[c] = letter < 128 ? (char)letter : '?';
            name[c + 1] = '\0';
        }
    }
    return true;
}

/* Whether this machine keeps numbers as the file does. */
static bool is_little(void)
{
    const double one = 1.0;
    unsigned char bytes[sizeof one];
    memcpy(bytes, &one, sizeof one);
    return bytes[sizeof one - 1] == 0x3f;
}

static bool take_data(er_data_table *table, const array *a, er_failure *failure)
{
    size_t rows = a->shape[0], columns = a->shape[1];
    if (a->kind != 'f' || a->item != 8)
        return er_fail(failure, "the array 'data' is not of double numbers");
    if (columns != (size_t)table->columns)
        return er_fail(failure, "%d column names over %lu columns", table->columns,
                       (unsigned long)columns);
    table->rows = rows;
    table->data = malloc(rows * columns * sizeof *table->data);
    if (table->data == NULL)
        return er_fail(failure, "it does not fit into memory");
    if (!a->column_major && is_little()) {
        memcpy(table->data, a->data, rows * columns * sizeof *table->data);
        return true;
    }
    for (size_t i = 0; i < rows; i++)
        for (size_t j = 0; j < columns; j++) {
            size_t from = a->column_major ? j * rows + i : i * columns + j;
            uint64_t bits = little(a->data + 8 * from, 8);
            memcpy(&table->data[i * columns + j], &bits, sizeof bits);
        }
    return true;
}

bool er_npz_parse(er_data_table *table, const unsigned char *archive, size_t size,
                  er_failure *failure)
{
    slice zip = {archive, size};
    array columns = {0}, data = {0};
    bool good = open_array(zip, "columns", &columns, failure) &&
                take_names(table, &columns, failure) &&
                open_array(zip, "data", &data, failure) && take_data(table, &data, failure);
    free(columns.unpacked);
    free(data.unpacked);
    return good;
}
