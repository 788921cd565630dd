#include "uri.h"

#include <stdlib.h>
#include <string.h>

static int hex(char c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                          : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                                                 : -1;
}

char *er_path_in_folder(const char *folder, const char *file)
{
    size_t length = strlen(folder);
    char *path = malloc(length + strlen(file) + 2);
    if (path == NULL)
        return NULL;
    memcpy(path, folder, length);
    if (length > 0 && path[length - 1] != '/')
        path[length++] = '/';
    strcpy(path + length, file);
    return path;
}

/* file:///path, file://host/path or file:/path, with %xx for bytes; on Windows file:///C:/path. */
char *er_path_from_uri(const char *uri, const char *file)
{
    size_t length = 0;
    char *folder, *path;
    if (uri == NULL || strncmp(uri, "file:", 5) != 0)
        return NULL;
    uri += 5;
    if (uri[0] == '/' && uri[1] == '/') {
        uri += 2;
        while (*uri != '/' && *uri != '\0')
            uri++;
    }
#if defined(_WIN32)
    if (uri[0] == '/' && uri[1] != '\0' && uri[2] == ':')
        uri++;
#endif
    folder = malloc(strlen(uri) + 1);
    if (folder == NULL)
        return NULL;
    for (; *uri != '\0'; uri++) {
        if (uri[0] == '%' && hex(uri[1]) >= 0 && hex(uri[2]) >= 0) {
            folder[length++] = (char)(16 * hex(uri[1]) + hex(uri[2]));
            uri += 2;
        } else {
            folder[length++] = *uri;
        }
    }
    folder[length] = '\0';
    path = er_path_in_folder(folder, file);
    free(folder);
    return path;
}
