#include "inner.h"

#include <stdbool.h>
#include <stddef.h>
#include <wchar.h>

#include "library.h"

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

const er_inner *er_inner_functions(er_failure *failure)
{
    er_once(load);
    if (loaded)
        return &functions;
    *failure = failed;
    return NULL;
}
