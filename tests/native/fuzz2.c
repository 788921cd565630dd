/* Random calls of FMI 2.0 in any order: fuzz2 LIBRARY GUID RESOURCES-URI CALLS [SEED].
 *
 * Calls out of their time and with wrong arguments are among them: no instance, no arrays, references
 * that do not exist, states that are damaged.  A refused call leaves the serialised state as it was.
 */
#include "master.h"
#include "request.h"

typedef struct {
    fmi2Component c;
    fmi2FMUstate state;
    double time;
    long refused, steps;
} session;

/* The bytes of the present state; a state of one's own makes no difference. */
static size_t snapshot(fmi2Component c, char **bytes)
{
    fmi2FMUstate state = NULL;
    size_t size = 0;
    CHECK(ffmi2GetFMUstate(c, &state) == fmi2OK);
    CHECK(ffmi2SerializedFMUstateSize(c, state, &size) == fmi2OK);
    *bytes = malloc(size);
    CHECK(*bytes != NULL && ffmi2SerializeFMUstate(c, state, *bytes, size) == fmi2OK);
    CHECK(ffmi2FreeFMUstate(c, &state) == fmi2OK && state == NULL);
    return size;
}

static fmi2Status give(fmi2Component c, request r)
{
    fmi2Status status = ffmi2SetReal(c, r.references, r.count, r.values);
    drop(r);
    return status;
}

static fmi2Status set(fmi2Component c, const char *causality)
{
    request r = draw_request(causality);
    fmi2Status status = draw(40) == 0 ? ffmi2SetReal(c, r.references, r.count, NULL)
                                      : ffmi2SetReal(c, r.references, r.count, r.values);
    drop(r);
    return status;
}

static fmi2Status get(fmi2Component c)
{
    request r = draw_request(NULL);
    fmi2Status status = draw(40) == 0 ? ffmi2GetReal(c, NULL, r.count, r.values)
                                      : ffmi2GetReal(c, r.references, r.count, r.values);
    for (size_t i = 0; status == fmi2OK && i < r.count; i++)
        CHECK(isfinite(r.values[i]));
    drop(r);
    return status;
}

static fmi2Status differentiate(fmi2Component c)
{
    request unknowns = draw_request("output"), knowns = draw(4) ? draw_request("input") : draw_of_drives();
    fmi2Status status = ffmi2GetDirectionalDerivative(c, unknowns.references, unknowns.count,
                                                      knowns.references, knowns.count,
                                                      draw(40) == 0 ? NULL : knowns.values,
                                                      unknowns.values);
    drop(unknowns);
    drop(knowns);
    return status;
}

/* First derivatives of inputs; others, and those of other variables, are refused. */
static fmi2Status set_derivatives(fmi2Component c)
{
    request r = draw_request(draw(10) == 0 ? NULL : "input");
    fmi2Integer *orders = malloc(r.count * sizeof *orders);
    fmi2Status status;
    CHECK(orders != NULL || r.count == 0);
    for (size_t i = 0; i < r.count; i++)
        orders[i] = draw_order();
    status = ffmi2SetRealInputDerivatives(c, draw(40) == 0 ? NULL : r.references, r.count,
                                          draw(40) == 0 ? NULL : orders,
                                          draw(40) == 0 ? NULL : r.values);
    for (size_t i = 0; status == fmi2OK && i < r.count; i++)
        CHECK(orders[i] == 1 && isfinite(r.values[i]));
    free(orders);
    drop(r);
    return status;
}

static fmi2Status set_strings(fmi2Component c)
{
    fmi2ValueReference references[3];
    const char *texts[3];
    size_t count = draw(4);
    for (size_t i = 0; i < count; i++) {
        const variable *v = draw_variable(NULL, draw(10) > 0);
        references[i] = v->reference;
        texts[i] = draw(20) == 0 ? NULL : draw_text_for(v->name);
    }
    return ffmi2SetString(c, references, count, texts);
}

static fmi2Status get_strings(fmi2Component c)
{
    fmi2ValueReference reference = draw_variable(NULL, draw(10) > 0)->reference;
    const char *text = "";
    fmi2Status status = ffmi2GetString(c, &reference, draw(2), &text);
    CHECK(status != fmi2OK || strlen(text) < 100000);
    return status;
}

static fmi2Status turn_log(fmi2Component c)
{
    const char *categories[2] = {draw_category(), draw_category()};
    return ffmi2SetDebugLogging(c, draw(8) != 0, draw(3), categories);
}

/* Right or damaged bytes, into a new place or into that of a state that is there. */
static fmi2Status unpack(session *s)
{
    fmi2FMUstate other = NULL, *place = draw(2) ? &s->state : &other;
    const fmi2FMUstate kept = s->state;
    fmi2Status status;
    size_t size = 0;
    char *bytes;
    if (s->state == NULL || ffmi2SerializedFMUstateSize(s->c, s->state, &size) != fmi2OK)
        return fmi2OK;
    bytes = malloc(size + 1);
    CHECK(bytes != NULL && ffmi2SerializeFMUstate(s->c, s->state, bytes, size) == fmi2OK);
    if (draw(10) == 0)
        CHECK(ffmi2SerializeFMUstate(s->c, s->state, bytes, size - 1) != fmi2OK);
    switch (draw(4)) {
    case 0:
        bytes[draw((unsigned)size)] ^= (char)(1 + draw(255));
        CHECK((status = ffmi2DeSerializeFMUstate(s->c, bytes, size, place)) != fmi2OK);
        CHECK(s->state == kept && other == NULL);
        break;
    case 1:
        bytes[size] = 0;
        status = ffmi2DeSerializeFMUstate(s->c, bytes, draw(2) ? size + 1 : draw((unsigned)size), place);
        CHECK(status != fmi2OK && s->state == kept && other == NULL);
        break;
    default: CHECK((status = ffmi2DeSerializeFMUstate(s->c, bytes, size, place)) == fmi2OK);
    }
    free(bytes);
    ffmi2FreeFMUstate(s->c, &other);
    return status;
}

