#include "transmission.h"

#include <math.h>

er_gear_error er_gear_error_sum(const er_robot *robot, int joint, double angle)
{
    er_gear_error sum = {0.0, 0.0, 0.0, 0.0};
    for (int j = robot->first_error[joint]; j < robot->first_error[joint + 1]; j++) {
        const er_error_sine *sine = &robot->error[j];
        double n = sine->order, turned = n * angle + sine->phase;
        double s = sine->amplitude * sin(turned), c = sine->amplitude * n * cos(turned);
        sum.value += s;
        sum.slope += c;
        sum.bend -= n * n * s;
        sum.third -= n * n * c;
    }
    return sum;
}

er_transmission er_transmission_at(const er_robot *robot, int joint, double q, double qd, double qdd)
{
    return (er_transmission){er_gear_error_at(robot, joint, q), qd, qdd};
}

void er_transmit(const er_robot *robot, int joint, double *q, double *qd, double *qdd)
{
    er_gear_error error = er_gear_error_at(robot, joint, *q);
    *q += error.value;
    *qdd += error.slope * *qdd + error.bend * *qd * *qd;
    *qd += error.slope * *qd;
}

void er_transmit_along(const er_transmission *at, double *q, double *qd, double *qdd)
{
    const er_gear_error *e = &at->error;
    *qdd += e->slope * *qdd + 2.0 * e->bend * at->rate * *qd +
            (e->bend * at->acceleration + e->third * at->rate * at->rate) * *q;
    *qd += e->slope * *qd + e->bend * at->rate * *q;
    *q += e->slope * *q;
}
