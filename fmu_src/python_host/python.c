#include "python.h"

#include <stddef.h>
#include <wchar.h>

#include "library.h"

bool er_start_python(er_failure *failure)
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
