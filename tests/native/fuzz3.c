/* Random calls of FMI 3.0 in any order: fuzz3 TOKEN RESOURCES CALLS [SEED].
 *
 * Linked with the FMU's library, so that a sanitizer sees both.  Buffers have the size that is told
 * to the FMU and not a byte more.  Calls out of their time and with wrong arguments are among them: no
 * instance, no arrays, references that do not exist, states that are damaged.  A refused call leaves the
 * serialised state as it was.
 */
#include "fmi3Functions.h"
#include "request.h"

static const char *token, *resources;
static long messages;

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                        fmi3String message)
{
    (void)environment;
    CHECK(category != NULL && strlen(message) > 10);
    if (strcmp(category, "logEvents") == 0) {
        CHECK(status == fmi3OK);
        return;
    }
    CHECK(status == fmi3Error || status == fmi3Discard);
    messages++;
}

static fmi3Instance new_instance(void)
{
    fmi3Instance c = fmi3InstantiateCoSimulation("robot", token, resources, false, true, false, true,
                                                 NULL, 0, NULL, log_message, NULL);
    CHECK(c != NULL);
    return c;
}

typedef struct {
    fmi3Instance c;
    fmi3FMUState state;
    double time;
    long refused, steps;
} session;

/* The bytes of the present state; a state of one's own makes no difference. */
static size_t snapshot(fmi3Instance c, fmi3Byte **bytes)
{
    fmi3FMUState state = NULL;
    size_t size = 0;
    CHECK(fmi3GetFMUState(c, &state) == fmi3OK);
    CHECK(fmi3SerializedFMUStateSize(c, state, &size) == fmi3OK);
    *bytes = malloc(size);
    CHECK(*bytes != NULL && fmi3SerializeFMUState(c, state, *bytes, size) == fmi3OK);
    CHECK(fmi3FreeFMUState(c, &state) == fmi3OK && state == NULL);
    return size;
}

static fmi3Status get(fmi3Instance c)
{
    request r = draw_sized_request(NULL);
    fmi3Status status =
        fmi3GetFloat64(c, draw(40) == 0 ? NULL : r.references, r.count, r.values, r.size);
    for (size_t i = 0; status == fmi3OK && i < r.size && r.count > 0; i++)
        CHECK(isfinite(r.values[i]));
    drop(r);
    return status;
}

static fmi3Status set(fmi3Instance c, const char *causality)
{
    request r = draw_sized_request(causality);
    fmi3Status status =
        fmi3SetFloat64(c, r.references, r.count, draw(40) == 0 ? NULL : r.values, r.size);
    drop(r);
    return status;
}

static fmi3Status give(fmi3Instance c, request r)
{
    fmi3Status status = fmi3SetFloat64(c, r.references, r.count, r.values, r.size);
    drop(r);
    return status;
}

static fmi3Status differentiate(fmi3Instance c)
{
    request unknowns = draw_sized_request("output"), knowns = draw(4) ? draw_sized_request("input") : draw_of_drives();
    fmi3Status status = fmi3GetDirectionalDerivative(c, unknowns.references, unknowns.count,
                                                     knowns.references, knowns.count,
                                                     draw(40) == 0 ? NULL : knowns.values,
                                                     knowns.size, unknowns.values, unknowns.size);
    drop(unknowns);
    drop(knowns);
    return status;
}

static fmi3Status set_strings(fmi3Instance c)
{
    fmi3ValueReference references[3];
    const char *texts[3];
    size_t count = draw(4);
    for (size_t i = 0; i < count; i++) {
        const variable *v = draw_variable(NULL, draw(10) > 0);
        references[i] = v->reference;
        texts[i] = draw(20) == 0 ? NULL : draw_text_for(v->name);
    }
    return fmi3SetString(c, references, count, texts, draw(10) == 0 ? draw(4) : count);
}

static fmi3Status get_string(fmi3Instance c)
{
    fmi3ValueReference reference = draw_variable(NULL, draw(10) > 0)->reference;
    const char *text = "";
    fmi3Status status = fmi3GetString(c, &reference, 1, &text, draw(10) == 0 ? 0 : 1);
    CHECK(status != fmi3OK || strlen(text) < 100000);
    return status;
}

static fmi3Status turn_log(fmi3Instance c)
{
    const char *categories[2] = {draw_category(), draw_category()};
    return fmi3SetDebugLogging(c, draw(8) != 0, draw(3), categories);
}

/* Right or damaged bytes, into a new place or into that of a state that is there. */
static fmi3Status unpack(session *s)
{
    fmi3FMUState other = NULL, *place = draw(2) ? &s->state : &other;
    const fmi3FMUState kept = s->state;
    fmi3Status status;
    size_t size = 0;
    fmi3Byte *bytes;
    if (s->state == NULL || fmi3SerializedFMUStateSize(s->c, s->state, &size) != fmi3OK)
        return fmi3OK;
    bytes = malloc(size);
    CHECK(bytes != NULL && fmi3SerializeFMUState(s->c, s->state, bytes, size) == fmi3OK);
    if (draw(10) == 0)
        CHECK(fmi3SerializeFMUState(s->c, s->state, bytes, size - 1) != fmi3OK);
    switch (draw(4)) {
    case 0:
        bytes[draw((unsigned)size)] ^= (fmi3Byte)(1 + draw(255));
        CHECK((status = fmi3DeserializeFMUState(s->c, bytes, size, place)) != fmi3OK);
        CHECK(s->state == kept && other == NULL);
        break;
    case 1:
        status = fmi3DeserializeFMUState(s->c, bytes, draw((unsigned)size), place);
        CHECK(status != fmi3OK && s->state == kept && other == NULL);
        break;
    default: CHECK((status = fmi3DeserializeFMUState(s->c, bytes, size, place)) == fmi3OK);
    }
    free(bytes);
    fmi3FreeFMUState(s->c, &other);
    return status;
}

