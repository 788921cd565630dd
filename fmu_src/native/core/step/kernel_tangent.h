/* The derivative of the loads in kernel_body.h along a direction, for every width of `er_real`.
 *
 * Included behind kernel_body.h.  The recursive Newton-Euler algorithm is differentiated line by
 * line, in the bodies' frames: of v = R^T v_before follows dv = R^T dv_before + (v x axis) dtheta,
 * of f_before = R f follows df_before = R (df + (axis x f) dtheta).
 */
/* What the tangent of the loads needs to know about a motion, once for every width of `er_real`.
 *
 * Included behind kernel_body.h, whose steps over the rotations it takes again and keeps.
 */
ER_INLINE void keep_turn(int along, er_link *link, int first, const turned *R)
{
    if (along == ER_ASKEW) {
        for (int k = 0; k < 3; k++)
            store_vec(link->turn[k], first, R->row[k]);
    } else {
        *(er_real *)&link->turn[0][0][first] = R->sine;
        *(er_real *)&link->turn[0][1][first] = R->cosine;
    }
}

/* The rotation at a link. */
ER_INLINE turned turn_at(int along, const er_link *link, int first)
{
    turned R;
    if (along == ER_ASKEW) {
        for (int k = 0; k < 3; k++)
            R.row[k] = load_vec(link->turn[k], first);
    } else {
        R.sine = load(&link->turn[0][0][first]);
        R.cosine = load(&link->turn[0][1][first]);
    }
    return R;
}

/* Rows of d(omega x (omega x r))/d omega = (omega . r) 1 + omega r^T - 2 r omega^T, for a fixed r. */
ER_INLINE void store_swing(er_vector *rows, int first, vec omega, const double r[3])
{
    er_real along = omega.x * r[0] + omega.y * r[1] + omega.z * r[2];
    vec twice = {2.0 * omega.x, 2.0 * omega.y, 2.0 * omega.z};
    store_vec(rows[0], first, (vec){along + omega.x * r[0] - r[0] * twice.x, omega.x * r[1] - r[0] * twice.y, omega.x * r[2] - r[0] * twice.z});
    store_vec(rows[1], first, (vec){omega.y * r[0] - r[1] * twice.x, along + omega.y * r[1] - r[1] * twice.y, omega.y * r[2] - r[1] * twice.z});
    store_vec(rows[2], first, (vec){omega.z * r[0] - r[2] * twice.x, omega.z * r[1] - r[2] * twice.y, along + omega.z * r[2] - r[2] * twice.z});
}

/* Rows of d(omega x I omega)/d omega = [omega]x I - [I omega]x, for I = xx, yy, zz, xy, xz, yz. */
ER_INLINE void store_wobble(er_vector *rows, int first, vec omega, const double I[6])
{
    vec L = symmetric_times(I, omega);
    store_vec(rows[0], first, (vec){omega.y * I[4] - omega.z * I[3], omega.y * I[5] - omega.z * I[1] + L.z, omega.y * I[2] - omega.z * I[5] - L.y});
    store_vec(rows[1], first, (vec){omega.z * I[0] - omega.x * I[4] - L.z, omega.z * I[3] - omega.x * I[5], omega.z * I[4] - omega.x * I[2] + L.x});
    store_vec(rows[2], first, (vec){omega.x * I[3] - omega.y * I[0] + L.y, omega.x * I[1] - omega.y * I[3] - L.x, omega.x * I[5] - omega.y * I[4]});
}

