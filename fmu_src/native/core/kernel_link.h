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
    store_vec(rows[0], first, (vec){along + omega.x * r[0] - r[0] * twice.x,
                                    omega.x * r[1] - r[0] * twice.y, omega.x * r[2] - r[0] * twice.z});
    store_vec(rows[1], first, (vec){omega.y * r[0] - r[1] * twice.x,
                                    along + omega.y * r[1] - r[1] * twice.y,
                                    omega.y * r[2] - r[1] * twice.z});
    store_vec(rows[2], first, (vec){omega.z * r[0] - r[2] * twice.x, omega.z * r[1] - r[2] * twice.y,
                                    along + omega.z * r[2] - r[2] * twice.z});
}

/* Rows of d(omega x I omega)/d omega = [omega]x I - [I omega]x, for I = xx, yy, zz, xy, xz, yz. */
ER_INLINE void store_wobble(er_vector *rows, int first, vec omega, const double I[6])
{
    vec L = symmetric_times(I, omega);
    store_vec(rows[0], first, (vec){omega.y * I[4] - omega.z * I[3],
                                    omega.y * I[5] - omega.z * I[1] + L.z,
                                    omega.y * I[2] - omega.z * I[5] - L.y});
    store_vec(rows[1], first, (vec){omega.z * I[0] - omega.x * I[4] - L.z,
                                    omega.z * I[3] - omega.x * I[5],
                                    omega.z * I[4] - omega.x * I[2] + L.x});
    store_vec(rows[2], first, (vec){omega.x * I[3] - omega.y * I[0] + L.y,
                                    omega.x * I[1] - omega.y * I[3] - L.x,
                                    omega.x * I[5] - omega.y * I[4]});
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
ER_INLINE void link_in(int along, const er_robot *robot, int i, int first, vec *force, vec *moment,
                       er_link *link)
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
                      const double gravity[3], const double *wrench, const er_lanes *pull,
                      er_links *links)
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
            at.push = add(at.push,
                          add(cross_fixed(at.spin_rate, rotation->origin), cross(at.spin, carried)));
            store_swing(link->carry, first, at.spin, rotation->origin);
        }
        FOR_AXIS(rotation->along, link_out(along, robot, motion, i, first, &at, base, link));
        if (rotation->loaded) {
            const er_body *body = &rotation->body;
            vec momentum = symmetric_times(body->inertia, at.spin);
            vec sling = cross_fixed(at.spin, body->moment);
            forces[i] = plus(add(cross_fixed(at.spin_rate, body->moment), cross(at.spin, sling)),
                             at.push, none + body->mass);
            torques[i] = minus(add(symmetric_times(body->inertia, at.spin_rate),
                                   cross(at.spin, momentum)),
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
        FOR_AXIS(rotation->along,
                 link_in(along, robot, i, first, &force, &moment, &links->link[i]));
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
