/* Sentences that say what is wrong; files: where they are, their content, whether their names are texts, and a
 * hash of bytes.
 *
 * A function that can fail returns false and leaves one sentence in the er_failure it was given: where, what was
 * expected and what was got.
 */
#ifndef ER_FILE_H
#define ER_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define ER_FAILURE_TEXT 1600

typedef struct {
    bool may_retry; /* another value, step or state may do */
    char text[ER_FAILURE_TEXT];
} er_failure;

/* Writes the sentence (as printf does, cut to the buffer) and returns false. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
bool er_fail(er_failure *failure, const char *format, ...);

/* Marks a failure that leaves all as it was as one that another value, step or state may avoid; false. */
static inline bool er_let_retry(er_failure *failure)
{
    failure->may_retry = true;
    return false;
}

#define ER_ESCAPED_TEXT (2 * ER_FAILURE_TEXT)

/* The text with some characters doubled, cut to the buffer. */
void er_escape(const char *text, const char *doubled, char escaped[ER_ESCAPED_TEXT]);

#define ER_NUMBER_TEXT 32

/* A number as Python shows it: 1.0, -1e-09, nan. */
const char *er_shown(double value, char text[ER_NUMBER_TEXT]);

/* A larger file is refused [bytes]. */
#define ER_MOST_BYTES (UINT64_C(1) << 30)

/* Whether there is something of a name in UTF-8, a file or else. */
bool er_exists(const char *path);

/* Returns the content of a file, its name in UTF-8, with a zero byte behind it, to be freed; NULL with the
 * reason if there is none. */
char *er_read_file(const char *path, size_t *size, er_failure *failure);

/* The folder that a file: URI names, to be freed; NULL if it is not such a URI.  Those of Windows name a drive,
 * file:///C:/folder, also file://C:/folder and with %3A, or a share, file://server/share; elsewhere hosts do not
 * count. */
char *er_folder_from_uri(const char *uri, bool windows);

/* Path of a file in it, on this system. */
char *er_path_from_uri(const char *uri, const char *file);

/* The same of a folder's own path; NULL if memory is short. */
char *er_path_in_folder(const char *folder, const char *file);

/* Whether a text is UTF-8: no byte astray, nothing longer than needed, no surrogate, at most U+10FFFF. */
bool er_is_utf8(const char *text);

/* FNV-1a, 64 bits: tells data apart that differ by accident. */
#define ER_HASH_START UINT64_C(14695981039346656037)
#define ER_HASH_FACTOR UINT64_C(1099511628211)

static inline uint64_t er_hash(const void *data, size_t size)
{
    const unsigned char *bytes = data;
    uint64_t hash = ER_HASH_START;
    for (size_t k = 0; k < size; k++)
        hash = (hash ^ bytes[k]) * ER_HASH_FACTOR;
    return hash;
}

/* CRC-32 of some bytes, as zip archives have it. */
uint32_t er_checksum(const unsigned char *bytes, size_t size);

#endif
