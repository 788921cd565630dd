/* Kinematics and inverse dynamics of kernel.h, once for every width of `er_real`.
 *
 * Included behind kernel_vector.h.
 */

/* Beyond this change [rad] sines come from libm; below it the series are exact to rounding. */
#define SMALL_CHANGE 0.1

/* Rotation i of a chain in ER_WIDTH states from `first` on. */
ER_INLINE turned turn_of(int along, const er_robot *robot, const er_motion *motion, int i, int first)
{
    return turn_about(along, robot->rotation[i].axis, load(&motion->sine[i][first]), load(&motion->cosine[i][first]));
}

/* A point behind rotation i, seen from the frame before it. */
ER_INLINE vec reach_through(int along, const er_robot *robot, const er_motion *motion, int i, int first, vec point)
{
    turned R = turn_of(along, robot, motion, i, first);
    return out_of(along, &R, point);
}

/* From the tool inwards. */
static void ER_NAME(reach)(const er_robot *robot, const er_motion *motion, int states, er_vector position)
{
    const double *tool = robot->tool_position;
    for (int first = 0; first < states; first += ER_WIDTH) {
        er_real none = 0.0 * load(&motion->cosine[0][first]);
        vec reach = {none + tool[0], none + tool[1], none + tool[2]};
        for (int i = robot->angles - 1; i >= 0; i--) {
            const er_rotation *rotation = &robot->rotation[i];
            const double *origin = rotation->origin;
            FOR_AXIS(rotation->along, reach = reach_through(along, robot, motion, i, first, reach));
            if (rotation->shifted)
                reach = (vec){reach.x + origin[0], reach.y + origin[1], reach.z + origin[2]};
        }
        store_vec(position, first, reach);
    }
}

/* How a frame moves, and what the tool carries, in its axes. */
typedef struct {
    vec spin, spin_rate; /* omega, omega' */
    vec push;            /* acceleration of its origin less gravity */
    vec force, moment;   /* on the tool */
} frame_motion;

/* Steps over rotation i, outwards. */
ER_INLINE void go_out(int along, const er_robot *robot, const er_motion *motion, int i, int first,
                      bool loaded, frame_motion *at)
{
    const double *a = robot->rotation[i].axis;
    er_real rate = load(&motion->rate[i][first]);
    turned R = turn_of(along, robot, motion, i, first);
    at->push = into(along, &R, at->push);
    at->spin = into(along, &R, at->spin);
    at->spin_rate = plus_cross_axis(along, a, into(along, &R, at->spin_rate), at->spin, rate);
    at->spin_rate = plus_axis(along, a, at->spin_rate, load(&motion->acceleration[i][first]));
    at->spin = plus_axis(along, a, at->spin, rate);
    if (loaded) {
        at->force = into(along, &R, at->force);
        at->moment = into(along, &R, at->moment);
    }
}

/* Steps over rotation i, inwards, and leaves the moment about its axis in `torque`. */
ER_INLINE void go_in(int along, const er_robot *robot, const er_motion *motion, int i, int first,
                     vec *force, vec *moment, er_real *torque)
{
    turned R = turn_of(along, robot, motion, i, first);
    *torque = along_axis(along, robot->rotation[i].axis, *moment);
    *force = out_of(along, &R, *force);
    *moment = out_of(along, &R, *moment);
}

/* The recursive Newton-Euler algorithm in the bodies' frames: ER_WIDTH states from `first` on. */
static void loads_from(const er_robot *robot, const er_motion *motion, int first,
                       const double gravity[3], const double *wrench, const er_lanes *pull, er_lanes *result)
{
    static const double zero[3] = {0.0, 0.0, 0.0};
    const double *force_at_base = wrench != NULL ? wrench : zero;
    const double *moment_at_base = wrench != NULL ? wrench + 3 : zero;
    vec forces[ER_MAX_ANGLES], torques[ER_MAX_ANGLES]; /* that a body needs, about its origin */
    er_real none = 0.0 * load(&motion->cosine[0][first]);
    vec rest = {none, none, none}, force, moment;
    frame_motion at = {
        rest, rest,
        /* A base that accelerates upwards stands for gravity. */
        {none - gravity[0], none - gravity[1], none - gravity[2]},
        {none + force_at_base[0], none + force_at_base[1], none + force_at_base[2]},
        {none + moment_at_base[0], none + moment_at_base[1], none + moment_at_base[2]},
    };
    bool loaded = wrench != NULL || pull != NULL;
    int n = robot->angles;

    if (pull != NULL) {
        at.force = add(at.force, load_vec(pull, first));
        at.moment = add(at.moment, load_vec(pull + 3, first));
    }
    for (int i = 0; i < n; i++) {
        const er_rotation *rotation = &robot->rotation[i];
        if (rotation->shifted)
            at.push = add(at.push, add(cross_fixed(at.spin_rate, rotation->origin),
                                       cross(at.spin, cross_fixed(at.spin, rotation->origin))));
        FOR_AXIS(rotation->along, go_out(along, robot, motion, i, first, loaded, &at));
        if (rotation->loaded) {
            const er_body *body = &rotation->body;
            vec sling = add(cross_fixed(at.spin_rate, body->moment),
                            cross(at.spin, cross_fixed(at.spin, body->moment)));
            vec weight = cross_fixed(at.push, body->moment);
            vec wobble = cross(at.spin, symmetric_times(body->inertia, at.spin));
            vec swing = symmetric_times(body->inertia, at.spin_rate);
            forces[i] = plus(sling, at.push, none + body->mass);
            torques[i] = minus(add(swing, wobble), weight);
        }
    }
    force = moment = rest;
    if (loaded) { /* what acts on the tool need not be carried by the joints */
        moment = minus(cross_fixed(at.force, robot->tool_position), at.moment);
        force = minus(rest, at.force);
    }
    for (int i = n - 1; i >= 0; i--) {
        const er_rotation *rotation = &robot->rotation[i];
        er_real torque;
        if (rotation->loaded) {
            force = add(force, forces[i]);
            moment = add(moment, torques[i]);
        }
        FOR_AXIS(rotation->along, go_in(along, robot, motion, i, first, &force, &moment, &torque));
        if (rotation->elastic >= 0)
            *(er_real *)&result[rotation->elastic][first] = torque;
        if (rotation->shifted)
            moment = minus(moment, cross_fixed(force, rotation->origin));
    }
}

