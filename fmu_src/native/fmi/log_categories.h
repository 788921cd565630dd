/* Categories of log messages, as modelDescription.xml lists them. */
#ifndef ER_LOG_CATEGORIES_H
#define ER_LOG_CATEGORIES_H

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/* Each is a bit of a set; that of all messages is all of them. */
enum {
    ER_LOG_WARNING = 1,
    ER_LOG_DISCARD = 2,
    ER_LOG_ERROR = 4,
    ER_LOG_FATAL = 8,
    ER_LOG_EVENTS = 16,
    ER_LOG_ALL = ER_LOG_WARNING | ER_LOG_DISCARD | ER_LOG_ERROR | ER_LOG_FATAL | ER_LOG_EVENTS
};

/* The set that a list of names asks for, all without a list; false if one does not exist. */
static inline bool er_log_chosen(const char *const *names, size_t count, unsigned *chosen)
{
    static const struct {
        const char *name;
        unsigned set;
    } categories[] = {{"logStatusWarning", ER_LOG_WARNING}, {"logStatusDiscard", ER_LOG_DISCARD},
                 {"logStatusError", ER_LOG_ERROR},     {"logStatusFatal", ER_LOG_FATAL},
                 {"logEvents", ER_LOG_EVENTS},         {"logAll", ER_LOG_ALL}};
    enum { CATEGORIES = sizeof categories / sizeof *categories };
    *chosen = count == 0 ? ER_LOG_ALL : 0;
    for (size_t i = 0; i < count; i++) {
        const char *name = names == NULL || names[i] == NULL ? "" : names[i];
        size_t k = 0;
        while (k < CATEGORIES && strcmp(name, categories[k].name) != 0)
            k++;
        if (k == CATEGORIES)
            return false;
        *chosen |= categories[k].set;
    }
    return true;
}

static inline const char *er_log_name(unsigned category)
{
    return category == ER_LOG_EVENTS    ? "logEvents"
           : category == ER_LOG_WARNING ? "logStatusWarning"
           : category == ER_LOG_DISCARD ? "logStatusDiscard"
           : category == ER_LOG_FATAL   ? "logStatusFatal"
                                        : "logStatusError";
}

#define ER_LOG_REFUSAL                                                                              \
    "log categories: expected logEvents, logStatusWarning, logStatusDiscard, logStatusError,"       \
    " logStatusFatal or logAll, got another name"

#endif
