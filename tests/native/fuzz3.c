/* Random calls of FMI 3.0 in any order: fuzz3 TOKEN RESOURCES CALLS.
 *
 * Linked with the FMU's sources, so that a sanitizer sees both.  Buffers have the size that is told
 * to the FMU and not a byte more.
 */
#include "draw.h"
#include "fmi3Functions.h"

enum { MOST = 4 };

static const char *token, *resources;
static long messages;

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                        fmi3String message)
{
    (void)environment;
    CHECK(status == fmi3Error && category != NULL && strlen(message) > 10);
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
    fmi3ValueReference references[MOST];
    size_t count, size;
    double *values;
} request;

/* Variables of a causality, or of any; now and then a reference or a size that does not exist. */
static request draw_request(const char *causality)
{
    request r = {{0}, draw(MOST + 1), 0, NULL};
    for (size_t i = 0; i < r.count; i++) {
        const variable *v = draw_variable(causality, false);
        r.references[i] = draw(20) == 0 ? draw(200) : v->reference;
        r.size += v->size;
    }
    if (draw(10) == 0)
        r.size = draw(20);
    r.values = malloc(r.size * sizeof *r.values);
    CHECK(r.values != NULL || r.size == 0);
    for (size_t i = 0; i < r.size; i++)
        r.values[i] = draw_value();
    return r;
}

static void get(fmi3Instance c)
{
    request r = draw_request(NULL);
    if (fmi3GetFloat64(c, r.references, r.count, r.values, r.size) == fmi3OK)
        for (size_t i = 0; i < r.size; i++)
            CHECK(isfinite(r.values[i]));
    free(r.values);
}

static void set(fmi3Instance c, const char *causality)
{
    request r = draw_request(causality);
    fmi3SetFloat64(c, r.references, r.count, r.values, r.size);
    free(r.values);
}

/* A spring as it may be. */
static void set_spring(fmi3Instance c)
{
    fmi3ValueReference reference = named("anchor.stiffness")->reference;
    double entries[6];
    draw_stiffness(entries);
    fmi3SetFloat64(c, &reference, 1, entries, 6);
}

static void differentiate(fmi3Instance c)
{
    request unknowns = draw_request("output"), knowns = draw_request("input");
    fmi3GetDirectionalDerivative(c, unknowns.references, unknowns.count, knowns.references,
                                 knowns.count, knowns.values, knowns.size, unknowns.values,
                                 unknowns.size);
    free(unknowns.values);
    free(knowns.values);
}

static void set_string(fmi3Instance c)
{
    fmi3ValueReference reference = draw_variable(NULL, draw(3) > 0)->reference;
    const char *text = draw_text();
    fmi3SetString(c, &reference, 1, &text, draw(10) != 0);
    fmi3GetString(c, &reference, 1, &text, 1);
}

static void serialise(fmi3Instance c, fmi3FMUState *state)
{
    fmi3Byte *bytes;
    size_t size = 0;
    if (*state == NULL || fmi3SerializedFMUStateSize(c, *state, &size) != fmi3OK)
        return;
    bytes = malloc(size);
    CHECK(bytes != NULL);
    fmi3SerializeFMUState(c, *state, bytes, size);
    if (draw(2))
        bytes[draw((unsigned)size)] ^= (fmi3Byte)draw(256);
    fmi3DeserializeFMUState(c, bytes, size - draw(2), state);
    free(bytes);
}

static double step(fmi3Instance c, double time)
{
    fmi3Boolean event, terminate, early;
    double last, size = draw_step();
    if (fmi3DoStep(c, time, size, true, &event, &terminate, &early, &last) == fmi3OK) {
        CHECK(!event && !terminate && !early && fabs(last - (time + size)) <= 1e-9);
        time = last;
    }
    return time;
}

int main(int count, char **arguments)
{
    long calls;
    fmi3Instance c;
    fmi3FMUState state = NULL;
    double time = 0.0;
    CHECK(count == 4);
    token = arguments[1];
    resources = arguments[2];
    calls = atol(arguments[3]);
    read_variables(resources);
    CHECK(fmi3InstantiateModelExchange("robot", token, resources, false, true, NULL, log_message)
          == NULL);
    CHECK(fmi3InstantiateCoSimulation("robot", token, NULL, false, true, false, false, NULL, 0, NULL,
                                      log_message, NULL) == NULL);
    CHECK(messages == 2);
    c = new_instance();
    for (long call = 0; call < calls; call++)
        switch (draw(32)) {
        case 0: case 1: case 2: set(c, "input"); break;
        case 3: set(c, NULL); break;
        case 4: case 5: case 6: get(c); break;
        case 7: set_string(c); break;
        case 8:
            fmi3EnterInitializationMode(c, draw(2), draw_value(), time = draw_value(), false, 0.0);
            break;
        case 9: case 10: fmi3ExitInitializationMode(c); break;
        case 11: fmi3GetFMUState(c, &state); break;
        case 12: fmi3SetFMUState(c, state); break;
        case 13: serialise(c, &state); break;
        case 14: differentiate(c); break;
        case 15: fmi3FreeFMUState(c, &state); break;
        case 21: case 22: set_spring(c); break;
        case 16: fmi3UpdateDiscreteStates(c, NULL, NULL, NULL, NULL, NULL, NULL); break;
        case 17: {
            fmi3ValueReference reference = 0;
            CHECK(fmi3GetInt32(c, &reference, 1, NULL, 0) == fmi3Error);
            break;
        }
        case 20:
            if (draw(20) == 0)
                fmi3Terminate(c);
            break;
        case 18:
            if (draw(20) == 0) {
                fmi3Reset(c);
                time = 0.0;
            }
            break;
        case 19:
            if (draw(50) == 0) {
                fmi3FreeInstance(c);
                c = new_instance();
                time = 0.0;
            }
            break;
        default: time = step(c, time);
        }
    fmi3FreeFMUState(c, &state);
    fmi3FreeInstance(c);
    printf("%ld calls, %ld messages\n", calls, messages);
    return 0;
}
