/* Random calls of model exchange in any order: fuzz_exchange TOKEN RESOURCES CALLS, the resources as the
 * version FMI of the standard wants them named.
 *
 * Linked with the FMU's sources, so that a sanitizer sees both.  Buffers have the size that is told to
 * the FMU and not a byte more.
 */
#include "draw.h"

enum { MOST = 4 };

static const char *token, *resources;
static long messages;

#if FMI == 2

#include "fmi2Functions.h"

typedef fmi2Component instance;
typedef fmi2FMUstate saved;
#define FMI_OK fmi2OK

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String message, ...)
{
    (void)environment;
    CHECK(name != NULL && category != NULL && status == fmi2Error && strlen(message) > 10);
    messages++;
}

static const fmi2CallbackFunctions callbacks = {log_message, NULL, NULL, NULL, NULL};

static instance create(void)
{
    return fmi2Instantiate("robot", fmi2ModelExchange, token, resources, &callbacks, fmi2False,
                           fmi2True);
}

static void update(instance c)
{
    fmi2EventInfo info;
    if (fmi2NewDiscreteStates(c, &info) == fmi2OK)
        CHECK(!info.newDiscreteStatesNeeded && !info.terminateSimulation &&
              isfinite(info.nextEventTime));
}

static void complete(instance c)
{
    fmi2Boolean event, terminate;
    if (fmi2CompletedIntegratorStep(c, fmi2True, &event, &terminate) == fmi2OK)
        CHECK(!terminate && (event == fmi2False || event == fmi2True));
}

static void enter(instance c)
{
    fmi2SetupExperiment(c, draw(2), draw_value(), 1e-3 * draw(100), fmi2False, 0.0);
    fmi2EnterInitializationMode(c);
}

static void step(instance c)
{
    CHECK(fmi2DoStep(c, 0.0, 1e-3, fmi2True) == fmi2Error);
}

#define SPRING "anchor.kxx"
#define CALL(name) fmi2##name
#define DERIVATIVES fmi2GetDerivatives
#define GET(c, references, count, values, size) fmi2GetReal(c, references, count, values)
#define SET(c, references, count, values, size) fmi2SetReal(c, references, count, values)
#define DERIVE(c, u, nu, k, nk, seed, ns, found, nf) \
    fmi2GetDirectionalDerivative(c, u, nu, k, nk, seed, found)
#define SET_STRING(c, reference, text) fmi2SetString(c, reference, 1, text)
#define SAVE fmi2GetFMUstate
#define RESTORE fmi2SetFMUstate
#define FREE_STATE fmi2FreeFMUstate

#else

#include "fmi3Functions.h"

typedef fmi3Instance instance;
typedef fmi3FMUState saved;
#define FMI_OK fmi3OK

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                        fmi3String message)
{
    (void)environment;
    CHECK(status == fmi3Error && category != NULL && strlen(message) > 10);
    messages++;
}

static instance create(void)
{
    return fmi3InstantiateModelExchange("robot", token, resources, false, true, NULL, log_message);
}

static void update(instance c)
{
    fmi3Boolean needs, terminate, nominals, values, has_next;
    fmi3Float64 next;
    if (fmi3UpdateDiscreteStates(c, &needs, &terminate, &nominals, &values, &has_next, &next) == fmi3OK)
        CHECK(!needs && !terminate && !nominals && !values && isfinite(next));
}

static void complete(instance c)
{
    fmi3Boolean event, terminate;
    if (fmi3CompletedIntegratorStep(c, true, &event, &terminate) == fmi3OK)
        CHECK(!terminate);
}

static void enter(instance c)
{
    fmi3EnterInitializationMode(c, draw(2), draw_value(), 1e-3 * draw(100), false, 0.0);
}

static void step(instance c)
{
    fmi3Boolean event, terminate, early;
    double last;
    CHECK(fmi3DoStep(c, 0.0, 1e-3, true, &event, &terminate, &early, &last) == fmi3Error);
}

#define SPRING "anchor.stiffness"
#define CALL(name) fmi3##name
#define DERIVATIVES fmi3GetContinuousStateDerivatives
#define GET fmi3GetFloat64
#define SET fmi3SetFloat64
#define DERIVE fmi3GetDirectionalDerivative
#define SET_STRING(c, reference, text) fmi3SetString(c, reference, 1, text, 1)
#define SAVE fmi3GetFMUState
#define RESTORE fmi3SetFMUState
#define FREE_STATE fmi3FreeFMUState

#endif

/* Numbers of states and event indicators, by the names of the variables. */
static size_t states, indicators;

static void count_states(void)
{
    for (unsigned k = 0; k < variable_count; k++) {
        const char *name = variables[k].name;
        if (strncmp(name, "der(", 4) == 0)
            states += variables[k].size;
        if (strstr(name, ".bend.") != NULL)
            indicators += variables[k].size;
    }
    CHECK(states > 0 && indicators > 0);
}

/* Variables of a causality, or of any; now and then a reference that does not exist. */
typedef struct {
    unsigned references[MOST];
    size_t count, size;
    double *values;
} request;

