/* Random calls of model exchange in any order: fuzz_exchange TOKEN RESOURCES CALLS [SEED], the resources as
 * the version FMI of the standard wants them named.
 *
 * Linked with the FMU's library, so that a sanitizer sees both.
 */
#if FMI == 2
#include "exchange_fmi2.h"
#else
#include "exchange_fmi3.h"
#endif
#include "session.h"

/* Numbers of states and event indicators, by the names of the variables. */
static void count_states(session *s)
{
    for (unsigned k = 0; k < variable_count; k++) {
        const char *name = variables[k].name;
        if (strncmp(name, "der(", 4) == 0)
            s->states += variables[k].size;
        if (strstr(name, ".bend.") != NULL)
            s->indicators += variables[k].size;
    }
    CHECK(s->states > 0 && s->indicators > 0);
}

static status_of_call set_text(instance c)
{
    const variable *v = draw_variable(NULL, true);
    const char *text = draw_text_for(v->name);
    return SET_TEXTS(c, &v->reference, 1, &text, 1);
}

static status_of_call differentiate(instance c)
{
    request unknowns = DRAW_REQUEST(draw(2) ? "output" : "local");
    request knowns = DRAW_REQUEST(draw(3) ? "input" : draw(4) ? "output" : "independent");
    status_of_call status = DERIVE_ALONG(c, unknowns, knowns, knowns.values);
    drop(unknowns);
    drop(knowns);
    return status;
}

/* As many values as there are, or another number; now and then nothing. */
static status_of_call exchange(session *s)
{
    size_t count = draw(10) == 0 ? draw(40) : draw(5) == 0 ? s->indicators : s->states;
    double *values = malloc(count * sizeof *values), *given = draw(40) == 0 ? NULL : values;
    status_of_call status = REFUSED;
    CHECK(values != NULL || count == 0);
    for (size_t k = 0; k < count; k++)
        values[k] = draw(50) == 0 ? draw_value() : 1e-6 * (draw(2000) - 1000.0);
    switch (draw(6)) {
    case 0: case 1: status = CALL(SetContinuousStates)(s->c, given, count); break;
    case 2: status = CALL(GetContinuousStates)(s->c, given, count); break;
    case 3: status = DERIVATIVES(s->c, given, count); break;
    case 4: status = CALL(GetEventIndicators)(s->c, given, count); break;
    case 5: status = CALL(GetNominalsOfContinuousStates)(s->c, given, count); break;
    }
    s->useful += status == GOOD;
    free(values);
    return status;
}

/* What should be refused in every phase, whatever the arguments. */
static status_of_call misuse(session *s)
{
    double value = 0.0;
    status_of_call status = REFUSED;
    switch (draw(6)) {
    case 0: status = step(s->c); break;
    case 1: status = CALL(SetTime)(NULL, 0.0); break;
    case 2: status = DERIVATIVES(NULL, &value, 1); break;
    case 3: status = CALL(EnterContinuousTimeMode)(NULL); break;
    case 4: status = SAVE(s->c, NULL); break;
    case 5: status = RESTORE(NULL, s->state); break;
    }
    CHECK(status == REFUSED);
    return status;
}

/* The calls with which an integration begins, as far as they are taken. */
static void begin(instance c)
{
    if (draw(4) == 0)
        CALL(Reset)(c);
    set_up(c);
    enter(c);
    CALL(ExitInitializationMode)(c);
    update(c);
    CALL(EnterContinuousTimeMode)(c);
}

static status_of_call call_once(session *s)
{
    switch (draw(48)) {
    case 0: case 1: case 2: return set(s->c, "input");
    case 3: return set(s->c, draw(3) ? "output" : NULL);
    case 4: case 5: case 6: return get(s->c);
    case 7: return set_text(s->c);
    case 8: return draw(2) ? set_up(s->c) : enter(s->c);
    case 9: case 10: return CALL(ExitInitializationMode)(s->c);
    case 11: case 12: return CALL(EnterEventMode)(s->c);
    case 13: case 14: return update(s->c);
    case 15: case 16: return CALL(EnterContinuousTimeMode)(s->c);
    case 17: case 18: return complete(s->c);
    case 19: return CALL(SetTime)(s->c, draw(4) ? 1e-3 * draw(1000) : draw_value());
    case 20: return SAVE(s->c, &s->state);
    case 21: return s->state == NULL ? GOOD : RESTORE(s->c, s->state);
    case 22: case 23: return differentiate(s->c);
    case 24: return draw(40) == 0 ? CALL(Terminate)(s->c) : GOOD;
    case 25:
        if (draw(50) == 0) {
            CALL(FreeInstance)(s->c);
            begin_anew(s);
        }
        return GOOD;
    case 26: case 27: return give(s->c, draw(3) ? draw_spring() : draw_of_drives());
    case 28: return misuse(s);
    case 29: return set_derivative(s->c);
    case 30:
        begin(s->c);
        return GOOD;
    default: return exchange(s);
    }
}

int main(int count, char **arguments)
{
    session s = {0};
    long calls = begin_session(&s, count, arguments);
    count_states(&s);
    begin_anew(&s);
    make_calls(&s, calls, call_once, "exchanged");
    return 0;
}
