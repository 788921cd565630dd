#include "fmi_steps.h"

#include <stdbool.h>
#include <stddef.h>

#include "fmi/fmi2FunctionTypes.h"
#include "fmi/fmi3FunctionTypes.h"

/* Keeps what an FMU has answered; whether it has done what it was asked: OK and Warning of FMI 2 and 3. */
static bool keep_status(er_steps *steps, int status)
{
    steps->status = status;
    return status <= fmi2Warning;
}

int64_t er_fmi2_steps(er_steps *steps, int64_t count, const double *time, const double *rows, double *answers)
{
    fmi2SetRealTYPE *set = (fmi2SetRealTYPE *)steps->set;
    fmi2DoStepTYPE *step = (fmi2DoStepTYPE *)steps->step;
    fmi2GetRealTYPE *get = (fmi2GetRealTYPE *)steps->get;
    const er_series *in = &steps->inputs, *out = &steps->outputs;
    for (int64_t k = 0; k < count; k++, rows += in->width, answers += out->width) {
        steps->number = k;
        if (!keep_status(steps, set(steps->instance, in->reference, (size_t)in->references, rows)))
            return ER_STEPS_SET;
        if (!keep_status(steps, step(steps->instance, time[k], time[k + 1] - time[k], fmi2True)))
            return ER_STEPS_STEP;
        if (!keep_status(steps, get(steps->instance, out->reference, (size_t)out->references, answers)))
            return ER_STEPS_GET;
    }
    return ER_STEPS_DONE;
}

int64_t er_fmi3_steps(er_steps *steps, int64_t count, const double *time, const double *rows, double *answers)
{
    fmi3SetFloat64TYPE *set = (fmi3SetFloat64TYPE *)steps->set;
    fmi3DoStepTYPE *step = (fmi3DoStepTYPE *)steps->step;
    fmi3GetFloat64TYPE *get = (fmi3GetFloat64TYPE *)steps->get;
    const er_series *in = &steps->inputs, *out = &steps->outputs;
    bool has_event = false, has_ended = false, is_early = false;
    double reached = 0.0;
    for (int64_t k = 0; k < count; k++, rows += in->width, answers += out->width) {
        steps->number = k;
        if (!keep_status(steps, set(steps->instance, in->reference, (size_t)in->references, rows, (size_t)in->width)))
            return ER_STEPS_SET;
        if (steps->has_ended)
            return ER_STEPS_STOPPED;
        if (!keep_status(steps, step(steps->instance, time[k], time[k + 1] - time[k], fmi3True, &has_event, &has_ended,
                                     &is_early, &reached)))
            return ER_STEPS_STEP;
        steps->has_ended = has_ended;
        if (is_early)
            return ER_STEPS_STOPPED;
        if (!keep_status(steps, get(steps->instance, out->reference, (size_t)out->references, answers,
                                    (size_t)out->width)))
            return ER_STEPS_GET;
    }
    return ER_STEPS_DONE;
}
