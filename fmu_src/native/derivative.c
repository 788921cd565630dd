/* Directional derivatives: the last step, or the initial state, computed again beside itself.
 *
 * Central differences, with Newton's method taken to rounding so that the computed step is a smooth
 * function of its inputs.  The differences are so large that rounding stays below 1e-8 of the result
 * in steps of some milliseconds, and so small that the curvature does too.
 */
#include <math.h>
#include <string.h>

#include "instance.h"

/* Differences of the inputs: N and N m; rad, rad/s, rad/s^2. */
static const double difference[] = {10.0, 1e-5, 1e-3, 1e-1};

/* An input of the last step by its value reference. */
static double *input(const er_layout *layout, er_departure *departure, int reference)
{
    er_block block = (er_block)layout->block[reference];
    int k = reference - layout->first[block];
    switch (block) {
    case ER_WRENCH: return &departure->wrench[k];
    case ER_Q_CMD: return &departure->command.q[k];
    case ER_QD_CMD: return &departure->command.qd[k];
    default: return &departure->command.qdd[k];
    }
}

static bool is(const er_instance *instance, unsigned reference, bool (*kind)(er_block))
{
    return reference < (unsigned)er_real_count(&instance->layout) &&
           kind((er_block)instance->layout.block[reference]);
}

static bool require_kinds(er_instance *instance, const unsigned *unknowns, size_t unknown_count,
                          const unsigned *knowns, size_t known_count, const double *seed)
{
    for (size_t i = 0; i < unknown_count; i++)
        if (!is(instance, unknowns[i], er_is_output))
            return er_fail(&instance->failure, "the derivative of variable %u is asked for; needed is"
                           " an output", unknowns[i]);
    for (size_t j = 0; j < known_count; j++) {
        if (!is(instance, knowns[j], er_is_input))
            return er_fail(&instance->failure, "the derivative by variable %u is asked for; needed is"
                           " an input", knowns[j]);
        if (!isfinite(seed[j]))
            return er_fail(&instance->failure, "the seed of variable %u is not finite", knowns[j]);
    }
    return true;
}

/* The longest move along the seed that no input exceeds its difference with; 0 for a zero seed. */
static double scale_of(const er_instance *instance, const unsigned *knowns, size_t count,
                       const double *seed)
{
    double scale = INFINITY;
    for (size_t j = 0; j < count; j++)
        if (seed[j] != 0.0)
            scale = fmin(scale, difference[instance->layout.block[knowns[j]]] / fabs(seed[j]));
    return scale < INFINITY ? scale : 0.0;
}

/* Outputs after the last transition with its inputs moved along the seed. */
static bool outputs_at(er_instance *instance, double move, const unsigned *unknowns,
                       size_t unknown_count, const unsigned *knowns, size_t known_count,
                       const double *seed, double *values)
{
    er_departure moved = instance->departure;
    er_model *model = instance->model;
    bool good;
    for (size_t j = 0; j < known_count; j++)
        *input(&instance->layout, &moved, (int)knowns[j]) += move * seed[j];
    model->memory.state = moved.state;
    good = moved.stepped ? er_model_step(model, moved.end, &moved.command, moved.wrench,
                                         &instance->failure)
                         : er_model_reset(model, moved.end, &moved.command, moved.wrench,
                                          &instance->failure);
    instance->fresh = 0;
    return good && er_instance_get_reals(instance, unknowns, unknown_count, values);
}

bool er_instance_derivative(er_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed,
                            double *sensitivity)
{
    double up[ER_MAX_REALS], scale;
    er_memory memory;
    bool good;
    if (!require_kinds(instance, unknowns, unknown_count, knowns, known_count, seed))
        return false;
    if (unknown_count > ER_MAX_REALS)
        return er_fail(&instance->failure, "derivatives of %lu variables are asked for; this FMU has"
                       " %d", (unsigned long)unknown_count, er_real_count(&instance->layout));
    /* The initial state is computed, if it is not there, by reading any output. */
    if (unknown_count > 0 && !er_instance_get_reals(instance, unknowns, 1, up))
        return false;
    memset(sensitivity, 0, unknown_count * sizeof *sensitivity);
    scale = scale_of(instance, knowns, known_count, seed);
    if (scale == 0.0)
        return true;
    memory = instance->model->memory;
    er_model_solve_exactly(instance->model, true);
    good = outputs_at(instance, scale, unknowns, unknown_count, knowns, known_count, seed, up) &&
           outputs_at(instance, -scale, unknowns, unknown_count, knowns, known_count, seed,
                      sensitivity);
    er_model_solve_exactly(instance->model, false);
    instance->model->memory = memory;
    instance->fresh = 0;
    for (size_t i = 0; good && i < unknown_count; i++)
        sensitivity[i] = (up[i] - sensitivity[i]) / (2.0 * scale);
    return good;
}
