#include "exchange.h"

#include <math.h>
#include <string.h>

#include "../core/bends.h"
#include "instance_variables.h"

int er_exchange_states(const er_instance *instance)
{
    return 2 * instance->model->robot.elastics;
}

int er_exchange_indicators(const er_instance *instance)
{
    return instance->interface.size[ER_BEND] + instance->interface.size[ER_CONTACT_GAP];
}

bool er_exchange_runs(const er_instance *instance)
{
    return instance->exchange.on && instance->progress.phase >= ER_EVENT_MODE;
}

void er_exchange_disturb(er_instance *instance)
{
    instance->exchange.held = false;
    instance->fresh = 0;
}

bool er_exchange_hold(er_instance *instance)
{
    const er_inputs *inputs = &instance->inputs;
    er_model *model = instance->model;
    if (!er_exchange_runs(instance) || instance->exchange.held)
        return true;
    if (!er_anchor_require(&inputs->load.anchor, &instance->failure) ||
        !er_contact_require(&inputs->load.contact, &instance->failure))
        return false;
    if (instance->progress.parameters_changed)
        er_model_take_parameters(model, &inputs->parameters);
    instance->progress.parameters_changed = false;
    er_model_hold(model, instance->progress.time, &inputs->command, &inputs->load);
    instance->exchange.held = true;
    return true;
}

/* The bends of a torsion's curve, and how far behind them a piece ends. */
static double find_bends(const er_instance *instance, int torsion, er_bends *bends)
{
    const er_model *model = instance->model;
    int k = instance->interface.torsion[torsion];
    er_bends_find(&model->curve, k, bends);
    return er_crossing_slack(&model->curve, &model->robot.settings, k, model->means.tolerance);
}

/* The bends of a torsion's curve, the piece that counts, and how far behind them it ends. */
static double find_piece(const er_instance *instance, int torsion, er_bends *bends, int *piece)
{
    double slack = find_bends(instance, torsion, bends);
    double x = instance->model->memory.state.x[instance->interface.torsion[torsion]];
    *piece = instance->exchange.piece[torsion];
    if (er_exchange_runs(instance) && *piece <= bends->count)
        return slack;
    *piece = er_bends_piece(bends, 0, x, 0.0);
    return 0.0;
}

void er_exchange_bends(const er_instance *instance, double *ways)
{
    for (int t = 0; 2 * t < instance->interface.size[ER_BEND]; t++) {
        er_bends bends;
        int piece;
        double slack = find_piece(instance, t, &bends, &piece);
        double x = instance->model->memory.state.x[instance->interface.torsion[t]];
        er_bends_distance(&bends, piece, x, slack, ways + 2 * t);
    }
}

double er_exchange_contact_gap(const er_instance *instance)
{
    const er_model *model = instance->model;
    er_contact_motion motion;
    double wrench[6];
    if (!er_contact_holds(&model->memory.held.load.contact))
        return 1.0;
    er_model_contact(model, &motion, wrench);
    return -motion.touch.depth;
}

void er_exchange_bends_along(const er_instance *instance, const er_change *along, double *ways)
{
    const er_model *model = instance->model;
    for (int t = 0; 2 * t < instance->interface.size[ER_BEND]; t++) {
        er_bends bends;
        int piece, k = instance->interface.torsion[t];
        double change = along->x[k], slack = find_piece(instance, t, &bends, &piece);
        /* Bends lie at parts of the backlash but for those of a table. */
        double wider = er_curve_switches(&model->curve, k)
                           ? along->parameters.backlash[k] / model->curve.backlash[k] : 0.0;
        if (slack < model->robot.settings.slack * model->means.tolerance)
            slack *= wider;
        else
            slack = 0.0;
        ways[2 * t] = piece > 0 ? change - wider * bends.angle[piece - 1] + slack : 0.0;
        ways[2 * t + 1] = piece < bends.count ? wider * bends.angle[piece] - change + slack : 0.0;
    }
}

/* Whether trajectory and experiment reach as far; solvers look ahead and interpolate. */
static bool is_covered(er_instance *instance)
{
    return er_model_covers(instance->model, instance->progress.time, &instance->failure) &&
           er_instance_require_before_stop(instance, instance->progress.time);
}

bool er_exchange_settle(er_instance *instance)
{
    if (!er_exchange_hold(instance) || !is_covered(instance))
        return false;
    for (int t = 0; 2 * t < instance->interface.size[ER_BEND]; t++) {
        er_bends bends;
        double slack = find_bends(instance, t, &bends);
        double x = instance->model->memory.state.x[instance->interface.torsion[t]];
        instance->exchange.piece[t] = er_bends_piece(&bends, instance->exchange.piece[t], x, slack);
    }
    instance->fresh = 0;
    return true;
}

bool er_exchange_completed(er_instance *instance, bool *has_event)
{
    double ways[2 * ER_MAX_JOINTS]; /* whether the contact is touched is no choice that an event makes */
    if (!er_exchange_hold(instance) || !is_covered(instance))
        return false;
    er_exchange_bends(instance, ways);
    *has_event = false;
    for (int i = 0; i < instance->interface.size[ER_BEND]; i++)
        *has_event |= ways[i] <= 0.0;
    return true;
}

double er_exchange_next_event(er_instance *instance)
{
    return er_model_next_kink(instance->model, instance->progress.time);
}

