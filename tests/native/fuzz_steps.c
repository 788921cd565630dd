/* Random calls of co-simulation in any order: fuzz_steps TOKEN RESOURCES CALLS [SEED], the resources as the
 * version FMI of the standard wants them named.
 *
 * Linked with the FMU's library, so that a sanitizer sees both.  Buffers have the size that is told to the
 * FMU and not a byte more.  Calls out of their time and with wrong arguments are among them: no instance,
 * no arrays, references that do not exist, states that are damaged.
 */
#if FMI == 2
#include "steps_fmi2.h"
#else
#include "steps_fmi3.h"
#endif
#include "session.h"

static status_of_call differentiate(instance c)
{
    request unknowns = DRAW_REQUEST("output");
    request knowns = draw(4) ? DRAW_REQUEST("input") : draw_of_drives();
    status_of_call status =
        DERIVE_ALONG(c, unknowns, knowns, draw(40) == 0 ? NULL : knowns.values);
    drop(unknowns);
    drop(knowns);
    return status;
}

static status_of_call set_strings(instance c)
{
    unsigned references[3];
    const char *texts[3];
    size_t count = draw(4);
    for (size_t i = 0; i < count; i++) {
        const variable *v = draw_variable(NULL, draw(10) > 0);
        references[i] = v->reference;
        texts[i] = draw(20) == 0 ? NULL : draw_text_for(v->name);
    }
    return SET_TEXTS(c, references, count, texts, draw(10) == 0 ? draw(4) : count);
}

static status_of_call get_string(instance c)
{
    unsigned reference = draw_variable(NULL, draw(10) > 0)->reference;
    const char *text = "";
    status_of_call status = GET_TEXTS(c, &reference, 1, &text, draw(10) == 0 ? 0 : 1);
    CHECK(status != GOOD || strlen(text) < 100000);
    return status;
}

static status_of_call turn_log(instance c)
{
    const char *categories[2] = {draw_category(), draw_category()};
    return CALL(SetDebugLogging)(c, draw(8) != 0, draw(3), categories);
}

/* Right or damaged bytes, into a new place or into that of a state that is there. */
static status_of_call unpack(session *s)
{
    saved other = NULL, *place = draw(2) ? &s->state : &other;
    const saved kept = s->state;
    status_of_call status;
    size_t size = 0, room;
    char *bytes;
    if (s->state == NULL || SIZE_OF_STATE(s->c, s->state, &size) != GOOD)
        return GOOD;
    room = size + (draw(8) == 0);
    bytes = malloc(room);
    CHECK(bytes != NULL);
    bytes[room - 1] = 0;
    CHECK(SERIALIZE(s->c, s->state, bytes, size) == GOOD);
    if (draw(10) == 0)
        CHECK(SERIALIZE(s->c, s->state, bytes, size - 1) != GOOD);
    switch (draw(4)) {
    case 0:
        bytes[draw((unsigned)size)] ^= (char)(1 + draw(255));
        CHECK((status = DESERIALIZE(s->c, bytes, size, place)) != GOOD);
        CHECK(s->state == kept && other == NULL);
        break;
    case 1:
        status = DESERIALIZE(s->c, bytes, room > size ? room : draw((unsigned)size), place);
        CHECK(status != GOOD && s->state == kept && other == NULL);
        break;
    default: CHECK((status = DESERIALIZE(s->c, bytes, size, place)) == GOOD);
    }
    free(bytes);
    FREE_STATE(s->c, &other);
    return status;
}

/* What should be refused in every phase, whatever the arguments. */
static status_of_call misuse(session *s)
{
    status_of_call status = REFUSED;
    size_t size = 0;
    switch (draw(14)) {
    case 0: status = SAVE(s->c, NULL); break;
    case 1: status = RESTORE(s->c, NULL); break;
    case 2: status = SIZE_OF_STATE(s->c, NULL, &size); break;
    case 3: status = DESERIALIZE(s->c, NULL, 100, &s->state); break;
    case 4: status = RESTORE(NULL, s->state); break;
    case 5: status = CALL(Reset)(NULL); break;
    case 6: CALL(FreeInstance)(NULL); break;
    default: status = misuse_of_version(s->c, s->time);
    }
    CHECK(status == REFUSED);
    return status;
}

static status_of_call call_once(session *s)
{
    status_of_call status = GOOD;
    double start;
    switch (draw(64)) {
    case 0: return draw(8) == 0 ? set(s->c, NULL) : GOOD;
    case 1: case 2: case 3: return set(s->c, "input");
    case 4: case 5: case 6: return get(s->c);
    case 7: return set_strings(s->c);
    case 8: return get_string(s->c);
    case 9: case 10:
        start = draw_input();
        if ((status = set_up(s->c, start)) == GOOD)
            s->time = start;
        return status;
    case 11: case 12: return enter(s->c);
    case 13: case 14: case 15: return CALL(ExitInitializationMode)(s->c);
    case 16: return SAVE(s->c, &s->state);
    case 17: return s->state == NULL ? GOOD : RESTORE(s->c, s->state);
    case 18: case 19: return unpack(s);
    case 20: return FREE_STATE(s->c, &s->state);
    case 21: return differentiate(s->c);
    case 22: return give(s->c, draw_spring());
    case 23: return turn_log(s->c);
    case 24: case 25: return misuse(s);
    case 26: return draw(10) == 0 ? CALL(Terminate)(s->c) : GOOD;
    case 27: case 28:
        if (draw(4) == 0 && (status = CALL(Reset)(s->c)) == GOOD)
            s->time = 0.0;
        return status;
    case 29:
        if (draw(10) == 0) {
            CALL(FreeInstance)(s->c);
            begin_anew(s);
        }
        return GOOD;
    case 30: case 31: case 32: return call_of_version(s->c);
    case 33: case 34: return give(s->c, draw_of_drives());
    default:
        status = step(s->c, &s->time, draw_step());
        s->useful += status == GOOD;
        return status;
    }
}

int main(int count, char **arguments)
{
    session s = {0};
    long calls = begin_session(&s, count, arguments);
    CHECK(create(s.token, NULL) == NULL && messages == 1);
    begin_anew(&s);
    make_calls(&s, calls, call_once, "steps");
    return 0;
}
