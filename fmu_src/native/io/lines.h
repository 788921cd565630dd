/* Words and numbers from text: the robot's data are lines of them. */
#ifndef ER_LINES_H
#define ER_LINES_H

#include "file.h"

/* Reads a decimal number (no hexadecimal one, no nan, no inf) at *cursor and moves it behind.
 * Correctly rounded.  Returns false, with *cursor as it was, where there is none. */
bool er_read_number(const char **cursor, double *value);

#define ER_WORD 80

/* Where a text is read. */
typedef struct {
    const char *at;
    int line; /* from 1 */
    char word[ER_WORD]; /* the last one, cut */
    er_failure *failure;
} er_lines;

/* Starts in front of the first word. */
void er_lines_start(er_lines *lines, const char *text, er_failure *failure);

/* Says where what was got instead of something, and returns false. */
bool er_lines_refuse(er_lines *lines, const char *expected);

/* Reads the line's next word; empty at its end. */
void er_lines_word(er_lines *lines);

/* Refuses another last word than this. */
bool er_lines_key(er_lines *lines, const char *key);

/* Whether no word of the line is left. */
bool er_lines_at_end(er_lines *lines);

/* Reads a word into a text of `size` bytes; refuses a word that is missing or does not fit. */
bool er_lines_text(er_lines *lines, size_t size, char *text, const char *expected);

bool er_lines_numbers(er_lines *lines, int count, double *values);

/* Reads a whole number of a range. */
bool er_lines_count(er_lines *lines, int least, int most, int *count);

/* Goes to the first word of the next line that is not empty; refuses the end of the text, and words
 * that are left in the present line. */
bool er_lines_next(er_lines *lines);

#endif
