#define UNICODE
#include "component.h"

#include <stdio.h>
#include <wchar.h>
#include <windows.h>

enum { OLDEST = 11, NEWEST = 20, LONGEST = 32768 };

/* The part of Python that PythonFMU's library is linked to; it passes on to python311.dll and its like. */
static HMODULE python;

void *er_python_function(const char *name)
{
    return (void *)GetProcAddress(python, name);
}

void *er_function(void *library, const char *name)
{
    return (void *)GetProcAddress(library, name);
}

/* Puts a name in the place of a path's last one. */
static HMODULE load_beside(wchar_t *path, const wchar_t *name)
{
    wchar_t *last = wcsrchr(path, L'\\');
    if (last == NULL || (size_t)(last - path) + wcslen(name) + 2 > LONGEST)
        return NULL;
    wcscpy(last + 1, name);
    return LoadLibraryExW(path, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
}

bool er_require_python(const char **program, er_failure *failure)
{
    static wchar_t path[LONGEST];
    wchar_t name[20];
    *program = NULL; /* Python finds its folder from that of its library */
    for (int minor = NEWEST; python == NULL && minor >= OLDEST; minor--) {
        HMODULE there;
        swprintf(name, 20, L"python3%d.dll", minor);
        there = GetModuleHandleW(name);
        if (there != NULL && GetModuleFileNameW(there, path, LONGEST) > 0)
            python = load_beside(path, L"python3.dll");
    }
    if (python == NULL && GetEnvironmentVariableW(L"" ER_PYTHON_VARIABLE, path, LONGEST) > 0) {
        python = load_beside(path, L"python3.dll");
        if (python == NULL)
            return er_fail(failure, ER_PYTHON_VARIABLE ": expected the full path of a Python program"
                           " with python3.dll beside it, version 3.%d or newer, got '%.300ls'", OLDEST,
                           path);
    }
    if (python == NULL)
        python = LoadLibraryW(L"python3.dll");
    if (python == NULL)
        return er_fail(failure, "expected a Python in this process or python3.dll on its PATH, got neither:"
                       " set " ER_PYTHON_VARIABLE " to the path of a python.exe with numpy, scipy and"
                       " pinocchio");
    return true;
}

void *er_load_inner(er_failure *failure)
{
    static wchar_t path[LONGEST], name[LONGEST];
    HMODULE own, library = NULL;
    if (GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS |
                               GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
                           (LPCWSTR)&python, &own) &&
        GetModuleFileNameW(own, path, LONGEST) > 0) {
        const wchar_t *last = wcsrchr(path, L'\\'), *suffix = wcsrchr(path, L'.');
        if (last != NULL && suffix > last) {
            swprintf(name, LONGEST, L"%.*ls" ER_INNER_SUFFIX L"%ls", (int)(suffix - last - 1), last + 1,
                     suffix);
            library = load_beside(path, name);
        }
    }
    if (library == NULL)
        er_fail(failure, "PythonFMU's library, '%.700ls', does not load: error %lu of Windows", path,
                GetLastError());
    return library;
}

static BOOL CALLBACK run(INIT_ONCE *once, void *work, void **context)
{
    (void)once;
    (void)context;
    (*(void (**)(void))work)();
    return TRUE;
}

void er_once(void (*work)(void))
{
    static INIT_ONCE once = INIT_ONCE_STATIC_INIT;
    InitOnceExecuteOnce(&once, run, &work, NULL);
}
