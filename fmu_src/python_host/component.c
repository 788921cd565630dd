#include "component.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../native/fmi/log_categories.h"

/* Begins the sentences of exceptions that leave the host another try; slave_refusal.py has the same. */
#define DISCARD_MARK "[discard] "

/* Masters format messages like printf, and # begins the reference of a variable. */
void er_component_tell(const er_component *c, fmi2Status status, const char *text)
{
    unsigned category = status == fmi2Fatal     ? ER_LOG_FATAL
                        : status == fmi2Discard ? ER_LOG_DISCARD
                                                : ER_LOG_ERROR;
    char escaped[ER_ESCAPED_TEXT];
    if (c->host.logger == NULL || (c->log & category) == 0)
        return;
    er_escape(text, "%#", escaped);
    c->host.logger(c->host.componentEnvironment, c->name, status, er_log_name(category), escaped);
}

fmi2Status er_component_refuse(const er_component *c, const char *text)
{
    fprintf(stderr, "%s: %s\n", c->name, text);
    fflush(stderr);
    er_component_tell(c, fmi2Error, text);
    return fmi2Error;
}

bool er_component_given(const er_component *c, size_t count, const void *first, const void *second)
{
    if (count == 0 || (first != NULL && second != NULL))
        return true;
    er_component_refuse(c, "expected the address of every array and result, got NULL");
    return false;
}

/* The slave's sentences are formatted like printf already. */
static void unescape(char *text)
{
    char *to = text;
    for (; *text != '\0'; text++) {
        *to++ = *text;
        if (text[0] == text[1] && (*text == '%' || *text == '#'))
            text++;
    }
    *to = '\0';
}

/* Takes PythonFMU's messages.  What it calls fatal is a Python exception; it is kept until the call ends and
 * it is known whether the instance goes on. */
static void relay(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                  fmi2String category, fmi2String message, ...)
{
    er_component *c = environment;
    unsigned wanted;
    (void)name;
    if (status == fmi2Fatal) {
        const char *reason = strchr(message, '\n'); /* before it, PythonFMU's function */
        reason = reason != NULL ? reason + 1 : message;
        c->discards = strncmp(reason, DISCARD_MARK, sizeof DISCARD_MARK - 1) == 0;
        er_fail(&c->cause, "%s", reason + (c->discards ? sizeof DISCARD_MARK - 1 : 0));
        unescape(c->cause.text);
        return;
    }
    c->told = c->told || status == fmi2Error;
    c->warned = c->warned || status == fmi2Warning;
    wanted = status == fmi2OK        ? ER_LOG_EVENTS
             : status == fmi2Warning ? ER_LOG_WARNING
                                     : ER_LOG_ERROR;
    if (c->host.logger != NULL && (c->log & wanted) != 0)
        c->host.logger(c->host.componentEnvironment, c->name, status,
                       category != NULL ? category : "logAll", message);
}

er_component *er_component_create(fmi2String name, const fmi2CallbackFunctions *functions)
{
    size_t length = name != NULL ? strlen(name) : 0;
    er_component *c = calloc(1, sizeof *c + length + 1);
    if (c == NULL)
        return NULL;
    if (length > 0)
        memcpy(c->name, name, length);
    if (functions != NULL)
        c->host = *functions;
    c->relayed = (fmi2CallbackFunctions){relay, NULL, NULL, NULL, c};
    return c;
}

void er_component_free(er_component *c)
{
    free(c);
}

bool er_component_begin(er_component *c)
{
    if (c == NULL || c->lost)
        return false;
    c->told = c->warned = c->discards = false;
    c->cause.text[0] = '\0';
    return true;
}

fmi2Status er_component_none(const er_component *c)
{
    return c == NULL ? fmi2Error : fmi2Fatal;
}

fmi2Status er_component_end(er_component *c, fmi2Status status)
{
    if (status != fmi2Fatal)
        return status == fmi2OK && c->warned ? fmi2Warning : status;
    status = c->discards ? fmi2Discard : fmi2Error;
    if (!c->told && c->cause.text[0] != '\0')
        er_component_tell(c, status, c->cause.text);
    return status;
}
