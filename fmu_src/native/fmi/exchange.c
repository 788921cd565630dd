#include "exchange.h"

#include <math.h>
#include <string.h>

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
    er_bends_find(&model->gears, k, bends);
    return er_gear_slack(&model->gears, &model->robot.settings, k, model->means.tolerance);
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
    for (int t = 0; t < instance->interface.torsions; t++) {
        er_bends bends;
        int piece;
        double slack = find_piece(instance, t, &bends, &piece);
        double x = instance->model->memory.state.x[instance->interface.torsion[t]];
        er_bends_distance(&bends, piece, x, slack, ways + 2 * t);
    }
}

void er_exchange_bends_along(const er_instance *instance, const er_change *along, double *ways)
{
    const er_model *model = instance->model;
    for (int t = 0; t < instance->interface.torsions; t++) {
        er_bends bends;
        int piece, k = instance->interface.torsion[t];
        double slack = find_piece(instance, t, &bends, &piece);
        double wider = er_gear_per_backlash(&model->gears, k, along->parameters.backlash[k]);
        if (!(slack < model->robot.settings.slack * model->means.tolerance))
            slack = 0.0; /* it does not follow the backlash */
        er_bends_distance_along(&bends, piece, along->x[k], wider, slack, ways + 2 * t);
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
    for (int t = 0; t < instance->interface.torsions; t++) {
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
    for (int i = 0; i < 2 * instance->interface.torsions; i++)
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