static request draw_request(const char *causality)
{
    request r = {{0}, draw(MOST + 1), 0, NULL};
    for (size_t i = 0; i < r.count; i++) {
        const variable *v = draw_variable(causality, false);
        r.references[i] = draw(20) == 0 ? draw(300) : v->reference;
        r.size += v->size;
    }
    r.values = malloc((r.size + 1) * sizeof *r.values);
    CHECK(r.values != NULL);
    for (size_t i = 0; i < r.size; i++)
        r.values[i] = draw_value();
    return r;
}

static void get(instance c)
{
    request r = draw_request(NULL);
    if (GET(c, r.references, r.count, r.values, r.size) == FMI_OK)
        for (size_t i = 0; i < r.size; i++)
            CHECK(isfinite(r.values[i]));
    free(r.values);
}

static void set(instance c, const char *causality)
{
    request r = draw_request(causality);
    SET(c, r.references, r.count, r.values, r.size);
    free(r.values);
}

static void differentiate(instance c)
{
    request unknowns = draw_request(draw(2) ? "output" : "local");
    request knowns = draw_request(draw(3) ? "input" : draw(4) ? "output" : "independent");
    DERIVE(c, unknowns.references, unknowns.count, knowns.references, knowns.count, knowns.values,
           knowns.size, unknowns.values, unknowns.size);
    free(unknowns.values);
    free(knowns.values);
}

/* A spring as it may be. */
static void set_spring(instance c)
{
    unsigned references[6];
    double entries[6];
    draw_stiffness(entries);
    for (unsigned k = 0; k < 6; k++)
        references[k] = named(SPRING)->reference + k;
    SET(c, references, FMI == 2 ? 6 : 1, entries, 6);
}

/* The calls with which an integration begins. */
static void begin(instance c)
{
    enter(c);
    CALL(ExitInitializationMode)(c);
    update(c);
    CALL(EnterContinuousTimeMode)(c);
}

/* As many values as there are, or another number; for one call. */
static double *draw_states(size_t count)
{
    double *values = malloc((count + 1) * sizeof *values);
    CHECK(values != NULL);
    for (size_t k = 0; k < count; k++)
        values[k] = draw(50) == 0 ? draw_value() : 1e-6 * (draw(2000) - 1000.0);
    return values;
}

static void exchange(instance c)
{
    size_t count = draw(10) == 0 ? draw(40) : draw(5) == 0 ? indicators : states;
    double *values = draw_states(count);
    switch (draw(6)) {
    case 0: case 1:
        CALL(EnterContinuousTimeMode)(c);
        CALL(SetContinuousStates)(c, values, count);
        break;
    case 2: CALL(GetContinuousStates)(c, values, count); break;
    case 3: DERIVATIVES(c, values, count); break;
    case 4: CALL(GetEventIndicators)(c, values, count); break;
    case 5: CALL(GetNominalsOfContinuousStates)(c, values, count); break;
    }
    free(values);
}

int main(int count, char **arguments)
{
    long calls;
    instance c;
    saved state = NULL;
    CHECK(count == 4);
    token = arguments[1];
    resources = arguments[2];
    calls = atol(arguments[3]);
    read_variables(resources);
    count_states();
    c = create();
    CHECK(c != NULL);
    for (long call = 0; call < calls; call++)
        switch (draw(36)) {
        case 0: case 1: case 2: set(c, "input"); break;
        case 3: set(c, draw(3) ? "output" : NULL); break;
        case 4: case 5: case 6: get(c); break;
        case 7: {
            unsigned reference = draw_variable(NULL, true)->reference;
            const char *text = draw_text();
            SET_STRING(c, &reference, &text);
            break;
        }
        case 8: enter(c); break;
        case 9: case 10: CALL(ExitInitializationMode)(c); break;
        case 11: case 12: CALL(EnterEventMode)(c); break;
        case 13: case 14: update(c); break;
        case 15: case 16: CALL(EnterContinuousTimeMode)(c); break;
        case 17: case 18: complete(c); break;
        case 19: CALL(SetTime)(c, draw(4) ? 1e-3 * draw(1000) : draw_value()); break;
        case 20: SAVE(c, &state); break;
        case 21:
            if (state != NULL)
                RESTORE(c, state);
            break;
        case 22: case 23: differentiate(c); break;
        case 24:
            if (draw(20) == 0)
                step(c);
            else if (draw(40) == 0)
                CALL(Terminate)(c);
            else if (draw(5) == 0)
                CALL(Reset)(c);
            else
                begin(c);
            break;
        case 25:
            if (draw(50) == 0) {
                CALL(FreeInstance)(c);
                c = create();
                CHECK(c != NULL);
            }
            break;
        case 26: case 27: set_spring(c); break;
        default: exchange(c);
        }
    FREE_STATE(c, &state);
    CALL(FreeInstance)(c);
    printf("%ld calls, %ld messages\n", calls, messages);
    return 0;
}
