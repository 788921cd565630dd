/* The derivative of the loads in kernel_body.h along a direction, for every width of `er_real`.
 *
 * Included behind kernel_body.h.  The recursive Newton-Euler algorithm is differentiated line by
 * line, in the bodies' frames: of v = R^T v_before follows dv = R^T dv_before + (v x axis) dtheta,
 * of f_before = R f follows df_before = R (df + (axis x f) dtheta).
 */

static inline turned load_turn(const er_vector *rows, int first)
{
    return (turned){{load_vec(rows[0], first), load_vec(rows[1], first), load_vec(rows[2], first)}};
}

static inline void store_turn(er_vector *rows, int first, const turned *R)
{
    for (int i = 0; i < 3; i++)
        store_vec(rows[i], first, R->row[i]);
}

/* a + b factor */
static inline vec plus(vec a, vec b, er_real factor)
{
    return (vec){a.x + b.x * factor, a.y + b.y * factor, a.z + b.z * factor};
}

static inline vec minus(vec a, vec b)
{
    return (vec){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline er_real along(vec v, const double a[3])
{
    return v.x * a[0] + v.y * a[1] + v.z * a[2];
}

static void link_from(const er_robot *robot, const er_motion *motion, int first,
                      const double gravity[3], const double *wrench, const er_lanes *pull,
                      er_links *links)
{
    vec forces[ER_MAX_ANGLES], torques[ER_MAX_ANGLES]; /* that a body needs, about its origin */
    er_real none = 0.0 * load(&motion->cosine[0][first]), one = 1.0 + none;
    vec zero = {none, none, none}, spin = zero, spin_rate = zero, force = zero, moment = zero;
    vec push = {none - gravity[0], none - gravity[1], none - gravity[2]};
    turned base = {{{one, none, none}, {none, one, none}, {none, none, one}}};
    int n = robot->angles;

    for (int i = 0; i < n; i++) {
        const er_rotation *rotation = &robot->rotation[i];
        const double *a = rotation->axis;
        er_link *link = &links->link[i];
        vec own = scaled(a, load(&motion->rate[i][first]));
        turned R = turn_about(a, load(&motion->sine[i][first]), load(&motion->cosine[i][first]));
        if (rotation->shifted) {
            vec carried = cross_fixed(spin, rotation->origin);
            push = add(push, add(cross_fixed(spin_rate, rotation->origin), cross(spin, carried)));
            store_vec(link->carried, first, carried);
        }
        push = into(&R, push);
        spin = into(&R, spin);
        spin_rate = into(&R, spin_rate);
        store_turn(link->turn, first, &R);
        store_vec(link->own, first, own);
        store_vec(link->push_by, first, cross_fixed(push, a));
        store_vec(link->spin_by, first, cross_fixed(spin, a));
        store_vec(link->rate_by, first, cross_fixed(spin_rate, a));
        spin_rate = add(add(spin_rate, cross(spin, own)),
                        scaled(a, load(&motion->acceleration[i][first])));
        spin = add(spin, own);
        store_vec(link->spin, first, spin);
        for (int k = 0; k < 3; k++) /* rows of base_from_before times R */
            base.row[k] = into(&R, base.row[k]);
        if (rotation->loaded) {
            const er_body *body = &rotation->body;
            vec momentum = symmetric_times(body->inertia, spin);
            vec sling = cross_fixed(spin, body->moment);
            forces[i] = plus(add(cross_fixed(spin_rate, body->moment), cross(spin, sling)), push,
                             none + body->mass);
            torques[i] = minus(add(symmetric_times(body->inertia, spin_rate), cross(spin, momentum)),
                               cross_fixed(push, body->moment));
            store_vec(link->momentum, first, momentum);
            store_vec(link->sling, first, sling);
        }
    }
    store_turn(links->base, first, &base);
    if (links->loaded) {
        for (int k = 0; wrench != NULL && k < 3; k++) {
            force = plus(force, base.row[k], none + wrench[k]);
            moment = plus(moment, base.row[k], none + wrench[3 + k]);
        }
        for (int k = 0; pull != NULL && k < 3; k++) {
            force = plus(force, base.row[k], load(&pull[k][first]));
            moment = plus(moment, base.row[k], load(&pull[3 + k][first]));
        }
        store_vec(links->force, first, force);
        store_vec(links->moment, first, moment);
        moment = minus(cross_fixed(force, robot->tool_position), moment);
        force = minus(zero, force);
    }
    for (int i = n - 1; i >= 0; i--) {
        const er_rotation *rotation = &robot->rotation[i];
        er_link *link = &links->link[i];
        turned R = load_turn((const er_vector *)link->turn, first);
        vec axis = scaled(rotation->axis, one);
        if (rotation->loaded) {
            force = add(force, forces[i]);
            moment = add(moment, torques[i]);
        }
        store_vec(link->force_by, first, cross(axis, force));
        store_vec(link->moment_by, first, cross(axis, moment));
        force = out_of(&R, force);
        moment = out_of(&R, moment);
        if (rotation->shifted)
            moment = minus(moment, cross_fixed(force, rotation->origin));
    }
}

static void ER_NAME(link)(const er_robot *robot, const er_motion *motion, const double gravity[3],
                          const double *wrench, const er_lanes *pull, er_links *links)
{
    links->loaded = wrench != NULL || pull != NULL;
    for (int first = 0; first < ER_LANES; first += ER_WIDTH)
        link_from(robot, motion, first, gravity, wrench, pull, links);
}

static void ER_NAME(shift)(const er_robot *robot, const er_links *links,
                           const er_direction *direction, er_vector result)
{
    for (int first = 0; first < ER_LANES; first += ER_WIDTH) {
        er_real none = 0.0 * load(&direction->angle[0][first]);
        vec shift = {none, none, none}, turn = shift; /* of the frame */
        for (int i = 0; i < robot->angles; i++) {
            const er_rotation *rotation = &robot->rotation[i];
            turned R = load_turn(links->link[i].turn, first);
            if (rotation->shifted)
                shift = add(shift, cross_fixed(turn, rotation->origin));
            shift = into(&R, shift);
            turn = add(into(&R, turn), scaled(rotation->axis, load(&direction->angle[i][first])));
        }
        shift = add(shift, cross_fixed(turn, robot->tool_position));
        {
            turned base = load_turn(links->base, first);
            store_vec(result, first, out_of(&base, shift));
        }
    }
}

static void tangent_from(const er_robot *robot, const er_links *links,
                         const er_direction *direction, int first, const double *wrench,
                         const er_lanes *pull, er_lanes *result)
{
    vec forces[ER_MAX_ANGLES], torques[ER_MAX_ANGLES];
    er_real none = 0.0 * load(&direction->angle[0][first]);
    vec zero = {none, none, none}, turn = zero; /* small rotation of the frame */
    vec push = zero, spin = zero, spin_rate = zero, force = zero, moment = zero;
    int n = robot->angles;

    for (int i = 0; i < n; i++) {
        const er_rotation *rotation = &robot->rotation[i];
        const er_link *link = &links->link[i];
        const double *a = rotation->axis;
        turned R = load_turn(link->turn, first);
        er_real angle = load(&direction->angle[i][first]), rate = load(&direction->rate[i][first]);
        vec spin_by = load_vec(link->spin_by, first);
        if (rotation->shifted) {
            push = add(push, add(cross_fixed(spin_rate, rotation->origin),
                                 cross(spin, load_vec(link->carried, first))));
            if (i > 0)
                push = add(push, cross(load_vec(links->link[i - 1].spin, first),
                                       cross_fixed(spin, rotation->origin)));
        }
        push = plus(into(&R, push), load_vec(link->push_by, first), angle);
        spin = plus(into(&R, spin), spin_by, angle);
        spin_rate = plus(into(&R, spin_rate), load_vec(link->rate_by, first), angle);
        spin_rate = add(spin_rate, cross(spin, load_vec(link->own, first)));
        spin_rate = add(plus(spin_rate, spin_by, rate),
                        scaled(a, load(&direction->acceleration[i][first])));
        spin = add(spin, scaled(a, rate));
        if (links->loaded)
            turn = add(into(&R, turn), scaled(a, angle));
        if (rotation->loaded) {
            const er_body *body = &rotation->body;
            vec of_spin = load_vec(link->spin, first);
            vec momentum = symmetric_times(body->inertia, spin);
            vec swing = symmetric_times(body->inertia, spin_rate);
            vec sling = cross_fixed(spin, body->moment);
            forces[i] = plus(cross_fixed(spin_rate, body->moment), push, none + body->mass);
            forces[i] = add(forces[i], add(cross(spin, load_vec(link->sling, first)),
                                           cross(of_spin, sling)));
            torques[i] = minus(swing, cross_fixed(push, body->moment));
            torques[i] = add(torques[i], add(cross(spin, load_vec(link->momentum, first)),
                                             cross(of_spin, momentum)));
        }
    }
    if (links->loaded) { /* the wrench keeps its direction in base axes */
        force = cross(load_vec(links->force, first), turn);
        moment = cross(load_vec(links->moment, first), turn);
    }
    for (int k = 0; wrench != NULL && k < 3; k++) {
        vec row = load_vec(links->base[k], first);
        force = plus(force, row, none + wrench[k]);
        moment = plus(moment, row, none + wrench[3 + k]);
    }
    for (int k = 0; pull != NULL && k < 3; k++) {
        vec row = load_vec(links->base[k], first);
        force = plus(force, row, load(&pull[k][first]));
        moment = plus(moment, row, load(&pull[3 + k][first]));
    }
    moment = minus(cross_fixed(force, robot->tool_position), moment);
    force = minus(zero, force);
    for (int i = n - 1; i >= 0; i--) {
        const er_rotation *rotation = &robot->rotation[i];
        const er_link *link = &links->link[i];
        turned R = load_turn(link->turn, first);
        er_real angle = load(&direction->angle[i][first]);
        if (rotation->loaded) {
            force = add(force, forces[i]);
            moment = add(moment, torques[i]);
        }
        if (rotation->elastic >= 0)
            *(er_real *)&result[rotation->elastic][first] = along(moment, rotation->axis);
        force = out_of(&R, plus(force, load_vec(link->force_by, first), angle));
        moment = out_of(&R, plus(moment, load_vec(link->moment_by, first), angle));
        if (rotation->shifted)
            moment = minus(moment, cross_fixed(force, rotation->origin));
    }
}

static void ER_NAME(tangent)(const er_robot *robot, const er_links *links,
                             const er_direction *direction, const double *wrench,
                             const er_lanes *pull, er_lanes *result)
{
    for (int first = 0; first < ER_LANES; first += ER_WIDTH)
        tangent_from(robot, links, direction, first, wrench, pull, result);
}
