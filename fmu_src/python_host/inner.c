#include "inner.h"

#include <stdbool.h>
#include <stddef.h>

#include "library.h"
#include "python.h"

/* The same for all instances of this FMU; another FMU has a library, and these, of its own. */
static er_inner functions;
static er_failure failed;
static bool loaded;

static void load(void)
{
    void *library;
    if (!er_start_python(&failed))
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
