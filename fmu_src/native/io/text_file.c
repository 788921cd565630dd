#include "text_file.h"

#include <errno.h>
#include <stdlib.h>

#if defined(_WIN32)
#include <wchar.h>
#include <windows.h>

FILE *er_open(const char *path)
{
    wchar_t wide[4096];
    if (MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, 4096) == 0) {
        errno = ENOENT;
        return NULL;
    }
    return _wfopen(wide, L"rb");
}
#else
FILE *er_open(const char *path)
{
    return fopen(path, "rb");
}
#endif

char *er_read_file(const char *path, size_t *size)
{
    FILE *file = er_open(path);
    char *content = NULL, *larger;
    size_t room = 1 << 16, got = 0, more;
    if (file == NULL)
        return NULL;
    for (;;) {
        larger = realloc(content, room + 1);
        if (larger == NULL)
            break;
        content = larger;
        more = fread(content + got, 1, room - got, file);
        got += more;
        if (got < room)
            break;
        room *= 2;
    }
    if (larger == NULL || ferror(file)) {
        free(content);
        content = NULL;
        errno = larger == NULL ? ENOMEM : EIO;
    } else {
        content[got] = '\0';
        *size = got;
    }
    fclose(file);
    return content;
}
