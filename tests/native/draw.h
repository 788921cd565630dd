/* What random calls are made of. */
#ifndef DRAW_H
#define DRAW_H

#include <limits.h>
#include <math.h>

#include "description.h"

static unsigned long long drawn = 1;

static inline unsigned draw(unsigned below)
{
    drawn = drawn * 6364136223846793005ULL + 1442695040888963407ULL;
    return (unsigned)(drawn >> 33) % below;
}

/* Other numbers, where a program's last argument is there. */
static inline void start_draw(int count, char **arguments, int place)
{
    if (count > place)
        drawn = (unsigned long long)atol(arguments[place]);
}

static inline double draw_value(void)
{
    static const double odd[] = {0.0, -1.0, 1.0, 1e300, -1e300, 1e-300, 1e7, NAN, INFINITY, -INFINITY};
    return draw(4) == 0 ? odd[draw(10)] : (draw(2000) - 1000.0) * pow(10.0, (int)draw(7) - 4);
}

/* Mostly what a robot may be given: N, rad, rad/s; a wild robot is no fault, but takes its time. */
static inline double draw_input(void)
{
    return draw(16) == 0 ? draw_value() : 1e-3 * (draw(2001) - 1000.0);
}

/* Mostly a short step; a long one of a wild robot is no fault, but takes its time. */
static inline double draw_step(void)
{
    double size = draw(32) == 0 ? draw_value() : 1e-4 * draw(20);
    return size > 1.0 ? -size : size;
}

/* The six entries of a stiffness that a spring may have, of one to three random directions. */
static inline void draw_stiffness(double entries[6])
{
    static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
    for (int k = 0; k < 6; k++)
        entries[k] = 0.0;
    for (unsigned sides = draw(4); sides > 0; sides--) {
        double size = pow(10.0, draw(10)), side[3];
        for (int c = 0; c < 3; c++)
            side[c] = 0.01 * (draw(200) - 100.0);
        for (int k = 0; k < 6; k++)
            entries[k] += size * side[row[k]] * side[column[k]];
    }
}

static inline bool has_variable(const char *name)
{
    for (unsigned k = 0; k < variable_count; k++)
        if (strcmp(variables[k].name, name) == 0)
            return true;
    return false;
}

/* The variable of a name. */
static inline const variable *named(const char *name)
{
    for (unsigned k = 0; k < variable_count; k++)
        if (strcmp(variables[k].name, name) == 0)
            return &variables[k];
    fprintf(stderr, "there is no variable %s\n", name);
    exit(1);
}

/* A value reference, mostly of nothing. */
static inline unsigned draw_reference(void)
{
    static const unsigned odd[] = {1u << 31, ~0u, ~0u - 1, 65536, 255, 256};
    return draw(2) ? draw(200) : odd[draw(6)];
}

/* A value for any string variable. */
static inline const char *draw_text(void)
{
    static const char *const texts[] = {"linear", "backlash", "spline", "quasistatic", "dynamic", "",
                                        "%n%s", "undeflected", "no_such_file.csv", "equilibrium",
                                        "equilibrium_from_below", "equilibrium_from_above", "servo",
                                        "torque", "ideal", "Torque", "servo ",
                                        "\xff\xc3", "Gr\xc3\xb6\xc3\x9f" "e.csv"};
    return texts[draw(19)];
}

/* Mostly a value for a variable with choices that it takes. */
static inline const char *draw_text_for(const char *name)
{
    static const char *const drives[] = {"servo", "servo", "torque", "ideal"};
    static const char *const starts[] = {"equilibrium", "equilibrium_from_below",
                                         "equilibrium_from_above", "undeflected"};
    if (draw(8) == 0)
        return draw_text();
    if (strcmp(name, "drive") == 0)
        return drives[draw(4)];
    return strcmp(name, "initial_state") == 0 ? starts[draw(4)] : draw_text();
}

/* A category of messages, mostly one that there is. */
static inline const char *draw_category(void)
{
    static const char *const names[] = {"logStatusError", "logAll", "logStatusWarning", "events", "",
                                        NULL};
    return names[draw(6)];
}

/* The order of a derivative, mostly the first. */
static inline int draw_order(void)
{
    static const int odd[] = {0, 2, -1, INT_MAX, INT_MIN};
    return draw(16) == 0 ? odd[draw(5)] : 1;
}

/* A variable of a causality, or of any. */
static inline const variable *draw_variable(const char *causality, bool is_string)
{
    for (;;) {
        const variable *v = &variables[draw(variable_count)];
        if ((causality == NULL || strcmp(v->causality, causality) == 0) && v->is_string == is_string)
            return v;
    }
}

#endif
