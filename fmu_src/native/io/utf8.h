/* Texts as Python takes them. */
#ifndef ER_UTF8_H
#define ER_UTF8_H

#include <stdbool.h>

/* Whether a text is UTF-8: no byte astray, nothing longer than needed, no surrogate, at most U+10FFFF. */
bool er_is_utf8(const char *text);

#endif
