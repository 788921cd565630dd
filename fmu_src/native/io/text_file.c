#include "text_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>

#if defined(_WIN32)
#include <wchar.h>
#include <windows.h>

typedef struct _stat64 file_state;
#define IS_FILE(mode) (((mode) & _S_IFMT) == _S_IFREG)
#define IS_FOLDER(mode) (((mode) & _S_IFMT) == _S_IFDIR)

static bool widen(const char *path, wchar_t wide[4096])
{
    if (MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, 4096) != 0)
        return true;
    errno = ENOENT;
    return false;
}

static bool look_up(const char *path, file_state *state)
{
    wchar_t wide[4096];
    return widen(path, wide) && _wstat64(wide, state) == 0;
}

static FILE *open_file(const char *path)
{
    wchar_t wide[4096];
    return widen(path, wide) ? _wfopen(wide, L"rb") : NULL;
}
#else
typedef struct stat file_state;
#define IS_FILE(mode) S_ISREG(mode)
#define IS_FOLDER(mode) S_ISDIR(mode)

static bool look_up(const char *path, file_state *state)
{
    return stat(path, state) == 0;
}

static FILE *open_file(const char *path)
{
    return fopen(path, "rb");
}
#endif

bool er_exists(const char *path)
{
    file_state state;
    return look_up(path, &state);
}

static bool cannot(er_failure *failure)
{
    return errno == ENOENT ? er_fail(failure, "does not exist")
                           : er_fail(failure, "cannot be read: %s", strerror(errno));
}

/* Refuses what is no file, as opening a pipe could wait for ever, and what is too large. */
static bool find_size(const char *path, uint64_t *size, er_failure *failure)
{
    file_state state;
    if (!look_up(path, &state))
        return cannot(failure);
    if (IS_FOLDER(state.st_mode))
        return er_fail(failure, "expected a file, got a folder");
    if (!IS_FILE(state.st_mode))
        return er_fail(failure, "expected a file, got a pipe or device");
    *size = (uint64_t)state.st_size;
    return *size <= ER_MOST_BYTES ||
           er_fail(failure, "expected at most %llu bytes, got %llu", (unsigned long long)ER_MOST_BYTES,
                   (unsigned long long)*size);
}

char *er_read_file(const char *path, size_t *size, er_failure *failure)
{
    uint64_t room = 0;
    char *content;
    FILE *file;
    bool good;
    if (!find_size(path, &room, failure))
        return NULL;
    content = malloc((size_t)room + 1);
    if (content == NULL) {
        er_fail(failure, "does not fit into memory");
        return NULL;
    }
    file = open_file(path);
    if (file == NULL) {
        free(content);
        cannot(failure);
        return NULL;
    }
    *size = fread(content, 1, (size_t)room, file);
    content[*size] = '\0';
    good = !ferror(file) || cannot(failure);
    fclose(file);
    if (good)
        return content;
    free(content);
    return NULL;
}