bool er_exchange_set_time(er_instance *instance, double time)
{
    char number[ER_NUMBER_TEXT];
    if (!isfinite(time))
        return er_fail(&instance->failure, "time: expected a finite number, got %s s",
                       er_shown(time, number));
    instance->progress.time = time;
    er_exchange_disturb(instance);
    return true;
}

static bool require_count(er_instance *instance, const char *what, size_t count, int expected)
{
    return count == (size_t)expected ||
           er_fail(&instance->failure, "%s: expected %d values, got %lu", what, expected,
                   (unsigned long)count);
}

bool er_exchange_set_states(er_instance *instance, const double *states, size_t count)
{
    er_state *state = &instance->model->memory.state;
    size_t m = (size_t)instance->model->robot.elastics;
    char number[ER_NUMBER_TEXT];
    if (!require_count(instance, "continuous states", count, er_exchange_states(instance)))
        return false;
    for (size_t k = 0; k < count; k++)
        if (!isfinite(states[k]))
            return er_fail(&instance->failure, "continuous state %lu: expected a finite number, got %s",
                           (unsigned long)k + 1, er_shown(states[k], number)) ||
                   er_let_retry(&instance->failure);
    memcpy(state->x, states, m * sizeof *states);
    memcpy(state->v, states + m, m * sizeof *states);
    instance->fresh = 0;
    return true;
}

/* Values of blocks, one after another. */
static bool get_blocks(er_instance *instance, const char *what, int blocks, const er_block block[],
                       double *values, size_t count)
{
    unsigned references[2 * ER_MAX_ANGLES];
    int known = 0;
    for (int b = 0; b < blocks; b++)
        for (int k = 0; k < instance->interface.size[block[b]]; k++)
            references[known++] = (unsigned)(instance->interface.first[block[b]] + k);
    return require_count(instance, what, count, known) &&
           er_instance_get_reals(instance, references, count, values);
}

bool er_exchange_get_states(er_instance *instance, double *states, size_t count)
{
    static const er_block block[] = {ER_DEFLECTION, ER_DEFLECTION_RATE};
    return get_blocks(instance, "continuous states", 2, block, states, count);
}

bool er_exchange_get_derivatives(er_instance *instance, double *derivatives, size_t count)
{
    static const er_block block[] = {ER_DEFLECTION_DERIVATIVE, ER_RATE_DERIVATIVE};
    return get_blocks(instance, "derivatives of continuous states", 2, block, derivatives, count);
}

bool er_exchange_get_indicators(er_instance *instance, double *indicators, size_t count)
{
    static const er_block block[] = {ER_BEND, ER_CONTACT_GAP};
    return get_blocks(instance, "event indicators", 2, block, indicators, count);
}

bool er_exchange_get_nominals(er_instance *instance, double *nominals, size_t count)
{
    if (!require_count(instance, "nominals of continuous states", count, er_exchange_states(instance)))
        return false;
    for (size_t k = 0; k < count; k++)
        nominals[k] = instance->interface.nominal[2 * k >= count];
    return true;
}

void er_exchange_by_time(er_instance *instance, double seed, er_held *held)
{
    er_held by_time;
    er_model_held_by_time(instance->model, &by_time);
    for (int i = 0; i < instance->model->robot.joints; i++) {
        held->q[i] += seed * by_time.q[i];
        held->qd[i] += seed * by_time.qd[i];
        held->qdd[i] += seed * by_time.qdd[i];
    }
}

void er_exchange_add(er_instance *instance, unsigned reference, double seed, er_change *change)
{
    const er_interface *interface = &instance->interface;
    bool commanded = instance->model->memory.options.trajectory[0] == '\0';
    er_held *held = &change->held;
    int block, k;
    if (reference == er_time_reference(interface)) {
        er_exchange_by_time(instance, seed, held);
        return;
    }
    block = interface->block[reference];
    k = (int)reference - interface->first[block];
    switch (block) {
    case ER_WRENCH: held->load.wrench[k] += seed; break;
    case ER_Q_CMD: held->q[k] += commanded ? seed : 0.0; break;
    case ER_QD_CMD: held->qd[k] += commanded ? seed : 0.0; break;
    case ER_QDD_CMD: held->qdd[k] += commanded ? seed : 0.0; break;
    case ER_ANCHOR: held->load.anchor.position[k] += seed; break;
    case ER_ANCHOR_VELOCITY: held->load.anchor.velocity[k] += seed; break;
    case ER_ANCHOR_STIFFNESS: held->load.anchor.stiffness[k] += seed; break;
    case ER_CONTACT: *er_contact_entry(&held->load.contact, k) += seed; break;
    case ER_CONTACT_NORMAL: held->load.contact.normal[k] += seed; break;
    case ER_DEFLECTION: change->x[k] += seed; break;
    case ER_DEFLECTION_RATE: change->v[k] += seed; break;
    case ER_GRAVITY:
    case ER_STIFFNESS:
    case ER_DAMPING:
    case ER_BACKLASH_WIDTH:
        *er_parameter(interface, &change->parameters, (er_block)block, k) += seed;
        break;
    default: break; /* the rate of the wrench: the master moves it */
    }
}

void er_exchange_change(er_instance *instance, const unsigned *knowns, size_t count,
                        const double *seed, er_change *change)
{
    memset(change, 0, sizeof *change);
    for (size_t j = 0; j < count; j++)
        er_exchange_add(instance, knowns[j], seed[j], change);
}
