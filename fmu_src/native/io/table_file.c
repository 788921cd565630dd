#include "table_file.h"

#include <stdlib.h>
#include <string.h>

#include "npz.h"
#include "lines.h"

/* Longest number that is read: all that can tell two doubles apart. */
#define MOST_DIGITS 800

static const char *skip_cell_blanks(const char *c)
{
    while (er_is_blank(*c))
        c++;
    return c;
}

static const char *line_end(const char *c)
{
    while (*c != '\n' && *c != '\0')
        c++;
    return c;
}

/* Names between commas, without blanks around them; cut to the buffer. */
static bool read_names(er_data_table *table, const char *c, const char *end, er_failure *failure)
{
    for (table->columns = 0;; c++) {
        const char *from, *to;
        char *name;
        size_t length = 0;
        if (table->columns == ER_MAX_TABLE_COLUMNS)
            return er_fail(failure, "expected at most %d columns, got more", ER_MAX_TABLE_COLUMNS);
        for (from = c; c < end && *c != ','; c++)
            continue;
        for (to = c; from < to && er_is_blank(*from); from++)
            continue;
        while (from < to && er_is_blank(to[-1]))
            to--;
        name = table->name[table->columns++];
        for (; from + length < to && length + 1 < ER_MAX_NAME; length++)
            name[length] = er_printable(from[length]);
        name[length] = '\0';
        if (c == end)
            return true;
    }
}

static bool read_row(const er_data_table *table, const char *c, const char *end, int line,
                     double *row, er_failure *failure)
{
    for (int k = 0;; k++) {
        const char *from = c = skip_cell_blanks(c);
        double value;
        if (!er_read_number(&c, &value) || c - from > MOST_DIGITS) {
            char got[40];
            size_t length = 0;
            for (c = from; c < end && *c != ',' && length + 1 < sizeof got; c++)
                got[length++] = er_printable(*c);
            got[length] = '\0';
            return er_fail(failure, "line %d: expected a finite number, got '%s'", line, got);
        }
        if (k < table->columns)
            row[k] = value;
        c = skip_cell_blanks(c);
        if (c >= end) {
            if (k + 1 == table->columns)
                return true;
            return er_fail(failure, "line %d: %d column names over %d columns", line, table->columns, k + 1);
        }
        if (*c != ',')
            return er_fail(failure, "line %d: expected a comma between two numbers, got '%c'", line, er_printable(*c));
        c++;
    }
}

static bool parse_csv(er_data_table *table, const char *text, size_t size, er_failure *failure)
{
    const char *c = text, *end, *zero = memchr(text, '\0', size);
    size_t room = 1, width;
    int line = 1;
    if (zero != NULL) {
        for (const char *k = text; k < zero; k++)
            line += *k == '\n';
        return er_fail(failure, "expected text, got a zero byte in line %d", line);
    }
    if (strncmp(c, "\xEF\xBB\xBF", 3) == 0) /* byte order mark of some editors */
        c += 3;
    end = line_end(c);
    if (!read_names(table, c, end, failure))
        return false;
    width = (size_t)table->columns;
    /* No row is shorter than a digit and a comma or the line's end for each column. */
    for (const char *k = end; *k != '\0'; k++)
        room += *k == '\n';
    room = room < size / (2 * width) + 1 ? room : size / (2 * width) + 1;
    table->data = malloc(room * width * sizeof *table->data);
    if (table->data == NULL)
        return er_fail(failure, "it does not fit into memory");
    while (*end != '\0') {
        c = skip_cell_blanks(end + 1);
        end = line_end(c);
        line++;
        if (c == end || *c == '#')
            continue;
        if (table->rows == room)
            return er_fail(failure, "line %d: %d column names over fewer columns", line, table->columns);
        if (!read_row(table, c, end, line, table->data + table->rows * width, failure))
            return false;
        table->rows++;
    }
    return true;
}

/* Content of a file, from malloc; what is left of it is the table's where it holds the numbers. */
static bool parse_table(er_data_table *table, char *content, size_t size, bool is_npz, er_failure *failure)
{
    memset(table, 0, sizeof *table);
    if (size == 0)
        return er_fail(failure, "expected a table, got an empty file");
    if (is_npz || (size > 4 && memcmp(content, "PK\3\4", 4) == 0))
        return er_npz_parse(table, (unsigned char *)content, size, failure);
    return parse_csv(table, content, size, failure);
}

bool er_table_read(er_data_table *table, const char *path, er_failure *failure)
{
    size_t size, length = strlen(path);
    char *content = er_read_file(path, &size, failure);
    bool good, kept;
    if (content == NULL)
        return false;
    good = parse_table(table, content, size, length >= 4 && strcmp(path + length - 4, ".npz") == 0, failure);
    kept = (void *)table->data == (void *)content;
    if (!good)
        er_table_free(table);
    if (!kept)
        free(content);
    return good;
}

void er_table_free(er_data_table *table)
{
    free(table->data);
    table->data = NULL;
}

int er_table_column(const er_data_table *table, const char *name, int *count)
{
    int column = -1;
    *count = 0;
    for (int k = 0; k < table->columns; k++)
        if (strcmp(table->name[k], name) == 0 && (*count)++ == 0)
            column = k;
    return column;
}
