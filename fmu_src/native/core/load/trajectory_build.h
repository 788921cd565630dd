/* A motion from its samples: completed by a spline where there are angles alone, its kinks found. */
#ifndef ER_TRAJECTORY_BUILD_H
#define ER_TRAJECTORY_BUILD_H

#include "trajectory.h"

/* Reads CSV with a header line, or NPZ with arrays `columns` and `data`. */
bool er_trajectory_read(er_trajectory *trajectory, const char *path, int joints,
                        const er_settings *settings, er_failure *failure);

void er_trajectory_free(er_trajectory *trajectory);

#endif
