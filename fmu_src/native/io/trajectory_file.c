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
    return er_fail(failure, "expected a column '%s', got %s", name, names);
}

/* Finds PREFIX1.. PREFIXn; *found is false where none of them is there. */
static bool find_block(const er_data_table *table, const char *prefix, int joints, int *column,
                       bool *found, er_failure *failure)
{
    char name[16];
    int have = 0;
    for (int i = 0; i < joints; i++) {
        snprintf(name, sizeof name, "%s%d", prefix, i + 1);
        column[i] = er_table_column(table, name);
        have += column[i] >= 0;
    }
    *found = have > 0;
    for (int i = 0; i < joints && have > 0; i++)
        if (column[i] < 0) {
            snprintf(name, sizeof name, "%s%d", prefix, i + 1);
            return missing_column(table, name, failure);
        }
    return true;
}

/* Puts the wanted columns side by side, over the table's own numbers, which are the samples' then. */
static bool choose(er_data_table *table, int joints, er_samples *samples, er_failure *failure)
{
    int column[1 + 3 * ER_MAX_JOINTS], width;
    bool q, qd, qdd, there;
    column[0] = er_table_column(table, "time");
    if (column[0] < 0)
        return missing_column(table, "time", failure);
    if (!find_block(table, "q", joints, column + 1, &q, failure) ||
        !find_block(table, "qd", joints, column + 1 + joints, &qd, failure) ||
        !find_block(table, "qdd", joints, column + 1 + 2 * joints, &qdd, failure))
        return false;
    if (!q)
        return missing_column(table, "q1", failure);
    if (qd != qdd)
        return er_fail(failure, "expected qd and qdd, or none of them, got %s alone",
                       qd ? "qd" : "qdd");
    width = 1 + joints * (qd ? 3 : 1);
    there = width == table->columns;
    for (int c = 0; c < width; c++)
        there &= column[c] == c;
    for (size_t k = 0; !there && k < table->rows; k++) {
        double row[ER_MAX_COLUMNS];
        memcpy(row, table->data + k * (size_t)table->columns,
               (size_t)table->columns * sizeof *row);
        for (int c = 0; c < width; c++)
            table->data[k * (size_t)width + (size_t)c] = row[column[c]];
    }
    *samples = (er_samples){table->rows, joints, qd, table->data};
    table->data = NULL;
    return true;
}

bool er_trajectory_read(er_trajectory *trajectory, const char *path, int joints, er_failure *failure)
{
    er_data_table *table = malloc(sizeof *table);
    er_samples samples;
    er_failure inner;
    bool good;
    if (table == NULL)
        return er_fail(failure, "trajectory %s does not fit into memory", path);
    good = er_table_read(table, path, &inner);
    if (good) {
        good = choose(table, joints, &samples, &inner) &&
               er_trajectory_build(trajectory, &samples, &inner);
        er_table_free(table);
    }
    free(table);
    return good || er_fail(failure, "trajectory %.500s: %.1000s", path, inner.text);
}
