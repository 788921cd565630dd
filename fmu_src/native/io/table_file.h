/* Tables of numbers with named columns: CSV with a header line, or NumPy's NPZ. */
#ifndef ER_TABLE_FILE_H
#define ER_TABLE_FILE_H

#include <stddef.h>
#include <stdint.h>

#include "file.h"

#define ER_MAX_TABLE_COLUMNS 256
#define ER_MAX_NAME 32

typedef struct {
    size_t rows;
    int columns;
    char name[ER_MAX_TABLE_COLUMNS][ER_MAX_NAME];
    double *data; /* by rows */
} er_data_table;

/* Reads a file; the failure says what was expected and got, but not in which file.  What is read and what is
 * refused is one list, docs/fmu.md#trajectories, and the same in elastic_robot/table_file.py. */
bool er_table_read(er_data_table *table, const char *path, er_failure *failure);

/* The same of a file's content, with a zero byte behind it.  `is_npz`: its name ends in .npz. */
bool er_table_parse(er_data_table *table, const char *content, size_t size, bool is_npz,
                    er_failure *failure);

/* The same of NPZ: the arrays `columns` (text) and `data` (numbers, two axes) of an archive in memory.
 * `spare`: that memory, where it is from malloc and the table's data may be kept in it, or NULL. */
bool er_npz_parse(er_data_table *table, const unsigned char *archive, size_t size, void *spare,
                  er_failure *failure);

void er_table_free(er_data_table *table);

/* Number of the column with a name, and how many of them there are. */
int er_table_column(const er_data_table *table, const char *name, int *count);

static inline bool er_is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

/* What a message may show of a file that may be anything. */
static inline char er_printable(char c)
{
    return c >= ' ' && c <= '~' ? c : '?';
}

/* Members of a zip archive in memory, stored or deflated (PKWARE, APPNOTE.TXT).
 *
 * The content of one, with its checksum verified; NULL with the reason if it is not there or broken.
 * It lies in the archive, or in `unpacked`, which is to be freed in any case.  Nothing is allocated that
 * the archive's own size does not bear out. */
const unsigned char *er_zip_member(const unsigned char *archive, size_t size, const char *name,
                                   size_t *content_size, unsigned char **unpacked,
                                   er_failure *failure);

/* An unsigned number of some bytes, the least significant first. */
static inline uint64_t er_little(const unsigned char *at, int bytes)
{
    uint64_t value = 0;
    while (bytes-- > 0)
        value = value << 8 | at[bytes];
    return value;
}

#endif
