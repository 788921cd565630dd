#include "variables.h"

#include <string.h>

#include "../io/file.h"
#include "exchange.h"

/* Changes with the layout of er_saved_state. */
#define STATE_MARK UINT64_C(0x45526f626f74000a)

static void copy_step_start(const er_robot *robot, er_step_start *to, const er_step_start *from)
{
    memcpy(to, from, offsetof(er_step_start, state) + er_state_size(robot));
}

void er_instance_save(er_instance *instance, er_saved_state *saved)
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

static const char *kind(const er_exchange *exchange)
{
    return exchange->on ? "model exchange" : "co-simulation";
}

static bool require_own(er_instance *instance, const er_saved_state *saved)
{
    if (saved->mark != STATE_MARK)
        return er_fail(&instance->failure, "state: expected one that this FMU has saved, got another");
    if (saved->exchange.on != instance->exchange.on)
        return er_fail(&instance->failure, "state: expected one of %s, got one of %s",
                       kind(&instance->exchange), kind(&saved->exchange));
    return saved->fingerprint == instance->fingerprint ||
           er_fail(&instance->failure, "state: expected one with fingerprint %016llx, of the same"
                                       " robot, got %016llx",
                   (unsigned long long)instance->fingerprint,
                   (unsigned long long)saved->fingerprint);
}

bool er_instance_restore(er_instance *instance, const er_saved_state *saved)
{
    if (!require_own(instance, saved))
        return false;
    if (!er_model_restore(instance->model, &saved->memory, saved->progress.computed,
                          &instance->failure))
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

void er_serialise(const er_saved_state *saved, void *bytes)
{
    uint64_t checksum = er_hash(saved, sizeof *saved, ER_HASH_START);
    memcpy(bytes, saved, sizeof *saved);
    memcpy((unsigned char *)bytes + sizeof *saved, &checksum, sizeof checksum);
}

bool er_deserialise(er_instance *instance, const void *bytes, size_t size, er_saved_state *saved)
{
    uint64_t checksum;
    if (size != ER_SERIALISED_SIZE)
        return er_fail(&instance->failure, "state: expected one that this FMU has saved, of %lu bytes, got"
                                           " %lu bytes",
                       (unsigned long)ER_SERIALISED_SIZE, (unsigned long)size);
    memcpy(saved, bytes, sizeof *saved);
    memcpy(&checksum, (const unsigned char *)bytes + sizeof *saved, sizeof checksum);
    if (checksum != er_hash(saved, sizeof *saved, ER_HASH_START))
        return er_fail(&instance->failure, "state: expected an unchanged copy, got %lu damaged bytes",
                       (unsigned long)size);
    return require_own(instance, saved);
}
