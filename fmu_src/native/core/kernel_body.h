/* Kinematics and inverse dynamics of kernel.h, once for every width of `er_real`.
 *
 * Included behind kernel_vector.h.
 */

/* Beyond this change [rad] sines come from libm; below it the series are exact to rounding. */
#define SMALL_CHANGE 0.1

/* Rotation i of a chain in ER_WIDTH states from `first` on. */
ER_INLINE turned turn_of(int along, const er_robot *robot, const er_motion *motion, int i, int first)
{
    return turn_about(along, robot->rotation[i].axis, load(&motion->sine[i][first]),
                      load(&motion->cosine[i][first]));
}

/* A point behind rotation i, seen from the frame before it. */
ER_INLINE vec reach_through(int along, const er_robot *robot, const er_motion *motion, int i, int first,
                            vec point)
{
    turned R = turn_of(along, robot, motion, i, first);
    return out_of(along, &R, point);
}

/* From the tool inwards. */
static void ER_NAME(reach)(const er_robot *robot, const er_motion *motion, int states,
                           er_vector position)
{
    const double *tool = robot->tool_position;
    for (int first = 0; first < states; first += ER_WIDTH) {
        er_real none = 0.0 * load(&motion->cosine[0][first]);
        vec reach = {none + tool[0], none + tool[1], none + tool[2]};
        for (int i = robot->angles - 1; i >= 0; i--) {
            const er_rotation *rotation = &robot->rotation[i];
            const double *origin = rotation->origin;
            FOR_AXIS(rotation->along,
                     reach = reach_through(along, robot, motion, i, first, reach));
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
                       const double gravity[3], const double *wrench, const er_lanes *pull,
                       er_lanes *result)
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

    if (pull != NULL)
        at.force = add(at.force, load_vec(pull, first));
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
                           const double gravity[3], const double *wrench, const er_lanes *pull,
                           er_lanes *result)
{
    for (int first = 0; first < states; first += ER_WIDTH)
        loads_from(robot, motion, first, gravity, wrench, pull, result);
}

static bool is_small(int angles, const er_lanes *change)
{
    bool small = true;
    for (int i = 0; i < angles; i++)
        for (int l = 0; l < ER_LANES; l++)
            small &= fabs(change[i][l]) <= SMALL_CHANGE;
    return small;
}

static void ER_NAME(turn)(int angles, const double *reference_sine, const double *reference_cosine,
                          const er_lanes *change, er_motion *motion)
{
    bool series = is_small(angles, change);
    for (int i = 0; i < angles; i++) {
        for (int first = 0; first < ER_LANES; first += ER_WIDTH) {
            er_real s, c, d = load(&change[i][first]), d2 = d * d;
            if (series) {
                s = d - d * d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0 - d2 * (1.0 / 5040.0 -
                                                                       d2 * (1.0 / 362880.0))));
                c = 1.0 - d2 * (0.5 - d2 * (1.0 / 24.0 - d2 * (1.0 / 720.0 - d2 * (1.0 / 40320.0 -
                                                                          d2 * (1.0 / 3628800.0)))));
            } else {
                er_lanes sine, cosine;
                for (int l = first; l < first + ER_WIDTH; l++) {
                    sine[l - first] = sin(change[i][l]);
                    cosine[l - first] = cos(change[i][l]);
                }
                memcpy(&s, sine, sizeof s);
                memcpy(&c, cosine, sizeof c);
            }
            *(er_real *)&motion->sine[i][first] = reference_sine[i] * c + reference_cosine[i] * s;
            *(er_real *)&motion->cosine[i][first] = reference_cosine[i] * c - reference_sine[i] * s;
        }
    }
}

#undef SMALL_CHANGE
