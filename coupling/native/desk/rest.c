#include "rest.h"

#include <string.h>

#include "core/load/statics.h"

bool er_desk_rest(const er_desk *desk, int64_t law, const double *q, const double *wrench, double *x)
{
    const er_robot *robot = &desk->robot;
    const er_history unloaded = {{0.0}, {0.0}};
    er_load load;
    er_gears gears;
    er_failure failure;
    if (law < 0 || law >= er_gear_laws)
        return false;
    memset(&load, 0, sizeof load);
    memcpy(load.wrench, wrench, sizeof load.wrench);
    memset(x, 0, (size_t)robot->elastics * sizeof *x);
    er_gears_build(&gears, (int)law, robot, &robot->parameters);
    return er_equilibrium(robot, &gears, &unloaded, robot->parameters.gravity, q, &load, x, &failure);
}
