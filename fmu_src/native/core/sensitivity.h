/* How x and x' follow the inputs of a communication step: forward sensitivities, carried from step
 * to step of the integration, whose lengths are held.
 *
 * An input is named by its column, which is its value reference: the wrench, then q, q' and q'' of
 * the held command.  elastic_robot/path_sensitivity.py does the same for the parameters.
 */
#ifndef ER_SENSITIVITY_H
#define ER_SENSITIVITY_H

#include "collocation.h"

enum { ER_MAX_COLUMNS = 6 + 3 * ER_MAX_JOINTS };

/* Columns `first` to `first + count - 1`; of each, the derivatives of x and x'. */
typedef struct er_sensitivity {
    int first, count;
    double start;       /* of the command [s] */
    const char *reason; /* why there are none; NULL: all is well */
    double accuracy;    /* part of a column's stage accelerations that its solution may leave */
    int passes;         /* most that a column took */
    double x[ER_MAX_COLUMNS][ER_MAX_ANGLES], v[ER_MAX_COLUMNS][ER_MAX_ANGLES];
    /* Of the present step. */
    er_links links;
    ER_ALIGNED er_lanes slope[ER_MAX_ANGLES]; /* of the torque curve at the stages [N m/rad] */
} er_sensitivity;

/* An input's share in the motion of its drive at a time after the command. */
typedef struct {
    int joint; /* -1: the input is an entry of the wrench */
    double q, qd, qdd;
} er_share;

er_share er_share_of(const er_robot *robot, int column, double elapsed);

/* Begins with x and x' that do not depend on the inputs. */
void er_sensitivity_start(er_sensitivity *sensitivity, int first, int count, double start);

/* Carries the columns over a step that was just solved from `state`; the workspace is as it left it. */
void er_sensitivity_follow(er_sensitivity *sensitivity, const er_run *r, const er_state *state,
                           const er_step *step);

/* Corrects the columns where a coordinate has changed its law at the end of a step. */
void er_sensitivity_cross(er_sensitivity *sensitivity, const er_run *r, const er_state *state,
                          const er_step *step, const er_crossing *crossing);

#endif
