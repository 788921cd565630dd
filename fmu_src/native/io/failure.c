#include "failure.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bool er_fail(er_failure *failure, const char *format, ...)
{
    va_list arguments;
    failure->may_retry = false;
    va_start(arguments, format);
    vsnprintf(failure->text, sizeof failure->text, format, arguments);
    va_end(arguments);
    return false;
}

const char *er_shown(double value, char text[ER_NUMBER_TEXT])
{
    snprintf(text, ER_NUMBER_TEXT, "%.12g", isnan(value) ? fabs(value) : value);
    if (isfinite(value) && strpbrk(text, ".,e") == NULL)
        strcat(text, ".0");
    return text;
}

void er_escape(const char *text, const char *doubled, char escaped[ER_ESCAPED_TEXT])
{
    size_t length = 0;
    for (; *text != '\0' && length + 3 < ER_ESCAPED_TEXT; text++) {
        if (strchr(doubled, *text) != NULL)
            escaped[length++] = *text;
        escaped[length++] = *text;
    }
    escaped[length] = '\0';
}