static void ER_NAME(loads)(const er_robot *robot, const er_motion *motion, int states,
                           const double gravity[3], const double *wrench, const er_lanes *pull, er_lanes *result)
{
    for (int first = 0; first < states; first += ER_WIDTH)
        loads_from(robot, motion, first, gravity, wrench, pull, result);
}

static void ER_NAME(carry)(int count, int states, const double *slope, const double *zero,
                           const double *damping, const er_lanes *x, const er_lanes *v, er_lanes *result)
{
    for (int first = 0; first < states; first += ER_WIDTH)
        for (int k = 0; k < count; k++)
            *(er_real *)&result[k][first] += slope[k] * (load(&x[k][first]) - zero[k]) +
                                             damping[k] * load(&v[k][first]);
}

static bool is_small(er_real change)
{
    er_lanes lanes;
    bool small = true;
    memcpy(lanes, &change, sizeof change);
    for (int l = 0; l < ER_WIDTH; l++)
        small &= fabs(lanes[l]) <= SMALL_CHANGE;
    return small;
}

ER_INLINE void small_turn(er_real d, er_real *sine, er_real *cosine)
{
    er_real d2 = d * d;
    *sine = d - d * d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0 - d2 * (1.0 / 5040.0 -
                                                              d2 * (1.0 / 362880.0))));
    *cosine = 1.0 - d2 * (0.5 - d2 * (1.0 / 24.0 - d2 * (1.0 / 720.0 - d2 * (1.0 / 40320.0 -
                                                                      d2 * (1.0 / 3628800.0)))));
}

static void large_turn(er_real d, er_real *sine, er_real *cosine)
{
    er_lanes lanes, s, c;
    memcpy(lanes, &d, sizeof d);
    for (int l = 0; l < ER_WIDTH; l++) {
        s[l] = sin(lanes[l]);
        c[l] = cos(lanes[l]);
    }
    memcpy(sine, s, sizeof *sine);
    memcpy(cosine, c, sizeof *cosine);
}

/* As er_command_at. */
static void ER_NAME(drive)(int joints, const er_command_powers powers, er_nodes *nodes)
{
    for (int first = 0; first < ER_LANES; first += ER_WIDTH) {
        er_real s = load(&nodes->elapsed[first]);
        for (int i = 0; i < joints; i++) {
            const double *c = powers[i];
            *(er_real *)&nodes->q[i][first] = c[0] + (c[1] + (c[2] + (c[3] + c[4] * s) * s) * s) * s;
            *(er_real *)&nodes->qd[i][first] =
                c[1] + (2.0 * c[2] + (3.0 * c[3] + 4.0 * c[4] * s) * s) * s;
            *(er_real *)&nodes->qdd[i][first] = 2.0 * c[2] + (6.0 * c[3] + 12.0 * c[4] * s) * s;
        }
    }
}

static void move_at(const er_robot *robot, const er_nodes *nodes, const er_reference *reference,
                    const er_lanes *x, const er_lanes *v, const er_lanes *acceleration, int first, er_motion *motion)
{
    er_real none = 0.0 * load(&nodes->q[0][first]);
    for (int i = 0; i < robot->angles; i++) {
        int drive = robot->rotation[i].drive, elastic = robot->rotation[i].elastic;
        er_real change = none, rate = none, bend = none, s, c;
        if (drive >= 0) {
            change = load(&nodes->q[drive][first]) - reference->angle[drive];
            rate = load(&nodes->qd[drive][first]);
            bend = load(&nodes->qdd[drive][first]);
        }
        if (elastic >= 0) {
            change += load(&x[elastic][first]);
            rate += load(&v[elastic][first]);
            bend += load(&acceleration[elastic][first]);
        }
        if (is_small(change))
            small_turn(change, &s, &c);
        else
            large_turn(change, &s, &c);
        if (drive >= 0) {
            er_real s_change = s, c_change = c;
            double s_0 = reference->sine[drive], c_0 = reference->cosine[drive];
            s = s_0 * c_change + c_0 * s_change;
            c = c_0 * c_change - s_0 * s_change;
        }
        *(er_real *)&motion->sine[i][first] = s;
        *(er_real *)&motion->cosine[i][first] = c;
        *(er_real *)&motion->rate[i][first] = rate;
        *(er_real *)&motion->acceleration[i][first] = bend;
    }
}

static void ER_NAME(move)(const er_robot *robot, const er_nodes *nodes,
                          const er_reference *reference, const er_lanes *x, const er_lanes *v,
                          const er_lanes *acceleration, er_motion *motion)
{
    for (int first = 0; first < ER_LANES; first += ER_WIDTH)
        move_at(robot, nodes, reference, x, v, acceleration, first, motion);
}

#undef SMALL_CHANGE
