#include "exchange.h"

#include <math.h>
#include <string.h>

#include "../core/outputs/chain_motion.h"
#include "../core/outputs/drive_outputs.h"
#include "../core/model_drives.h"
#include "indicators.h"

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

/* Lets elements slip or stick that are beyond where they do. */
static bool settle_elements(er_instance *instance)
{
    er_stops *stops = &instance->model->memory.state.stops;
    const er_robot *robot = &instance->model->robot;
    double ways[ER_MAX_ELEMENTS];
    bool changed = false;
    er_indicate_slips(instance, ways);
    for (int j = 0; j < er_all_elements(robot); j++) {
        if (ways[j] > 0.0)
            continue;
        if (stops->slipping[j] != 0) {
            stops->slipping[j] = 0;
        } else {
            er_stops_slip(robot, stops, j, stops->elongation[j] > 0.0 ? 1 : -1);
            changed = true;
        }
    }
    return changed;
}

/* Whether trajectory and experiment reach as far; solvers look ahead and interpolate. */
static bool is_covered(er_instance *instance)
{
    return er_model_covers(instance->model, instance->progress.time, &instance->failure) &&
           er_instance_require_before_stop(instance, instance->progress.time);
}

bool er_exchange_settle(er_instance *instance, bool *changed)
{
    *changed = false;
    if (!er_exchange_hold(instance) || !is_covered(instance))
        return false;
    for (int t = 0; t < instance->interface.torsions; t++) {
        er_bends bends;
        double slack = er_indicate_torsion(instance, t, &bends);
        double x = instance->model->memory.state.x[instance->interface.torsion[t]];
        instance->exchange.piece[t] = er_bends_piece(&bends, instance->exchange.piece[t], x, slack);
    }
    *changed = settle_elements(instance);
    instance->fresh = 0;
    return true;
}

bool er_exchange_completed(er_instance *instance, bool *has_event)
{
    double slips[ER_MAX_ELEMENTS];
    double ways[2 * ER_MAX_JOINTS]; /* whether contact or limit are touched is no choice that an event makes */
    if (!er_exchange_hold(instance) || !is_covered(instance))
        return false;
    er_indicate_bends(instance, ways);
    *has_event = false;
    for (int i = 0; i < 2 * instance->interface.torsions; i++)
        *has_event |= ways[i] <= 0.0;
    er_indicate_slips(instance, slips);
    for (int j = 0; j < er_all_elements(&instance->model->robot); j++)
        *has_event |= slips[j] <= 0.0;
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
        return er_fail(&instance->failure, "time: expected a finite number, got %s s", er_shown(time, number));
    instance->progress.time = time;
    er_exchange_disturb(instance);
    return true;
}
