/* Steps of an instance of FMI 2 or 3 through the functions of its library, without a call from Python between them. */
#ifndef ER_FMI_STEPS_H
#define ER_FMI_STEPS_H

#include <stdint.h>

#include "export.h"

/* Why steps end: all were taken, an FMU has refused a call, or it has ended its simulation. */
enum { ER_STEPS_DONE,
       ER_STEPS_SET,
       ER_STEPS_STEP,
       ER_STEPS_GET,
       ER_STEPS_STOPPED };

/* Variables that are set before each step, or read behind it, and the number of their values. */
typedef struct {
    const uint32_t *reference;
    uint64_t references, width;
} er_series;

/* An instance that is stepped. */
typedef struct {
    void *instance;
    void (*set)(void), (*step)(void), (*get)(void); /* of the standard's types: reals, doStep, reals */
    er_series inputs, outputs;
    int64_t number, status; /* of the last step, from 0, and of its last call */
    int64_t has_ended;      /* the FMU wants no step any more; of FMI 3 */
} er_steps;

/* Takes `count` steps, from time[k] to time[k + 1] with the inputs rows[k], into answers[k]. */
ER_EXPORT int64_t er_fmi2_steps(er_steps *steps, int64_t count, const double *time, const double *rows,
                                double *answers);
ER_EXPORT int64_t er_fmi3_steps(er_steps *steps, int64_t count, const double *time, const double *rows,
                                double *answers);

#endif