/* go_out, keeping what the tangent needs of rotation i; and the rows of base_from_last. */
ER_INLINE void link_out(int along, const er_robot *robot, const er_motion *motion, int i, int first,
                        frame_motion *at, vec base[3], er_link *link)
{
    const double *a = robot->rotation[i].axis;
    er_real rate = load(&motion->rate[i][first]), none = 0.0 * rate, one = none + 1.0;
    turned R = turn_of(along, robot, motion, i, first);
    vec zero = {none, none, none};
    keep_turn(along, link, first, &R);
    at->push = into(along, &R, at->push);
    at->spin = into(along, &R, at->spin);
    at->spin_rate = into(along, &R, at->spin_rate);
    store_vec(link->push_by, first, plus_cross_axis(along, a, zero, at->push, one));
    store_vec(link->spin_by, first, plus_cross_axis(along, a, zero, at->spin, one));
    store_vec(link->rate_by, first, plus_cross_axis(along, a, zero, at->spin_rate, one));
    *(er_real *)&link->rate[first] = rate;
    at->spin_rate = plus_cross_axis(along, a, at->spin_rate, at->spin, rate);
    at->spin_rate = plus_axis(along, a, at->spin_rate, load(&motion->acceleration[i][first]));
    at->spin = plus_axis(along, a, at->spin, rate);
    for (int k = 0; k < 3; k++)
        base[k] = into(along, &R, base[k]);
}

/* go_in, likewise. */
ER_INLINE void link_in(int along, const er_robot *robot, int i, int first, vec *force, vec *moment, er_link *link)
{
    const double *a = robot->rotation[i].axis;
    er_real none = 0.0 * load(&link->rate[first]), minus_one = none - 1.0;
    vec zero = {none, none, none};
    turned R = turn_at(along, link, first);
    store_vec(link->force_by, first, plus_cross_axis(along, a, zero, *force, minus_one));
    store_vec(link->moment_by, first, plus_cross_axis(along, a, zero, *moment, minus_one));
    *force = out_of(along, &R, *force);
    *moment = out_of(along, &R, *moment);
}

