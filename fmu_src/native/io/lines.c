#include "lines.h"

#include <math.h>
#include <string.h>

#include "number.h"

void er_lines_start(er_lines *lines, const char *text, er_failure *failure)
{
    *lines = (er_lines){text, 1, "", failure};
}

bool er_lines_refuse(er_lines *lines, const char *expected)
{
    return er_fail(lines->failure, "the robot's data, line %d: expected %s, got '%s'", lines->line,
                   expected, lines->word);
}

static void skip_blanks(er_lines *lines)
{
    while (*lines->at == ' ' || *lines->at == '\t' || *lines->at == '\r')
        lines->at++;
}

/* Returns the length of the whole word. */
static size_t read_word(er_lines *lines)
{
    size_t length = 0;
    skip_blanks(lines);
    for (; (unsigned char)*lines->at > ' '; lines->at++, length++)
        if (length + 1 < ER_WORD)
            lines->word[length] = *lines->at;
    lines->word[length + 1 < ER_WORD ? length : ER_WORD - 1] = '\0';
    return length;
}

void er_lines_word(er_lines *lines)
{
    read_word(lines);
}

bool er_lines_key(er_lines *lines, const char *key)
{
    return strcmp(lines->word, key) == 0 || er_lines_refuse(lines, key);
}

bool er_lines_at_end(er_lines *lines)
{
    skip_blanks(lines);
    return *lines->at == '\n' || *lines->at == '\0';
}

bool er_lines_text(er_lines *lines, size_t size, char *text, const char *expected)
{
    size_t length = read_word(lines);
    if (length == 0 || length >= size || length >= ER_WORD)
        return er_lines_refuse(lines, expected);
    strcpy(text, lines->word);
    return true;
}

bool er_lines_numbers(er_lines *lines, int count, double *values)
{
    for (int k = 0; k < count; k++) {
        skip_blanks(lines);
        if (!er_read_number(&lines->at, &values[k])) {
            read_word(lines);
            return er_lines_refuse(lines, "a finite number");
        }
    }
    return true;
}

bool er_lines_count(er_lines *lines, int least, int most, int *count)
{
    double value;
    if (!er_lines_numbers(lines, 1, &value))
        return false;
    if (!(value >= least && value <= most) || value != floor(value))
        return er_fail(lines->failure, "the robot's data, line %d: expected a whole number from %d to"
                       " %d, got %g", lines->line, least, most, value);
    *count = (int)value;
    return true;
}

bool er_lines_next(er_lines *lines)
{
    do {
        if (!er_lines_at_end(lines)) {
            read_word(lines);
            return er_lines_refuse(lines, "the line's end");
        }
        if (*lines->at == '\0') {
            strcpy(lines->word, "the text's end");
            return er_lines_refuse(lines, "the line 'end'");
        }
        lines->at++;
        lines->line++;
        read_word(lines);
    } while (lines->word[0] == '\0');
    return true;
}
