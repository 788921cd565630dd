/* An instance: how it is made and freed, what its host is told; and PythonFMU's library, which all instances share. */
#include "component.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <wchar.h>

#include "../native/fmi/log_categories.h"

/* Among the resources: the name of the slave's module, and the FMU's GUID. */
#define SLAVE_FILE "slavemodule.txt"
#define GUID_FILE "guid.txt"

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
    /* A warning of a step is for the log only; the call is fmi2OK. */
    if (category != NULL && strcmp(category, er_log_name(ER_LOG_WARNING)) == 0)
        status = fmi2Warning;
    wanted = status == fmi2OK        ? ER_LOG_EVENTS
             : status == fmi2Warning ? ER_LOG_WARNING
                                     : ER_LOG_ERROR;
    if (c->host.logger != NULL && (c->log & wanted) != 0)
        c->host.logger(c->host.componentEnvironment, c->name, status,
                       category != NULL ? category : "logAll", message);
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

/* The same for all instances of this FMU; another FMU has a library, and these, of its own. */
static er_inner functions;
static er_failure failed;
static bool loaded;

/* Starts Python where it does not run yet.  It then runs until the process is gone: it is not ended, since
 * numpy and its like cannot be loaded twice. */
static bool start_python(er_failure *failure)
{
    const char *program;
    int (*is_initialized)(void);
    void (*initialize)(int handle_signals);
    void *(*release)(void);
    wchar_t *(*decode)(const char *text, size_t *length);
    void (*set_program)(const wchar_t *name);

    if (!er_require_python(&program, failure))
        return false;
    /* ISO C knows no cast from an object's to a function's address. */
    *(void **)&is_initialized = er_python_function("Py_IsInitialized");
    *(void **)&initialize = er_python_function("Py_InitializeEx");
    *(void **)&release = er_python_function("PyEval_SaveThread");
    *(void **)&decode = er_python_function("Py_DecodeLocale");
    *(void **)&set_program = er_python_function("Py_SetProgramName");
    if (is_initialized == NULL || initialize == NULL || release == NULL)
        return er_fail(failure, "Python of this process: expected version 3.11 or newer, got one without"
                                " Py_IsInitialized, Py_InitializeEx or PyEval_SaveThread");
    if (is_initialized())
        return true;
    /* The packages are found from the program's place: that of a virtual environment, say. */
    if (program != NULL && decode != NULL && set_program != NULL)
        set_program(decode(program, NULL));
    initialize(0); /* the host's signals stay the host's */
    release();
    return true;
}

static void load(void)
{
    void *library;
    if (!start_python(&failed))
        return;
    library = er_load_inner(&failed);
    if (library == NULL)
        return;
    /* ISO C knows no cast from an object's to a function's address. */
#define ER_FIND(name)                                                                               \
    *(void **)&functions.name = er_function(library, #name);                                        \
    if (functions.name == NULL) {                                                                   \
        er_fail(&failed, "PythonFMU's library has no function " #name);                             \
        return;                                                                                     \
    }
    ER_EACH_FUNCTION(ER_FIND)
    loaded = true;
}

/* The functions, after starting Python and loading the library at the first call in this process; NULL with
 * the reason if that failed. */
static const er_inner *inner_functions(er_failure *failure)
{
    er_once(load);
    if (loaded)
        return &functions;
    *failure = failed;
    return NULL;
}

/* An instance without PythonFMU's; NULL if memory is short. */
static er_component *create(fmi2String name, const fmi2CallbackFunctions *functions)
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

/* Whether a file among the resources has this text, or any text if it is NULL. */
static bool has(const char *location, const char *name, const char *text)
{
    char line[100] = "", *path = er_path_from_uri(location, name);
    FILE *file = path != NULL ? fopen(path, "r") : NULL;
    bool read = file != NULL && fgets(line, sizeof line, file) != NULL;
    if (file != NULL)
        fclose(file);
    free(path);
    line[strcspn(line, "\r\n")] = '\0';
    return read && (text == NULL || strcmp(line, text) == 0);
}

static bool is_asked_rightly(const char *name, fmi2Type type, const char *guid,
                             const char *location, er_failure *failure)
{
    if (!er_is_utf8(name))
        return er_fail(failure, "instance name: expected UTF-8, got other bytes");
    if (type != fmi2CoSimulation)
        return er_fail(failure, "model exchange is asked for; this FMU does co-simulation only");
    if (!has(location, SLAVE_FILE, NULL))
        return er_fail(failure, "resources: expected the file: URI of a folder with " SLAVE_FILE
                       ", got '%.700s'", location != NULL ? location : "");
    if (strstr(location, "%2520") != NULL) /* PythonFMU decodes once more */
        return er_fail(failure, "resources: expected a folder without %%20 in its name, got '%.700s'",
                       location);
    if (guid == NULL || !has(location, GUID_FILE, guid))
        return er_fail(failure, "GUID: expected that of modelDescription.xml, got '%.100s'",
                       guid != NULL ? guid : "");
    return true;
}

/* Says why there is no instance: to stderr, as the log may be off, and to the log. */
static fmi2Component give_up(er_component *c, fmi2Status status)
{
    fprintf(stderr, "%s: %s\n", c->name, c->cause.text);
    fflush(stderr);
    er_component_tell(c, status, c->cause.text);
    free(c);
    return NULL;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    er_component *c = create(name, functions);
    char *folder = NULL;
    if (c == NULL)
        return NULL;
    c->log = ER_LOG_ALL; /* the reason of a failure is told in any case */
    c->functions = inner_functions(&c->cause);
    if (c->functions == NULL)
        return give_up(c, fmi2Fatal);
    if (is_asked_rightly(c->name, type, guid, location, &c->cause))
        folder = er_path_from_uri(location, ""); /* PythonFMU takes a path as well */
    if (folder != NULL && !er_is_utf8(folder)) {
        free(folder);
        folder = NULL;
        er_fail(&c->cause, "resources: expected a folder whose name is UTF-8, got other bytes");
    }
    if (folder == NULL)
        return give_up(c, fmi2Error);
    folder[strlen(folder) - 1] = '\0';
    /* With its log on, so that the reason of a failure is known, now and later. */
    c->inner = c->functions->fmi2Instantiate(c->name, type, guid, folder, &c->relayed, visible,
                                             fmi2True);
    free(folder);
    if (c->inner == NULL) {
        er_component_tell(c, fmi2Error, c->cause.text); /* the slave has written it to stderr */
        free(c);
        return NULL;
    }
    c->log = logging != fmi2False ? ER_LOG_ALL : 0;
    return c;
}

void fmi2FreeInstance(fmi2Component instance)
{
    er_component *c = instance;
    if (c == NULL)
        return;
    if (!c->lost) /* else PythonFMU would free again what it freed then */
        c->functions->fmi2FreeInstance(c->inner);
    free(c);
}
