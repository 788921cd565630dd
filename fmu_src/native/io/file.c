#include "file.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
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

static bool widen_path(const char *path, wchar_t wide[4096])
{
    if (MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, 4096) != 0)
        return true;
    errno = ENOENT;
    return false;
}

static bool look_up(const char *path, file_state *state)
{
    wchar_t wide[4096];
    return widen_path(path, wide) && _wstat64(wide, state) == 0;
}

static FILE *open_file(const char *path)
{
    wchar_t wide[4096];
    return widen_path(path, wide) ? _wfopen(wide, L"rb") : NULL;
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

bool er_fail(er_failure *failure, const char *format, ...)
{
    va_list arguments;
    failure->may_retry = false;
    va_start(arguments, format);
    vsnprintf(failure->text, sizeof failure->text, format, arguments);
    va_end(arguments);
    return false;
}

const char *er_shown(double value, char text[ER_NUMBER_TEXT])
{
    snprintf(text, ER_NUMBER_TEXT, "%.12g", isnan(value) ? fabs(value) : value);
    if (isfinite(value) && strpbrk(text, ".,e") == NULL)
        strcat(text, ".0");
    return text;
}

void er_escape(const char *text, const char *doubled, char escaped[ER_ESCAPED_TEXT])
{
    size_t length = 0;
    for (; *text != '\0' && length + 3 < ER_ESCAPED_TEXT; text++) {
        if (strchr(doubled, *text) != NULL)
            escaped[length++] = *text;
        escaped[length++] = *text;
    }
    escaped[length] = '\0';
}

bool er_exists(const char *path)
{
    file_state state;
    return look_up(path, &state);
}

static bool fail_to_read(er_failure *failure)
{
    return errno == ENOENT ? er_fail(failure, "does not exist")
                           : er_fail(failure, "cannot be read: %s", strerror(errno));
}

/* Refuses what is no file, as opening a pipe could wait for ever, and what is too large. */
static bool find_size(const char *path, uint64_t *size, er_failure *failure)
{
    file_state state;
    if (!look_up(path, &state))
        return fail_to_read(failure);
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
        fail_to_read(failure);
        return NULL;
    }
    *size = fread(content, 1, (size_t)room, file);
    content[*size] = '\0';
    good = !ferror(file) || fail_to_read(failure);
    fclose(file);
    if (good)
        return content;
    free(content);
    return NULL;
}

static int hex_digit(char c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                        : c >= 'A' && c <= 'F'   ? c - 'A' + 10
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

/* Turns %xx into bytes. */
static void decode_percent(char *text)
{
    char *to = text;
    for (const char *from = text; *from != '\0'; to++) {
        bool coded = from[0] == '%' && hex_digit(from[1]) >= 0 && hex_digit(from[2]) >= 0;
        *to = coded ? (char)(16 * hex_digit(from[1]) + hex_digit(from[2])) : *from;
        from += coded ? 3 : 1;
    }
    *to = '\0';
}

/* Whether a path of Windows begins with a drive, C: */
static bool has_drive(const char *path)
{
    return ((path[0] >= 'A' && path[0] <= 'Z') || (path[0] >= 'a' && path[0] <= 'z')) && path[1] == ':';
}

char *er_folder_from_uri(const char *uri, bool windows)
{
    char *text, *path;
    if (uri == NULL || strncmp(uri, "file:", 5) != 0)
        return NULL;
    text = malloc(strlen(uri) + 1);
    if (text == NULL)
        return NULL;
    path = strcpy(text, uri + 5);
    decode_percent(text);
    if (path[0] == '/' && path[1] == '/') {
        const size_t host = strcspn(path + 2, "/");
        const bool is_share = host > 0 && strncmp(path + 2, "localhost/", 10) != 0;
        if (windows && has_drive(path + 2))
            path += 2;
        else if (!(windows && is_share))
            path += 2 + host;
    }
    if (windows && path[0] == '/' && has_drive(path + 1))
        path++;
    memmove(text, path, strlen(path) + 1);
    return text;
}

char *er_path_from_uri(const char *uri, const char *file)
{
#if defined(_WIN32)
    char *folder = er_folder_from_uri(uri, true);
#else
    char *folder = er_folder_from_uri(uri, false);
#endif
    char *path = folder != NULL ? er_path_in_folder(folder, file) : NULL;
    free(folder);
    return path;
}

/* Further bytes of a character that begins with this one; -1: none does. */
static int further_bytes(unsigned char first)
{
    if (first < 0x80)
        return 0;
    if (first < 0xC2 || first > 0xF4)
        return -1;
    return first < 0xE0 ? 1 : first < 0xF0 ? 2
                                           : 3;
}

bool er_is_utf8(const char *text)
{
    for (const unsigned char *at = (const unsigned char *)text; *at != 0;) {
        unsigned char first = *at++;
        int count = further_bytes(first);
        if (count < 0 || (first == 0xE0 && *at < 0xA0) || (first == 0xED && *at > 0x9F) ||
            (first == 0xF0 && *at < 0x90) || (first == 0xF4 && *at > 0x8F))
            return false;
        for (; count > 0; count--, at++)
            if ((*at & 0xC0) != 0x80)
                return false;
    }
    return true;
}

/* Sixteen bytes at a time: table k tells what a byte does k bytes further on. */
uint32_t er_checksum(const unsigned char *bytes, size_t size)
{
    enum { SPAN = 16 };
    uint32_t table[SPAN][256], value = UINT32_C(0xffffffff);
    for (uint32_t k = 0; k < 256; k++) {
        table[0][k] = k;
        for (int bit = 0; bit < 8; bit++)
            table[0][k] = table[0][k] >> 1 ^ (table[0][k] & 1 ? UINT32_C(0xedb88320) : 0);
    }
    for (int s = 1; s < SPAN; s++)
        for (int k = 0; k < 256; k++)
            table[s][k] = table[s - 1][k] >> 8 ^ table[0][table[s - 1][k] & 255];
    for (; size >= SPAN; size -= SPAN, bytes += SPAN) {
        uint32_t next = 0;
        for (int k = 0; k < 4; k++)
            next ^= table[SPAN - 1 - k][bytes[k] ^ (value >> 8 * k & 255)];
        for (int k = 4; k < SPAN; k++)
            next ^= table[SPAN - 1 - k][bytes[k]];
        value = next;
    }
    for (; size > 0; size--)
        value = value >> 8 ^ table[0][(value ^ *bytes++) & 255];
    return ~value;
}
