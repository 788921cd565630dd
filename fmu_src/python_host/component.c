#include "component.h"

#include <stdlib.h>
#include <string.h>

/* Masters format messages like printf. */
void er_component_tell(const er_component *c, fmi2Status status, const char *text)
{
    char escaped[ER_ESCAPED_TEXT];
    if (c->host.logger == NULL)
        return;
    er_escape(text, escaped);
    c->host.logger(c->host.componentEnvironment, c->name, status,
                   status == fmi2Fatal ? "logStatusFatal" : "logStatusError", escaped);
}

/* Takes PythonFMU's messages.  What it calls fatal is a Python exception, which the slave has told as an
 * error before; it is kept until the call ends and it is known whether the instance goes on. */
static void relay(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                  fmi2String category, fmi2String message, ...)
{
    er_component *c = environment;
    (void)name;
    if (status == fmi2Fatal) {
        const char *reason = strchr(message, '\n'); /* before it, PythonFMU's function */
        er_fail(&c->cause, "%s", reason != NULL ? reason + 1 : message);
        return;
    }
    c->told = c->told || status == fmi2Error;
    if (c->host.logger != NULL)
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
    c->told = false;
    c->cause.text[0] = '\0';
    return true;
}

fmi2Status er_component_end(er_component *c, fmi2Status status)
{
    if (status != fmi2Fatal)
        return status;
    if (!c->told && c->cause.text[0] != '\0')
        er_component_tell(c, fmi2Error, c->cause.text);
    return fmi2Error;
}
