#include "saved_state.h"

#include <stdlib.h>
#include <string.h>

#include "../io/file.h"
#include "../core/step/stepper.h"
#include "exchange.h"

/* All that an instance remembers: one flat block. */
typedef struct {
    uint64_t mark;        /* of this format */
    uint64_t fingerprint; /* of the robot */
    er_inputs inputs;
    er_progress progress;
    er_step_start step_start;
    er_exchange exchange;
    er_memory memory;
} saved_state;

/* The same as bytes has a checksum, for another process on the same kind of machine. */
#define SERIALISED_SIZE (sizeof(saved_state) + sizeof(uint64_t))

/* Changes with the layout of saved_state. */
#define STATE_MARK UINT64_C(0x45526f626f74000b)

static void copy_step_start(const er_robot *robot, er_step_start *to, const er_step_start *from)
{
    memcpy(to, from, offsetof(er_step_start, state) + er_state_size(robot));
}

static void save_instance(er_instance *instance, saved_state *saved)
{
    er_exchange_hold(instance); /* as any call that asks for values; what refuses it refuses them */
    saved->mark = STATE_MARK;
    saved->fingerprint = instance->fingerprint;
    saved->inputs = instance->inputs;
    saved->progress = instance->progress;
    copy_step_start(&instance->model->robot, &saved->step_start, er_step_start_of(instance));
    saved->exchange = instance->exchange;
    er_memory_copy(&instance->model->robot, &saved->memory, &instance->model->memory);
}

static const char *kind_of_instance(const er_exchange *exchange)
{
    return exchange->on ? "model exchange" : "co-simulation";
}

static bool require_same_fmu(er_instance *instance, const saved_state *saved)
{
    if (saved->mark != STATE_MARK)
        return er_fail(&instance->failure, "state: expected one that this FMU has saved, got another");
    if (saved->exchange.on != instance->exchange.on)
        return er_fail(&instance->failure, "state: expected one of %s, got one of %s",
                       kind_of_instance(&instance->exchange), kind_of_instance(&saved->exchange));
    return saved->fingerprint == instance->fingerprint ||
           er_fail(&instance->failure, "state: expected one with fingerprint %016llx, of the same robot, got %016llx",
                   (unsigned long long)instance->fingerprint, (unsigned long long)saved->fingerprint);
}

static bool restore_instance(er_instance *instance, const saved_state *saved)
{
    if (!require_same_fmu(instance, saved))
        return false;
    if (!er_model_restore(instance->model, &saved->memory, saved->progress.computed, &instance->failure))
        return false;
    instance->inputs = saved->inputs;
    instance->progress = saved->progress;
    copy_step_start(&instance->model->robot, &instance->step_start[instance->latest], &saved->step_start);
    instance->exchange = saved->exchange;
    instance->exchange.held = false;
    instance->columns = 0;
    instance->fresh = 0;
    return true;
}

static void write_bytes(const saved_state *saved, void *bytes)
{
    uint64_t checksum = er_hash(saved, sizeof *saved);
    memcpy(bytes, saved, sizeof *saved);
    memcpy((unsigned char *)bytes + sizeof *saved, &checksum, sizeof checksum);
}

/* Whole numbers of a saved state: where they are, bytes of each and from one to the next, how many, their range. */
typedef struct {
    size_t place, size, stride;
    int count, least, most;
} whole_numbers;

#define PLACE(member) offsetof(saved_state, member)
#define FLAG(member) {PLACE(member), sizeof(bool), sizeof(bool), 1, 0, 1}
#define NUMBERS(member, count, least, most) {PLACE(member), sizeof(int), sizeof(int), count, least, most}
#define LAWS(member, least, most)                                                                    \
    {PLACE(member), sizeof(int), sizeof(er_servo_law), ER_MAX_JOINTS, least, most}
#define OF_STATE(owner)                                                                              \
    NUMBERS(owner.region, ER_MAX_ANGLES, -1, 1), NUMBERS(owner.touching, 1, -1, 1),                  \
        NUMBERS(owner.stops.slipping, ER_MAX_ELEMENTS, -1, 1), LAWS(owner.motors.law[0].side, -1, 1), \
        LAWS(owner.motors.law[0].integral, ER_GROWS, ER_KEEPS), FLAG(owner.linearisation.has_mass)

