/* The variables in modelDescription.xml, for the masters in C. */
#ifndef DESCRIPTION_H
#define DESCRIPTION_H

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                            \
    do {                                                                                            \
        if (!(condition)) {                                                                         \
            fprintf(stderr, "%s, line %d: %s does not hold\n", __FILE__, __LINE__, #condition);     \
            exit(1);                                                                                \
        }                                                                                           \
    } while (0)

/* A variable of any version of FMI; a scalar has one element. */
typedef struct {
    char name[64], causality[16];
    unsigned reference;
    size_t size;
    bool is_string;
} variable;

static variable variables[600];
static unsigned variable_count;

/* Copies an attribute that stands between two places of a text; false if it does not. */
static inline bool attribute(const char *from, const char *to, const char *name, char *value, size_t room)
{
    char wanted[32];
    const char *at;
    size_t length;
    snprintf(wanted, sizeof wanted, " %s=\"", name);
    at = strstr(from, wanted);
    if (at == NULL || at >= to)
        return false;
    at += strlen(wanted);
    length = strcspn(at, "\"");
    CHECK(length < room);
    memcpy(value, at, length);
    value[length] = '\0';
    return true;
}

static inline bool stands_between(const char *from, const char *to, const char *what)
{
    const char *at = strstr(from, what);
    return at != NULL && at < to;
}

/* Start of the next element that has a value reference, or the end of the text. */
static inline const char *next_variable(const char *from)
{
    const char *at = strstr(from, " valueReference=");
    if (at == NULL)
        return from + strlen(from);
    while (*at != '<')
        at--;
    return at;
}

static inline variable variable_between(const char *from, const char *to)
{
    variable v;
    char number[16];
    CHECK(attribute(from, to, "name", v.name, sizeof v.name));
    CHECK(attribute(from, to, "causality", v.causality, sizeof v.causality));
    CHECK(attribute(from, to, "valueReference", number, sizeof number));
    v.reference = (unsigned)atoi(number);
    v.is_string = stands_between(from, to, "<String");
    v.size = 1;
    if (stands_between(from, to, "<Dimension") &&
        attribute(strstr(from, "<Dimension"), to, "start", number, sizeof number))
        v.size = (size_t)atoi(number);
    return v;
}

/* Reads the description that lies beside a folder of resources, given as a file: URI or a path. */
static inline void read_variables(const char *resources)
{
    static char text[200000];
    char path[1000];
    size_t length;
    const char *from, *to;
    FILE *file;
    snprintf(path, sizeof path, "%s", strncmp(resources, "file://", 7) == 0 ? resources + 7 : resources);
    length = strlen(path) - (path[strlen(path) - 1] == 's' ? 0 : 1); /* or a separator at the end */
    length -= strlen("resources");
    snprintf(path + length, sizeof path - length, "modelDescription.xml");
    file = fopen(path, "rb");
    CHECK(file != NULL && fread(text, 1, sizeof text - 1, file) > 0 && feof(file));
    fclose(file);
    CHECK(strstr(text, "</ModelVariables>") != NULL);
    *strstr(text, "</ModelVariables>") = '\0';
    for (from = next_variable(text); *from != '\0'; from = to) {
        to = next_variable(strstr(from, " valueReference=") + 1);
        CHECK(variable_count < sizeof variables / sizeof *variables);
        variables[variable_count++] = variable_between(from, to);
    }
}

#endif
