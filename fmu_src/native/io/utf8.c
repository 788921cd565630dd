#include "utf8.h"

/* Further bytes of a character that begins with this one; -1: none does. */
static int further(unsigned char first)
{
    if (first < 0x80)
        return 0;
    if (first < 0xC2 || first > 0xF4)
        return -1;
    return first < 0xE0 ? 1 : first < 0xF0 ? 2 : 3;
}

bool er_is_utf8(const char *text)
{
    for (const unsigned char *at = (const unsigned char *)text; *at != 0;) {
        unsigned char first = *at++;
        int count = further(first);
        if (count < 0 || (first == 0xE0 && *at < 0xA0) || (first == 0xED && *at > 0x9F) ||
            (first == 0xF0 && *at < 0x90) || (first == 0xF4 && *at > 0x8F))
            return false;
        for (; count > 0; count--, at++)
            if ((*at & 0xC0) != 0x80)
                return false;
    }
    return true;
}
