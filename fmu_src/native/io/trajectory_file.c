/* A trajectory from a table in a file: columns time, q1.., qd1.., qdd1.. by name. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "table_file.h"
#include "../core/trajectory.h"

static bool missing_column(const er_data_table *table, const char *name, er_failure *failure)
{
    char names[400] = "";
    size_t length = 0;
    for (int k = 0; k < table->columns && length + ER_MAX_NAME + 2 < sizeof names; k++)
        length += (size_t)snprintf(names + length, sizeof names - length, "%s%s",
                                   k > 0 ? ", " : "", table->name[k]);
    return er_fail(failure, "expected one column '%s', got %s", name, names);
}

/* The column of a name; refuses none and several. */
static bool find_column(const er_data_table *table, const char *name, int *column, er_failure *failure)
{
    int count;
    *column = er_table_column(table, name, &count);
    return count == 1 || missing_column(table, name, failure);
}

/* Finds PREFIX1.. PREFIXn; *found is false where none of them is there. */
static bool find_block(const er_data_table *table, const char *prefix, int joints, int *column,
                       bool *found, er_failure *failure)
{
    char name[16];
    int count;
    *found = false;
    for (int i = 0; i < joints; i++) {
        snprintf(name, sizeof name, "%s%d", prefix, i + 1);
        *found |= er_table_column(table, name, &count) >= 0;
    }
    for (int i = 0; i < joints && *found; i++) {
        snprintf(name, sizeof name, "%s%d", prefix, i + 1);
        if (!find_column(table, name, &column[i], failure))
            return false;
    }
    return true;
}

/* Puts the wanted columns side by side, over the table's own numbers, which are the samples' then. */
static bool choose(er_data_table *table, int joints, er_samples *samples, er_failure *failure)
{
    int column[1 + 3 * ER_MAX_JOINTS], width;
    bool q, qd, qdd, there;
    if (!find_column(table, "time", &column[0], failure) ||
        !find_block(table, "q", joints, column + 1, &q, failure))
        return false;
    if (!q)
        return missing_column(table, "q1", failure);
    if (!find_block(table, "qd", joints, column + 1 + joints, &qd, failure) ||
        !find_block(table, "qdd", joints, column + 1 + 2 * joints, &qdd, failure))
        return false;
    if (qd != qdd)
        return er_fail(failure, "expected qd and qdd, or none of them, got %s alone",
                       qd ? "qd" : "qdd");
    width = 1 + joints * (qd ? 3 : 1);
    there = width == table->columns;
    for (int c = 0; c < width; c++)
        there &= column[c] == c;
    for (size_t k = 0; !there && k < table->rows; k++) {
        double row[ER_MAX_TABLE_COLUMNS];
        memcpy(row, table->data + k * (size_t)table->columns,
               (size_t)table->columns * sizeof *row);
        for (int c = 0; c < width; c++)
            table->data[k * (size_t)width + (size_t)c] = row[column[c]];
    }
    *samples = (er_samples){table->rows, joints, qd, table->data};
    table->data = NULL;
    return true;
}

/* Makes the trajectory of a table, and frees that. */
static bool take_table(er_trajectory *trajectory, er_data_table *table, int joints,
                       const er_settings *settings, er_failure *failure)
{
    er_samples samples;
    bool good = choose(table, joints, &samples, failure) &&
                er_trajectory_build(trajectory, &samples, settings, failure);
    er_table_free(table);
    return good;
}

bool er_trajectory_parse(er_trajectory *trajectory, const char *content, size_t size, bool is_npz,
                         int joints, const er_settings *settings, er_failure *failure)
{
    er_data_table *table = malloc(sizeof *table);
    bool good = table != NULL ? er_table_parse(table, content, size, is_npz, failure) &&
                                    take_table(trajectory, table, joints, settings, failure)
                              : er_fail(failure, "it does not fit into memory");
    free(table);
    return good;
}

bool er_trajectory_read(er_trajectory *trajectory, const char *path, int joints,
                        const er_settings *settings, er_failure *failure)
{
    er_data_table *table = malloc(sizeof *table);
    er_failure inner;
    bool good = table != NULL ? er_table_read(table, path, &inner) &&
                                    take_table(trajectory, table, joints, settings, &inner)
                              : er_fail(&inner, "it does not fit into memory");
    free(table);
    return good || er_fail(failure, "trajectory %.500s: %.1000s", path, inner.text);
}
