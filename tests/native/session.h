/* A session of random calls of an FMU, of co-simulation or of model exchange: what both have in common.
 *
 * To be included behind the calls of a version.  A refused call leaves the serialised state as it was.
 */
#ifndef SESSION_H
#define SESSION_H

typedef struct {
    const char *token, *resources;
    instance c;
    saved state;
    double time;               /* of co-simulation [s] */
    size_t states, indicators; /* of model exchange */
    long refused, useful;
} session;

/* A new instance in place of none. */
static void begin_anew(session *s)
{
    s->c = create(s->token, s->resources);
    CHECK(s->c != NULL);
    s->time = 0.0;
}

/* The bytes of the present state; a state of one's own makes no difference. */
static size_t snapshot(instance c, char **bytes)
{
    saved state = NULL;
    size_t size = 0;
    CHECK(SAVE(c, &state) == GOOD && SIZE_OF_STATE(c, state, &size) == GOOD);
    *bytes = malloc(size);
    CHECK(*bytes != NULL && SERIALIZE(c, state, *bytes, size) == GOOD);
    CHECK(FREE_STATE(c, &state) == GOOD && state == NULL);
    return size;
}

static status_of_call get(instance c)
{
    request r = DRAW_REQUEST(NULL);
    status_of_call status = GET_BY(c, r, draw(40) == 0 ? NULL : r.references);
    for (size_t i = 0; status == GOOD && r.count > 0 && i < r.size; i++)
        CHECK(isfinite(r.values[i]));
    drop(r);
    return status;
}

static status_of_call set(instance c, const char *causality)
{
    request r = DRAW_REQUEST(causality);
    status_of_call status = SET_TO(c, r, draw(40) == 0 ? NULL : r.values);
    drop(r);
    return status;
}

static status_of_call give(instance c, request r)
{
    status_of_call status = SET_TO(c, r, r.values);
    drop(r);
    return status;
}

/* Begins a session by the words of a program: TOKEN RESOURCES CALLS [SEED]; returns the number of calls. */
static long begin_session(session *s, int count, char **arguments)
{
    CHECK(count >= 4);
    start_draw(count, arguments, 4);
    s->token = arguments[1];
    s->resources = arguments[2];
    read_variables(s->resources);
    return atol(arguments[3]);
}

/* Makes the calls of a session, says how many were of use, and ends it. */
static void make_calls(session *s, long calls, status_of_call (*call_once)(session *), const char *useful)
{
    for (long call = 0; call < calls; call++) {
        char *before = NULL, *after = NULL;
        /* Before every tenth call only, as it costs more than most. */
        size_t size = draw(10) == 0 ? snapshot(s->c, &before) : 0;
        status_of_call status = call_once(s);
        s->refused += status == REFUSED || status == DISCARDED;
        if (before != NULL && (status == REFUSED || status == DISCARDED))
            CHECK(snapshot(s->c, &after) == size && memcmp(before, after, size) == 0);
        free(before);
        free(after);
    }
    FREE_STATE(s->c, &s->state);
    CALL(FreeInstance)(s->c);
    printf("%ld calls, %ld refused, %ld %s\n", calls, s->refused, s->useful, useful);
}

#endif