static fmi3Status step(session *s)
{
    fmi3Boolean event, terminate, early;
    double last, size = draw_step();
    fmi3Status status = fmi3DoStep(s->c, s->time, size, true, &event, &terminate, &early, &last);
    CHECK(!event && !terminate && !early);
    if (status == fmi3OK) {
        CHECK(fabs(last - (s->time + size)) <= 1e-9);
        s->time = last;
        s->steps++;
    }
    return status;
}

static fmi3Status enter(session *s)
{
    double start = draw_input(), tolerance = draw(2) ? 1e-6 : draw_value();
    fmi3Status status =
        fmi3EnterInitializationMode(s->c, draw(2), tolerance, start, draw(2), draw_value());
    if (status == fmi3OK)
        s->time = start;
    return status;
}

/* What should be refused in every phase, whatever the arguments. */
static fmi3Status misuse(session *s)
{
    fmi3ValueReference reference = draw_reference();
    fmi3Status status = fmi3Error;
    fmi3Boolean flag;
    fmi3Int32 number = 1;
    size_t size = 0;
    double value = 0.0;
    switch (draw(15)) {
    case 0: status = fmi3GetInt32(s->c, &reference, 1, &number, 1); break;
    case 1: status = fmi3SetBoolean(s->c, &reference, 1, &flag, 1); break;
    case 2: status = fmi3GetFMUState(s->c, NULL); break;
    case 3: status = fmi3SetFMUState(s->c, NULL); break;
    case 4: status = fmi3SerializedFMUStateSize(s->c, NULL, &size); break;
    case 5: status = fmi3DeserializeFMUState(s->c, NULL, 100, &s->state); break;
    case 6: status = fmi3DoStep(NULL, s->time, 0.001, true, &flag, &flag, &flag, &value); break;
    case 7: status = fmi3DoStep(s->c, s->time, 0.001, true, NULL, &flag, &flag, &value); break;
    case 8: status = fmi3GetFloat64(NULL, &reference, 1, &value, 1); break;
    case 9: status = fmi3SetFMUState(NULL, s->state); break;
    case 10: status = fmi3Reset(NULL); break;
    case 11: status = fmi3EnterEventMode(s->c); break;
    case 12: status = fmi3UpdateDiscreteStates(s->c, NULL, NULL, NULL, NULL, NULL, NULL); break;
    case 13: status = fmi3GetOutputDerivatives(s->c, &reference, 1, &number, &value, 1); break;
    case 14: fmi3FreeInstance(NULL); break;
    }
    CHECK(status == fmi3Error);
    return status;
}

static fmi3Status call_once(session *s)
{
    fmi3Status status = fmi3OK;
    switch (draw(64)) {
    case 0: return draw(8) == 0 ? set(s->c, NULL) : fmi3OK;
    case 1: case 2: case 3: return set(s->c, "input");
    case 4: case 5: case 6: return get(s->c);
    case 7: return set_strings(s->c);
    case 8: return get_string(s->c);
    case 9: case 10: case 11: return enter(s);
    case 12: case 13: case 14: return fmi3ExitInitializationMode(s->c);
    case 15: return fmi3GetFMUState(s->c, &s->state);
    case 16: return s->state == NULL ? fmi3OK : fmi3SetFMUState(s->c, s->state);
    case 17: case 18: return unpack(s);
    case 19: return fmi3FreeFMUState(s->c, &s->state);
    case 20: return differentiate(s->c);
    case 21: return give(s->c, draw_spring());
    case 22: return turn_log(s->c);
    case 23: case 24: return misuse(s);
    case 25: return draw(10) == 0 ? fmi3Terminate(s->c) : fmi3OK;
    case 26: case 27:
        if (draw(4) == 0 && (status = fmi3Reset(s->c)) == fmi3OK)
            s->time = 0.0;
        return status;
    case 28:
        if (draw(10) == 0) {
            fmi3FreeInstance(s->c);
            s->c = new_instance();
            s->time = 0.0;
        }
        return fmi3OK;
    case 40: case 41: return give(s->c, draw_of_drives());
    default: return step(s);
    }
}

int main(int count, char **arguments)
{
    session s = {NULL, NULL, 0.0, 0, 0};
    long calls;
    CHECK(count >= 4);
    start_draw(count, arguments, 4);
    token = arguments[1];
    resources = arguments[2];
    calls = atol(arguments[3]);
    read_variables(resources);
    CHECK(fmi3InstantiateCoSimulation("robot", token, NULL, false, true, false, false, NULL, 0, NULL,
                                      log_message, NULL) == NULL);
    CHECK(messages == 1);
    s.c = new_instance();
    for (long call = 0; call < calls; call++) {
        fmi3Byte *before = NULL, *after = NULL;
        /* Before every tenth call only, as it costs more than most. */
        size_t size = draw(10) == 0 ? snapshot(s.c, &before) : 0;
        fmi3Status status = call_once(&s);
        s.refused += status == fmi3Error || status == fmi3Discard;
        if (before != NULL && (status == fmi3Error || status == fmi3Discard))
            CHECK(snapshot(s.c, &after) == size && memcmp(before, after, size) == 0);
        free(before);
        free(after);
    }
    fmi3FreeFMUState(s.c, &s.state);
    fmi3FreeInstance(s.c);
    printf("%ld calls, %ld refused, %ld steps\n", calls, s.refused, s.steps);
    return 0;
}
