#define _GNU_SOURCE /* dladdr, RTLD_DEFAULT, realpath */
#include "component.h"

#include <dlfcn.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Versions of Python 3 that are tried by the name of their library. */
enum { OLDEST = 11, NEWEST = 20 };

static char chosen[PATH_MAX];

void *er_python_function(const char *name)
{
    return dlsym(RTLD_DEFAULT, name);
}

static bool python_is_there(void)
{
    return er_python_function("Py_InitializeEx") != NULL;
}

static bool open_for_all(const char *library, int flags)
{
    return dlopen(library, RTLD_NOW | RTLD_GLOBAL | flags) != NULL && python_is_there();
}

/* By the name under which the loader finds it, or has it already, for this library's user alone. */
static bool open_by_name(int flags)
{
    char library[40];
    for (int minor = NEWEST; minor >= OLDEST; minor--) {
        snprintf(library, sizeof library, "libpython3.%d.so.1.0", minor);
        if (open_for_all(library, flags))
            return true;
    }
    return false;
}

/* The library of a Python program: bin/python3.11, links followed, has lib/libpython3.11.so.1.0. */
static bool open_of_program(const char *program)
{
    char real[PATH_MAX], library[2 * PATH_MAX];
    char *name;
    if (access(program, X_OK) != 0 || realpath(program, real) == NULL)
        return false;
    name = strrchr(real, '/') + 1;
    if (strncmp(name, "python3.", 8) != 0 || atoi(name + 8) < OLDEST)
        return false;
    snprintf(library, sizeof library, "%.*s../lib/lib%s.so.1.0", (int)(name - real), real, name);
    if (!open_for_all(library, 0)) {
        snprintf(library, sizeof library, "lib%s.so.1.0", name);
        if (!open_for_all(library, 0))
            return false;
    }
    snprintf(chosen, sizeof chosen, "%s", program);
    return true;
}

static bool open_of_environment(void)
{
    const char *folder = getenv("VIRTUAL_ENV"), *path = getenv("PATH");
    char program[PATH_MAX];
    if (folder != NULL && *folder != '\0') {
        snprintf(program, sizeof program, "%s/bin/python", folder);
        if (open_of_program(program))
            return true;
    }
    while (path != NULL && *path != '\0') {
        int length = (int)strcspn(path, ":");
        snprintf(program, sizeof program, "%.*s/python3", length, path);
        if (length > 0 && open_of_program(program))
            return true;
        path += length + (path[length] == ':');
    }
    return false;
}

bool er_require_python(const char **program, er_failure *failure)
{
    const char *given = getenv(ER_PYTHON_VARIABLE);
    *program = NULL;
    if (python_is_there() || open_by_name(RTLD_NOLOAD))
        return true;
    if (given != NULL && *given != '\0') {
        if (!open_of_program(given))
            return er_fail(failure,
                           ER_PYTHON_VARIABLE ": expected a Python program, python3.%d or newer, that"
                           " has a shared library (libpython3), got '%.300s'", OLDEST, given);
    } else if (!open_of_environment() && !open_by_name(0)) {
        return er_fail(failure,
                       "expected a Python in this process, or one with a shared library (libpython3) by"
                       " VIRTUAL_ENV or PATH, got none: set " ER_PYTHON_VARIABLE
                       " to the path of a Python program with numpy, scipy and pin");
    }
    if (chosen[0] != '\0')
        *program = chosen;
    return true;
}

void *er_load_inner(er_failure *failure)
{
    Dl_info own;
    char path[PATH_MAX], inner[PATH_MAX + sizeof ER_INNER_SUFFIX];
    char *suffix;
    void *library, (*forget_python)(void);
    if (dladdr((void *)chosen, &own) == 0 || realpath(own.dli_fname, path) == NULL) {
        er_fail(failure, "the folder of the FMU's library is not found");
        return NULL;
    }
    suffix = strrchr(path, '.');
    if (suffix == NULL)
        suffix = path + strlen(path);
    snprintf(inner, sizeof inner, "%.*s" ER_INNER_SUFFIX "%s", (int)(suffix - path), path, suffix);
    library = dlopen(inner, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        er_fail(failure, "PythonFMU's library does not load: %.700s", dlerror());
        return NULL;
    }
    /* When the process ends this library lets go of what it holds of Python twice: as its variables are
     * destroyed, and then through a pointer to the freed memory.  Asked to before, it does so once. */
    *(void **)&forget_python = er_function(library, "finalizePythonInterpreter");
    if (forget_python != NULL)
        atexit(forget_python);
    return library;
}

void *er_function(void *library, const char *name)
{
    return dlsym(library, name);
}

void er_once(void (*work)(void))
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, work);
}
