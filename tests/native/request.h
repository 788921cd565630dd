/* Variables with a value for each of their elements, as random calls of all versions of FMI hand them over.
 *
 * Arrays have the size that is told to the FMU and not a byte more.
 */
#ifndef REQUEST_H
#define REQUEST_H

#include "draw.h"

typedef struct {
    size_t count, size; /* of variables, and of their elements */
    unsigned *references;
    double *values;
} request;

static inline request new_request(size_t count)
{
    request r = {count, 0, malloc(count * sizeof(unsigned)), NULL};
    CHECK(r.references != NULL || count == 0);
    return r;
}

static inline void make_room(request *r)
{
    free(r->values);
    r->values = malloc(r->size * sizeof *r->values);
    CHECK(r->values != NULL || r->size == 0);
}

static inline bool is_of_spring(const variable *v)
{
    return strncmp(v->name, "anchor.k", 8) == 0 || strcmp(v->name, "anchor.stiffness") == 0;
}

/* Variables of a causality, or of any; now and then a reference that does not exist. */
static inline request draw_request(const char *causality)
{
    request r = new_request(draw(8));
    for (size_t i = 0; i < r.count; i++) {
        const variable *v;
        do
            v = draw_variable(causality, false);
        while (is_of_spring(v) && draw(16) != 0); /* six random entries are no spring */
        r.references[i] = draw(20) == 0 ? draw_reference() : v->reference;
        r.size += v->size;
    }
    make_room(&r);
    for (size_t i = 0; i < r.size; i++)
        r.values[i] = causality == NULL ? draw_value() : draw_input();
    return r;
}

static inline bool is_of_drives(const char *name)
{
    size_t length = strlen(name);
    const char *const ends[] = {".friction", ".hysteresis"};
    for (int k = 0; k < 2; k++)
        if (length > strlen(ends[k]) && strcmp(name + length - strlen(ends[k]), ends[k]) == 0)
            return name[0] == 'j'; /* a joint's, where a contact has friction too */
    return strncmp(name, "torque_cmd", 10) == 0;
}

/* A torque of a motor, or a torque at which friction or hysteresis slip, of some 100 N m; none without any. */
static inline request draw_of_drives(void)
{
    const variable *found[sizeof variables / sizeof *variables];
    unsigned count = 0;
    request r;
    for (unsigned k = 0; k < variable_count; k++)
        if (is_of_drives(variables[k].name))
            found[count++] = &variables[k];
    r = new_request(count > 0 ? 1 : 0);
    if (count > 0) {
        const variable *v = found[draw(count)];
        r.references[0] = v->reference;
        r.size = v->size;
    }
    make_room(&r);
    for (size_t i = 0; i < r.size; i++)
        r.values[i] = draw(8) == 0 ? draw_value() : 50.0 * (draw_input() + (draw(2) ? 1.0 : 0.0));
    return r;
}

/* The same where the number of elements is told too; now and then it is another. */
static inline request draw_sized_request(const char *causality)
{
    request r = draw_request(causality);
    if (draw(10) == 0) {
        r.size = draw(20);
        make_room(&r);
        for (size_t i = 0; i < r.size; i++)
            r.values[i] = draw_input();
    }
    return r;
}

/* A spring as it may be; scalars lie behind the first entry. */
static inline request draw_spring(void)
{
    bool is_array = has_variable("anchor.stiffness");
    request r = new_request(is_array ? 1 : 6);
    r.size = 6;
    make_room(&r);
    for (unsigned k = 0; k < r.count; k++)
        r.references[k] = named(is_array ? "anchor.stiffness" : "anchor.kxx")->reference + k;
    draw_stiffness(r.values);
    return r;
}

static inline void drop(request r)
{
    free(r.references);
    free(r.values);
}

#endif