static void link_from(const er_robot *robot, const er_motion *motion, int first,
                      const double gravity[3], const double *wrench, const er_lanes *pull, er_links *links)
{
    vec forces[ER_MAX_ANGLES], torques[ER_MAX_ANGLES]; /* that a body needs, about its origin */
    er_real none = 0.0 * load(&motion->cosine[0][first]), one = 1.0 + none;
    vec zero = {none, none, none}, force = zero, moment = zero;
    vec base[3] = {{one, none, none}, {none, one, none}, {none, none, one}};
    frame_motion at = {zero, zero, {none - gravity[0], none - gravity[1], none - gravity[2]}, zero, zero};
    int n = robot->angles;

    for (int i = 0; i < n; i++) {
        const er_rotation *rotation = &robot->rotation[i];
        er_link *link = &links->link[i];
        if (rotation->shifted) {
            vec carried = cross_fixed(at.spin, rotation->origin);
            at.push = add(at.push, add(cross_fixed(at.spin_rate, rotation->origin), cross(at.spin, carried)));
            store_swing(link->carry, first, at.spin, rotation->origin);
        }
        FOR_AXIS(rotation->along, link_out(along, robot, motion, i, first, &at, base, link));
        if (rotation->loaded) {
            const er_body *body = &rotation->body;
            vec momentum = symmetric_times(body->inertia, at.spin);
            vec sling = cross_fixed(at.spin, body->moment);
            forces[i] = plus(add(cross_fixed(at.spin_rate, body->moment), cross(at.spin, sling)),
                             at.push, none + body->mass);
            torques[i] = minus(add(symmetric_times(body->inertia, at.spin_rate), cross(at.spin, momentum)),
                               cross_fixed(at.push, body->moment));
            store_swing(link->sling, first, at.spin, body->moment);
            store_wobble(link->wobble, first, at.spin, body->inertia);
        }
    }
    for (int k = 0; k < 3; k++)
        store_vec(links->base[k], first, base[k]);
    if (links->loaded) {
        for (int k = 0; wrench != NULL && k < 3; k++) {
            force = plus(force, base[k], none + wrench[k]);
            moment = plus(moment, base[k], none + wrench[3 + k]);
        }
        for (int k = 0; pull != NULL && k < 3; k++) {
            force = plus(force, base[k], load(&pull[k][first]));
            moment = plus(moment, base[k], load(&pull[3 + k][first]));
        }
        store_vec(links->force, first, force);
        store_vec(links->moment, first, moment);
        moment = minus(cross_fixed(force, robot->tool_position), moment);
        force = minus(zero, force);
    }
    for (int i = n - 1; i >= 0; i--) {
        const er_rotation *rotation = &robot->rotation[i];
        if (rotation->loaded) {
            force = add(force, forces[i]);
            moment = add(moment, torques[i]);
        }
        FOR_AXIS(rotation->along, link_in(along, robot, i, first, &force, &moment, &links->link[i]));
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

/* v + w factor, of a w that is normal to the axis. */
ER_INLINE vec plus_across(int along, vec v, vec w, er_real factor)
{
    if (along != 0)
        v.x += w.x * factor;
    if (along != 1)
        v.y += w.y * factor;
    if (along != 2)
        v.z += w.z * factor;
    return v;
}

/* v + A w for the rows of A. */
ER_INLINE vec plus_product(vec v, const er_vector *rows, int first, vec w)
{
    vec x = load_vec(rows[0], first), y = load_vec(rows[1], first), z = load_vec(rows[2], first);
    return (vec){v.x + x.x * w.x + x.y * w.y + x.z * w.z, v.y + y.x * w.x + y.y * w.y + y.z * w.z,
                 v.z + z.x * w.x + z.y * w.y + z.z * w.z};
}

static void ER_NAME(direct)(const er_robot *robot, double h, const double *x, const double *v,
                            const er_lanes *acceleration, const er_lanes *slope,
                            const double *damping, er_direction *direction, er_lanes *result)
{
    for (int first = 0; first < ER_LANES; first += ER_WIDTH) {
        er_real node = h * load(&er_gauss_node[first]), none = 0.0 * node;
        for (int i = 0; i < robot->angles; i++) {
            int k = robot->rotation[i].elastic;
            er_real angle = none, rate = none, bend = none;
            if (k >= 0) {
                angle = x[k] + node * v[k] + h * h * mix(er_gauss_twice, acceleration[k], first);
                rate = v[k] + h * mix(er_gauss_once, acceleration[k], first);
                bend = load(&acceleration[k][first]);
                *(er_real *)&result[k][first] = load(&slope[k][first]) * angle + damping[k] * rate;
            }
            *(er_real *)&direction->angle[i][first] = angle;
            *(er_real *)&direction->rate[i][first] = rate;
            *(er_real *)&direction->acceleration[i][first] = bend;
        }
    }
}

/* Shift of a frame's origin and its small rotation, behind a rotation that changes by `angle`. */
ER_INLINE void shift_out(int along, const double a[3], const er_link *link, int first, er_real angle,
                         vec *shift, vec *turn)
{
    turned R = turn_at(along, link, first);
    *shift = into(along, &R, *shift);
    *turn = plus_axis(along, a, into(along, &R, *turn), angle);
}

static void ER_NAME(shift)(const er_robot *robot, const er_links *links,
                           const er_direction *direction, er_vector result)
{
    for (int first = 0; first < ER_LANES; first += ER_WIDTH) {
        er_real none = 0.0 * load(&direction->angle[0][first]);
        vec shift = {none, none, none}, turn = shift;
        turned base;
        for (int i = 0; i < robot->angles; i++) {
            const er_rotation *rotation = &robot->rotation[i];
            if (rotation->shifted)
                shift = add(shift, cross_fixed(turn, rotation->origin));
            FOR_AXIS(rotation->along, shift_out(along, rotation->axis, &links->link[i], first,
                               load(&direction->angle[i][first]), &shift, &turn));
        }
        shift = add(shift, cross_fixed(turn, robot->tool_position));
        for (int k = 0; k < 3; k++)
            base.row[k] = load_vec(links->base[k], first);
        store_vec(result, first, out_of(ER_ASKEW, &base, shift));
    }
}

/* How the motion of a frame changes, in its axes. */
typedef struct {
    vec turn; /* its small rotation */
    vec push, spin, spin_rate;
} frame_change;

ER_INLINE void change_out(int along, const double a[3], const er_link *link,
                          const er_direction *direction, int i, int first, bool loaded, frame_change *by)
{
    turned R = turn_at(along, link, first);
    er_real angle = load(&direction->angle[i][first]), rate = load(&direction->rate[i][first]);
    vec spin_by = load_vec(link->spin_by, first);
    by->push = plus_across(along, into(along, &R, by->push), load_vec(link->push_by, first), angle);
    by->spin = plus_across(along, into(along, &R, by->spin), spin_by, angle);
    by->spin_rate = plus_across(along, into(along, &R, by->spin_rate), load_vec(link->rate_by, first), angle);
    by->spin_rate = plus_cross_axis(along, a, by->spin_rate, by->spin, load(&link->rate[first]));
    by->spin_rate = plus_across(along, by->spin_rate, spin_by, rate);
    by->spin_rate = plus_axis(along, a, by->spin_rate, load(&direction->acceleration[i][first]));
    by->spin = plus_axis(along, a, by->spin, rate);
    if (loaded)
        by->turn = plus_axis(along, a, into(along, &R, by->turn), angle);
}

ER_INLINE void change_in(int along, const double a[3], const er_link *link, int first, er_real angle,
                         vec *force, vec *moment, er_real *torque)
{
    turned R = turn_at(along, link, first);
    *torque = along_axis(along, a, *moment);
    *force = plus_across(along, *force, load_vec(link->force_by, first), angle);
    *moment = plus_across(along, *moment, load_vec(link->moment_by, first), angle);
    *force = out_of(along, &R, *force);
    *moment = out_of(along, &R, *moment);
}

static void tangent_from(const er_robot *robot, const er_links *links,
                         const er_direction *direction, int first, const double *wrench,
                         const er_lanes *pull, er_lanes *result)
{
    vec forces[ER_MAX_ANGLES], torques[ER_MAX_ANGLES];
    er_real none = 0.0 * load(&links->base[0][0][first]);
    vec zero = {none, none, none}, force = zero, moment = zero;
    frame_change by = {zero, zero, zero, zero};
    int n = robot->angles;

    for (int i = 0; direction != NULL && i < n; i++) {
        const er_rotation *rotation = &robot->rotation[i];
        const er_link *link = &links->link[i];
        if (rotation->shifted)
            by.push = plus_product(add(by.push, cross_fixed(by.spin_rate, rotation->origin)),
                                   (const er_vector *)link->carry, first, by.spin);
        FOR_AXIS(rotation->along, change_out(along, rotation->axis, link, direction, i, first, links->loaded, &by));
        if (rotation->loaded) {
            const er_body *body = &rotation->body;
            vec swing = symmetric_times(body->inertia, by.spin_rate);
            forces[i] = plus(cross_fixed(by.spin_rate, body->moment), by.push, none + body->mass);
            forces[i] = plus_product(forces[i], (const er_vector *)link->sling, first, by.spin);
            torques[i] = minus(swing, cross_fixed(by.push, body->moment));
            torques[i] = plus_product(torques[i], (const er_vector *)link->wobble, first, by.spin);
        }
    }
    if (links->loaded) { /* the wrench keeps its direction in base axes */
        force = cross(load_vec(links->force, first), by.turn);
        moment = cross(load_vec(links->moment, first), by.turn);
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
        er_real angle = direction != NULL ? load(&direction->angle[i][first]) : none, torque;
        if (rotation->loaded && direction != NULL) {
            force = add(force, forces[i]);
            moment = add(moment, torques[i]);
        }
        FOR_AXIS(rotation->along, change_in(along, rotation->axis, &links->link[i], first, angle,
                                            &force, &moment, &torque));
        if (rotation->elastic >= 0)
            *(er_real *)&result[rotation->elastic][first] += torque;
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