/* Whether a state can be one that was saved: what chooses among few things does. */
static bool is_possible(const saved_state *saved)
{
    const whole_numbers all[] = {
        NUMBERS(memory.options.curve, 1, 0, er_gear_laws - 1), FLAG(memory.options.quasistatic),
        NUMBERS(memory.options.initial, 1, 0, ER_INITIALS - 1), NUMBERS(memory.options.drive, 1, 0, ER_DRIVES - 1),
        FLAG(memory.opposite[0]), FLAG(memory.opposite[1]), OF_STATE(memory.state),
        FLAG(progress.computed), FLAG(progress.parameters_changed),
        NUMBERS(progress.phase, 1, ER_INSTANTIATED, ER_TERMINATED),
        FLAG(step_start.stepped), OF_STATE(step_start.state),
        FLAG(exchange.on), FLAG(exchange.held), NUMBERS(exchange.piece, ER_MAX_JOINTS, 0, ER_MAX_KNOTS),
    };
    bool good = memchr(saved->memory.options.trajectory, '\0', ER_MAX_PATH) != NULL;
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        for (int i = 0; i < all[k].count; i++) {
            const char *at = (const char *)saved + all[k].place + (size_t)i * all[k].stride;
            int number = *(const unsigned char *)at;
            if (all[k].size == sizeof number)
                memcpy(&number, at, sizeof number);
            good &= number >= all[k].least && number <= all[k].most;
        }
    return good;
}

static bool read_bytes(er_instance *instance, const void *bytes, size_t size, saved_state *saved)
{
    uint64_t checksum;
    if (size != SERIALISED_SIZE)
        return er_fail(&instance->failure, "state: expected one that this FMU has saved, of %lu bytes, got %lu bytes",
                       (unsigned long)SERIALISED_SIZE, (unsigned long)size);
    memcpy(saved, bytes, sizeof *saved);
    memcpy(&checksum, (const unsigned char *)bytes + sizeof *saved, sizeof checksum);
    if (checksum != er_hash(saved, sizeof *saved))
        return er_fail(&instance->failure, "state: expected an unchanged copy, got %lu damaged bytes",
                       (unsigned long)size);
    if (!is_possible(saved))
        return er_fail(&instance->failure, "state: expected one that this FMU has saved, got numbers that none has");
    return require_same_fmu(instance, saved);
}

/* Memory of another state. */
static saved_state *new_state(er_component *c)
{
    saved_state *saved = calloc(1, sizeof *saved);
    if (saved == NULL)
        er_component_refuse(c, "the state does not fit into memory");
    return saved;
}

static bool require_state(er_component *c, const void *state)
{
    return er_component_may(c, ER_CALL_ANY) &&
           (state != NULL || er_component_refuse(c, "state: expected one that this FMU has saved, got none"));
}

bool er_component_get_state(er_component *c, void **state)
{
    saved_state *saved;
    if (!er_component_may(c, ER_CALL_ANY) || !er_component_given(c, 1, state, state))
        return false;
    saved = *state != NULL ? *state : new_state(c);
    if (saved == NULL)
        return false;
    save_instance(c->robot, saved);
    *state = saved;
    return true;
}

bool er_component_set_state(er_component *c, const void *state)
{
    return require_state(c, state) && er_component_told(c, restore_instance(c->robot, state));
}

bool er_component_free_state(er_component *c, void **state)
{
    if (!er_component_may(c, ER_CALL_ANY))
        return false;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return true;
}

bool er_component_state_size(er_component *c, const void *state, size_t *size)
{
    if (!require_state(c, state) || !er_component_given(c, 1, size, size))
        return false;
    *size = SERIALISED_SIZE;
    return true;
}

bool er_component_serialise(er_component *c, const void *state, void *bytes, size_t size)
{
    if (!require_state(c, state) || !er_component_given(c, size, bytes, bytes))
        return false;
    if (size < SERIALISED_SIZE)
        return er_component_refuse(c, "buffer: expected at least the state's size, got less");
    write_bytes(state, bytes);
    return true;
}

/* A state that is there already is replaced by a good one only. */
bool er_component_deserialise(er_component *c, const void *bytes, size_t size, void **state)
{
    saved_state *saved;
    if (!er_component_may(c, ER_CALL_ANY) || !er_component_given(c, 1, state, state) ||
        !er_component_given(c, size, bytes, bytes))
        return false;
    saved = new_state(c);
    if (saved == NULL)
        return false;
    if (!er_component_told(c, read_bytes(c->robot, bytes, size, saved))) {
        free(saved);
        return false;
    }
    free(*state);
    *state = saved;
    return true;
}