static fmi2Status step(session *s)
{
    double size = draw_step();
    fmi2Status status = ffmi2DoStep(s->c, s->time, size, fmi2True);
    if (status == fmi2OK) {
        s->time += size;
        s->steps++;
    }
    return status;
}

static fmi2Status set_up(session *s)
{
    double start = draw_input(), tolerance = draw(2) ? 1e-6 : draw_value();
    fmi2Status status = ffmi2SetupExperiment(s->c, draw(2), tolerance, start, draw(2), draw_value());
    if (status == fmi2OK)
        s->time = start;
    return status;
}

/* What should be refused in every phase, whatever the arguments. */
static fmi2Status misuse(session *s)
{
    fmi2ValueReference reference = draw_reference();
    fmi2Boolean truth = fmi2True;
    fmi2Integer number = 1;
    fmi2Status status = fmi2Error;
    size_t size = 0;
    double value = 0.0;
    switch (draw(14)) {
    case 0: status = ffmi2GetInteger(s->c, &reference, 1, &number); break;
    case 1: status = ffmi2SetBoolean(s->c, &reference, 1, &truth); break;
    case 2: status = ffmi2GetFMUstate(s->c, NULL); break;
    case 3: status = ffmi2SetFMUstate(s->c, NULL); break;
    case 4: status = ffmi2SerializedFMUstateSize(s->c, NULL, &size); break;
    case 5: status = ffmi2DeSerializeFMUstate(s->c, NULL, 100, &s->state); break;
    case 6: status = ffmi2DoStep(NULL, s->time, 0.001, fmi2True); break;
    case 7: status = ffmi2GetReal(NULL, &reference, 1, &value); break;
    case 8: status = ffmi2SetFMUstate(NULL, s->state); break;
    case 9: status = ffmi2Reset(NULL); break;
    case 10: status = ffmi2CancelStep(s->c); break;
    case 11: status = ffmi2SetRealInputDerivatives(NULL, &reference, 1, &number, &value); break;
    case 12: status = ffmi2GetRealOutputDerivatives(s->c, &reference, 1, &number, &value); break;
    case 13: ffmi2FreeInstance(NULL); break;
    }
    CHECK(status == fmi2Error);
    return status;
}

static fmi2Status call_once(session *s)
{
    fmi2Status status = fmi2OK;
    double value;
    switch (draw(64)) {
    case 0: return draw(8) == 0 ? set(s->c, NULL) : fmi2OK;
    case 1: case 2: case 3: return set(s->c, "input");
    case 4: case 5: case 6: return get(s->c);
    case 7: return set_strings(s->c);
    case 8: return get_strings(s->c);
    case 9: return set_up(s);
    case 10: case 11: case 12: return ffmi2EnterInitializationMode(s->c);
    case 13: case 14: case 15: return ffmi2ExitInitializationMode(s->c);
    case 16: return ffmi2GetFMUstate(s->c, &s->state);
    case 17: return s->state == NULL ? fmi2OK : ffmi2SetFMUstate(s->c, s->state);
    case 18: case 19: return unpack(s);
    case 20: return ffmi2FreeFMUstate(s->c, &s->state);
    case 21: return differentiate(s->c);
    case 22: return give(s->c, draw_spring());
    case 23: return turn_log(s->c);
    case 24: case 25: return misuse(s);
    case 26: return ffmi2GetRealStatus(s->c, draw(4), &value);
    case 27: return draw(10) == 0 ? ffmi2Terminate(s->c) : fmi2OK;
    case 28: case 29:
        if (draw(4) == 0 && (status = ffmi2Reset(s->c)) == fmi2OK)
            s->time = 0.0;
        return status;
    case 30:
        if (draw(10) == 0) {
            ffmi2FreeInstance(s->c);
            s->c = new_instance();
            s->time = 0.0;
        }
        return fmi2OK;
    case 31: case 32: return set_derivatives(s->c);
    case 33: case 34: return give(s->c, draw_of_drives());
    default: return step(s);
    }
}

int main(int count, char **arguments)
{
    session s = {NULL, NULL, 0.0, 0, 0};
    long calls;
    start_master(count, arguments);
    start_draw(count, arguments, 5);
    s.c = new_instance();
    calls = atol(arguments[4]);
    for (long call = 0; call < calls; call++) {
        char *before = NULL, *after = NULL;
        /* Before every tenth call only, as it costs more than most. */
        size_t size = draw(10) == 0 ? snapshot(s.c, &before) : 0;
        fmi2Status status = call_once(&s);
        s.refused += status == fmi2Error || status == fmi2Discard;
        if (before != NULL && (status == fmi2Error || status == fmi2Discard))
            CHECK(snapshot(s.c, &after) == size && memcmp(before, after, size) == 0);
        free(before);
        free(after);
    }
    ffmi2FreeFMUstate(s.c, &s.state);
    ffmi2FreeInstance(s.c);
    printf("%ld calls, %ld refused, %ld steps\n", calls, s.refused, s.steps);
    return 0;
}
