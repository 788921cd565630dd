#include "failure.h"

#include <stdarg.h>
#include <stdio.h>

bool er_fail(er_failure *failure, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(failure->text, sizeof failure->text, format, arguments);
    va_end(arguments);
    return false;
}
