#include "lines.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Digits and powers of ten up to these make one rounding, so the quotient or product is exact. */
#define EXACT_MANTISSA (UINT64_C(1) << 53)
#define EXACT_POWER 22
/* More digits than this cannot change the rounding of a double by more than strtod's last digit. */
#define MOST_CHARACTERS 800
#define MOST_EXPONENT 100000

static const double power_of_ten[EXACT_POWER + 1] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                     1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                     1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

typedef struct {
    const char *point; /* of the decimal point, or NULL */
    uint64_t mantissa; /* all digits, without the point */
    bool fits;         /* the mantissa is complete and below 2^53 */
    int exponent;      /* of ten, that belongs to the mantissa */
    const char *end;
} decimal;

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static bool scan_decimal(const char *text, decimal *number)
{
    const char *c = text;
    int digits = 0;
    *number = (decimal){NULL, 0, true, 0, text};
    if (*c == '+' || *c == '-')
        c++;
    for (;; c++) {
        if (*c == '.' && number->point == NULL) {
            number->point = c;
        } else if (is_digit(*c)) {
            digits++;
            if (number->mantissa >= EXACT_MANTISSA / 10)
                number->fits = false;
            else
                number->mantissa = 10 * number->mantissa + (uint64_t)(*c - '0');
            if (number->point != NULL)
                number->exponent--;
        } else {
            break;
        }
    }
    if (digits == 0)
        return false;
    if (*c == 'e' || *c == 'E') {
        const char *e = c + 1;
        int sign = 1, exponent = 0;
        if (*e == '+' || *e == '-')
            sign = *e++ == '-' ? -1 : 1;
        if (is_digit(*e)) {
            for (; is_digit(*e); e++)
                exponent = exponent < MOST_EXPONENT ? 10 * exponent + (*e - '0') : exponent;
            number->exponent += sign * exponent;
            c = e;
        }
    }
    number->end = c;
    return true;
}

/* strtod with the decimal point that the host's locale asks for. */
static bool convert_decimal(const char *text, const decimal *number, double *value)
{
    char copy[MOST_CHARACTERS + 8], sample[16];
    size_t length = (size_t)(number->end - text), point_length, before;
    if (length > MOST_CHARACTERS)
        return false;
    if (number->point == NULL) {
        memcpy(copy, text, length);
        copy[length] = '\0';
    } else {
        snprintf(sample, sizeof sample, "%.1f", 0.5); /* 0, the locale's point, 5 */
        point_length = strlen(sample) - 2;
        before = (size_t)(number->point - text);
        memcpy(copy, text, before);
        memcpy(copy + before, sample + 1, point_length);
        memcpy(copy + before + point_length, number->point + 1, length - before - 1);
        copy[length - 1 + point_length] = '\0';
    }
    *value = strtod(copy, NULL);
    return isfinite(*value);
}

bool er_read_number(const char **cursor, double *value)
{
    decimal number;
    if (!scan_decimal(*cursor, &number))
        return false;
    if (number.fits && abs(number.exponent) <= EXACT_POWER) {
        double magnitude = (double)number.mantissa;
        magnitude = number.exponent < 0 ? magnitude / power_of_ten[-number.exponent]
                                       : magnitude * power_of_ten[number.exponent];
        *value = **cursor == '-' ? -magnitude : magnitude;
    } else if (!convert_decimal(*cursor, &number, value)) {
        return false;
    }
    *cursor = number.end;
    return true;
}

void er_lines_start(er_lines *lines, const char *text, er_failure *failure)
{
    *lines = (er_lines){text, 1, "", failure};
}

bool er_lines_refuse(er_lines *lines, const char *expected)
{
    return er_fail(lines->failure, "the robot's data, line %d: expected %s, got '%s'", lines->line,
                   expected, lines->word);
}

static void skip_line_blanks(er_lines *lines)
{
    while (*lines->at == ' ' || *lines->at == '\t' || *lines->at == '\r')
        lines->at++;
}

/* Returns the length of the whole word. */
static size_t read_word(er_lines *lines)
{
    size_t length = 0;
    skip_line_blanks(lines);
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
    skip_line_blanks(lines);
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
        skip_line_blanks(lines);
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
