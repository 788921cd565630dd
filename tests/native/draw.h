/* What random calls are made of. */
#ifndef DRAW_H
#define DRAW_H

#include <math.h>

#include "description.h"

static inline unsigned draw(unsigned below)
{
    static unsigned long long seed = 1;
    seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
    return (unsigned)(seed >> 33) % below;
}

static inline double draw_value(void)
{
    static const double odd[] = {0.0, -1.0, 1.0, 1e300, -1e300, 1e-300, 1e7, NAN, INFINITY, -INFINITY};
    return draw(4) == 0 ? odd[draw(10)] : (draw(2000) - 1000.0) * pow(10.0, (int)draw(7) - 4);
}

/* Mostly a short step; a long one of a wild robot is no fault, but takes its time. */
static inline double draw_step(void)
{
    double size = draw(8) == 0 ? draw_value() : 1e-4 * draw(100);
    return size > 1.0 ? -size : size;
}

/* A value for a string variable. */
static inline const char *draw_text(void)
{
    static const char *const texts[] = {"linear", "backlash", "spline", "quasistatic", "dynamic", "",
                                        "%n%s", "undeflected", "no_such_file.csv"};
    return texts[draw(9)];
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
