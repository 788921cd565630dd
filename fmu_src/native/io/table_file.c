#include "table_file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "npz.h"
#include "number.h"
#include "text_file.h"

/* What a message may show of a file that may be anything. */
static char printable(char c)
{
    return c >= ' ' && c <= '~' ? c : '?';
}

static const char *skip_blanks(const char *c)
{
    while (*c == ' ' || *c == '\t' || *c == '\r')
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
    table->columns = 0;
    for (;;) {
        char *name;
        size_t length = 0;
        if (table->columns == ER_MAX_TABLE_COLUMNS)
            return er_fail(failure, "expected at most %d columns, got more", ER_MAX_TABLE_COLUMNS);
        name = table->name[table->columns++];
        for (c = skip_blanks(c); c < end && *c != ','; c++)
            if (length + 1 < ER_MAX_NAME)
                name[length++] = printable(*c);
        while (length > 0 && (name[length - 1] == ' ' || name[length - 1] == '?'))
            length--; /* a carriage return shows as '?' */
        name[length] = '\0';
        if (c >= end)
            return true;
        c++;
    }
}

static bool read_row(const er_data_table *table, const char *c, const char *end, int line,
                     double *row, er_failure *failure)
{
    for (int k = 0;; k++) {
        double value;
        c = skip_blanks(c);
        if (!er_read_number(&c, &value)) {
            char got[40];
            size_t length = 0;
            for (; c < end && *c != ',' && length + 1 < sizeof got; c++)
                got[length++] = printable(*c);
            got[length] = '\0';
            return er_fail(failure, "line %d: expected a finite number, got '%s'", line, got);
        }
        if (k < table->columns)
            row[k] = value;
        c = skip_blanks(c);
        if (c >= end) {
            if (k + 1 == table->columns)
                return true;
            return er_fail(failure, "line %d: %d column names over %d columns", line,
                           table->columns, k + 1);
        }
        if (*c != ',')
            return er_fail(failure, "line %d: expected a comma between two numbers, got '%c'",
                           line, printable(*c));
        c++;
    }
}

static bool parse_csv(er_data_table *table, const char *text, er_failure *failure)
{
    const char *c = text, *end;
    size_t room = 1, width;
    int line = 1;
    if (strncmp(c, "\xEF\xBB\xBF", 3) == 0) /* byte order mark of some editors */
        c += 3;
    end = line_end(c);
    if (!read_names(table, c, end, failure))
        return false;
    width = (size_t)table->columns;
    for (const char *k = end; *k != '\0'; k++)
        room += *k == '\n';
    table->data = malloc(room * width * sizeof *table->data);
    if (table->data == NULL)
        return er_fail(failure, "it does not fit into memory");
    while (*end != '\0') {
        c = skip_blanks(end + 1);
        end = line_end(c);
        line++;
        if (c == end || *c == '#')
            continue;
        if (!read_row(table, c, end, line, table->data + table->rows * width, failure))
            return false;
        table->rows++;
    }
    return true;
}

bool er_table_read(er_data_table *table, const char *path, er_failure *failure)
{
    size_t size;
    char *content = er_read_file(path, &size);
    bool good;
    memset(table, 0, sizeof *table);
    if (content == NULL)
        return errno == ENOENT ? er_fail(failure, "does not exist")
                               : er_fail(failure, "cannot be read: %s", strerror(errno));
    if (size > 4 && memcmp(content, "PK\3\4", 4) == 0)
        good = er_npz_parse(table, (const unsigned char *)content, size, failure);
    else
        good = parse_csv(table, content, failure);
    free(content);
    if (!good) {
        er_failure inner = *failure;
        er_table_free(table);
        return er_fail(failure, "cannot be read: %.1000s", inner.text);
    }
    return true;
}

void er_table_free(er_data_table *table)
{
    free(table->data);
    table->data = NULL;
}

int er_table_column(const er_data_table *table, const char *name)
{
    for (int k = 0; k < table->columns; k++)
        if (strcmp(table->name[k], name) == 0)
            return k;
    return -1;
}
