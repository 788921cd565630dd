/* Categories of log messages, as modelDescription.xml lists them. */
#ifndef ER_LOG_CATEGORIES_H
#define ER_LOG_CATEGORIES_H

#include <stddef.h>
#include <string.h>

#define ER_LOG_ERROR "logStatusError"
#define ER_LOG_FATAL "logStatusFatal"
#define ER_LOG_ALL "logAll"

/* What a list of categories asks for. */
typedef enum {
    ER_LOG_UNKNOWN, /* one that does not exist */
    ER_LOG_OTHERS,  /* none of those that this FMU's messages have */
    ER_LOG_OURS     /* that of the errors, or all */
} er_log_choice;

/* Without categories, all are asked for. */
static inline er_log_choice er_log_chosen(const char *const *categories, size_t count)
{
    static const char *const others[] = {"logStatusWarning", "logStatusDiscard", ER_LOG_FATAL};
    er_log_choice choice = count == 0 ? ER_LOG_OURS : ER_LOG_OTHERS;
    for (size_t i = 0; i < count; i++) {
        const char *name = categories == NULL || categories[i] == NULL ? "" : categories[i];
        int known = 0;
        for (size_t k = 0; k < sizeof others / sizeof *others; k++)
            known |= strcmp(name, others[k]) == 0;
        if (strcmp(name, ER_LOG_ERROR) == 0 || strcmp(name, ER_LOG_ALL) == 0)
            choice = ER_LOG_OURS;
        else if (!known)
            return ER_LOG_UNKNOWN;
    }
    return choice;
}

#define ER_LOG_REFUSAL                                                                              \
    "log categories: expected logStatusWarning, logStatusDiscard, " ER_LOG_ERROR ", " ER_LOG_FATAL  \
    " or " ER_LOG_ALL ", got another name"

#endif
