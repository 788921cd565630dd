/* Loads of the chain and their derivatives in base axes, once for every width of `er_real`.
 *
 * Spatial vectors about the base's origin: velocities l of the point there and w about it, forces f, and moments n
 * about it.  The derivatives are those of Singh, Russell and Wensing (2022, docs/references.md): with S the axis of a
 * rotation, P = v x S and A = a x S + v x P of the frame before it, and sums over all bodies beyond a rotation,
 *
 *     d tau_i / d theta_j   = (2 B^T S_i) P_j + (I S_i) A_j                     for j at or before i,
 *     d tau_j / d theta_i   = S_j (2 B P_i + I A_i + S_i x* F)                  for j before i,
 *     d tau_i / d theta_j'  = (2 B^T S_i) S_j + 2 (I S_i) P_j,   d tau_j / d theta_i' = S_j (2 B S_i + 2 I P_i),
 *     d tau_i / d theta_j'' = (I S_i) S_j,
 *
 * where with momentum p, moment of momentum L, and G the rate of the inertia about the origin
 *
 *     2 B (l, w) = (2 w x p,  G w + w x L),      2 B^T (l, w) = (0,  2 p x l + G w + L x w).
 *
 * Included behind kernel_vector.h.
 */

/* A symmetric matrix. */
typedef struct {
    er_real xx, yy, zz, xy, xz, yz;
} symmetric;

/* Velocity or force. */
typedef struct {
    vec linear, angular;
} spatial;

/* Bodies beyond a rotation, and how they move. */
typedef struct {
    double mass;
    vec moment, momentum, spin; /* first moment, p, L */
    symmetric inertia, growth;  /* about the origin; G */
    spatial force;
} bodies;

/* A rotation of the chain. */
typedef struct {
    spatial axis, drift, swing; /* S, P, A */
    bodies body;
} joint_motion;

ER_INLINE er_real dot(vec a, vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

ER_INLINE vec times(vec a, er_real factor)
{
    return (vec){a.x * factor, a.y * factor, a.z * factor};
}

ER_INLINE vec multiple(vec a, double factor)
{
    return (vec){a.x * factor, a.y * factor, a.z * factor};
}

ER_INLINE vec apply(const symmetric *S, vec v)
{
    return (vec){S->xx * v.x + S->xy * v.y + S->xz * v.z, S->xy * v.x + S->yy * v.y + S->yz * v.z,
                 S->xz * v.x + S->yz * v.y + S->zz * v.z};
}

ER_INLINE void add_symmetric(symmetric *sum, const symmetric *other)
{
    sum->xx += other->xx, sum->yy += other->yy, sum->zz += other->zz;
    sum->xy += other->xy, sum->xz += other->xz, sum->yz += other->yz;
}

/* S += a b^T + b a^T - 2 (a . b) 1 */
ER_INLINE void add_pair(symmetric *S, vec a, vec b)
{
    er_real x = a.x * b.x, y = a.y * b.y, z = a.z * b.z;
    S->xx -= 2.0 * (y + z), S->yy -= 2.0 * (x + z), S->zz -= 2.0 * (x + y);
    S->xy += a.x * b.y + a.y * b.x, S->xz += a.x * b.z + a.z * b.x, S->yz += a.y * b.z + a.z * b.y;
}

ER_INLINE er_real power(spatial a, spatial b)
{
    return dot(a.linear, b.linear) + dot(a.angular, b.angular);
}

ER_INLINE spatial add_spatial(spatial a, spatial b)
{
    return (spatial){add(a.linear, b.linear), add(a.angular, b.angular)};
}

/* v x m of velocities. */
ER_INLINE spatial cross_motion(spatial v, spatial m)
{
    return (spatial){add(cross(v.angular, m.linear), cross(v.linear, m.angular)), cross(v.angular, m.angular)};
}

/* I v */
ER_INLINE spatial carried_by(const bodies *b, spatial v)
{
    vec swept = cross(v.angular, b->moment);
    return (spatial){add(multiple(v.linear, b->mass), swept),
                     add(cross(b->moment, v.linear), apply(&b->inertia, v.angular))};
}

/* 2 B v, of which w alone counts. */
ER_INLINE spatial twisted(const bodies *b, vec w)
{
    return (spatial){multiple(cross(w, b->momentum), 2.0), add(apply(&b->growth, w), cross(w, b->spin))};
}

/* The moment of 2 B^T v: it has no force. */
ER_INLINE vec twisted_back(const bodies *b, spatial v)
{
    vec about = add(apply(&b->growth, v.angular), cross(b->spin, v.angular));
    return add(about, multiple(cross(b->momentum, v.linear), 2.0));
}

/* Columns of a frame in base axes. */
typedef struct {
    vec column[3];
} frame;

ER_INLINE vec seen_from_base(const frame *at, const double v[3])
{
    vec sum = multiple(at->column[0], v[0]);
    sum = add(sum, multiple(at->column[1], v[1]));
    return add(sum, multiple(at->column[2], v[2]));
}

ER_INLINE void turn_columns(int along, const double axis[3], er_real s, er_real c, frame *at)
{
    if (along == ER_ASKEW) {
        turned R = turn_about(ER_ASKEW, axis, s, c);
        const frame before = *at;
        const vec *r = R.row;
        const er_real by[3][3] = {{r[0].x, r[1].x, r[2].x}, {r[0].y, r[1].y, r[2].y}, {r[0].z, r[1].z, r[2].z}};
        for (int j = 0; j < 3; j++)
            at->column[j] = plus(plus(times(before.column[0], by[j][0]), before.column[1], by[j][1]),
                                 before.column[2], by[j][2]);
    } else {
        vec *first = &at->column[(along + 1) % 3], *second = &at->column[(along + 2) % 3];
        const vec p = *first, q = *second;
        s = s * axis[along];
        *first = plus(times(p, c), q, s);
        *second = plus(times(q, c), p, -s);
    }
}

/* A body that moves: its inertia about the base's origin, and what comes of that. */
static void move_body(const er_body *body, const frame *at, vec origin, spatial v, spatial a, bodies *moved)
{
    const double *I = body->inertia, m = body->mass;
    const double rows[3][3] = {{I[0], I[3], I[4]}, {I[3], I[1], I[5]}, {I[4], I[5], I[2]}};
    vec local = seen_from_base(at, body->moment), half[3], twice;
    er_real square = dot(origin, origin) * m + 2.0 * dot(origin, local);
    symmetric J;
    const vec *X = at->column;
    spatial carried;
    for (int k = 0; k < 3; k++)
        half[k] = seen_from_base(at, rows[k]);
    J.xx = half[0].x * X[0].x + half[1].x * X[1].x + half[2].x * X[2].x;
    J.yy = half[0].y * X[0].y + half[1].y * X[1].y + half[2].y * X[2].y;
    J.zz = half[0].z * X[0].z + half[1].z * X[1].z + half[2].z * X[2].z;
    J.xy = half[0].x * X[0].y + half[1].x * X[1].y + half[2].x * X[2].y;
    J.xz = half[0].x * X[0].z + half[1].x * X[1].z + half[2].x * X[2].z;
    J.yz = half[0].y * X[0].z + half[1].y * X[1].z + half[2].y * X[2].z;
    /* Steiner's theorem, by m o + 2 h of the origin o and the first moment h about it. */
    twice = add(multiple(local, 2.0), multiple(origin, m));
    J.xx += square - origin.x * twice.x, J.yy += square - origin.y * twice.y, J.zz += square - origin.z * twice.z;
    J.xy -= origin.x * origin.y * m + origin.x * local.y + origin.y * local.x;
    J.xz -= origin.x * origin.z * m + origin.x * local.z + origin.z * local.x;
    J.yz -= origin.y * origin.z * m + origin.y * local.z + origin.z * local.y;
    moved->mass = m;
    moved->moment = add(local, multiple(origin, m));
    moved->inertia = J;
    carried = carried_by(moved, v);
    moved->momentum = carried.linear;
    moved->spin = carried.angular;
    moved->force = carried_by(moved, a);
    moved->force.linear = add(moved->force.linear, cross(v.angular, carried.linear));
    moved->force.angular = add(moved->force.angular,
                               add(cross(v.angular, carried.angular), cross(v.linear, carried.linear)));
}

/* G = [w]J - J[w] - ([l][h] + [h][l]) */
static void find_growth(spatial v, bodies *b)
{
    const symmetric *J = &b->inertia;
    vec w = v.angular, l = v.linear, minus_l = {-l.x, -l.y, -l.z};
    vec x = cross(w, (vec){J->xx, J->xy, J->xz}), y = cross(w, (vec){J->xy, J->yy, J->yz});
    vec z = cross(w, (vec){J->xz, J->yz, J->zz});
    b->growth = (symmetric){2.0 * x.x, 2.0 * y.y, 2.0 * z.z, x.y + y.x, x.z + z.x, y.z + z.y};
    add_pair(&b->growth, minus_l, b->moment);
}

static void add_bodies(bodies *sum, const bodies *other)
{
    sum->mass += other->mass;
    sum->moment = add(sum->moment, other->moment);
    add_symmetric(&sum->inertia, &other->inertia);
    sum->force = add_spatial(sum->force, other->force);
}

static void add_moving_bodies(bodies *sum, const bodies *other)
{
    add_bodies(sum, other);
    sum->momentum = add(sum->momentum, other->momentum);
    sum->spin = add(sum->spin, other->spin);
    add_symmetric(&sum->growth, &other->growth);
}

/* Goes out over all rotations, ER_WIDTH states from `first` on; `growing`: G is wanted. */
static void place_chain(const er_robot *robot, const er_motion *motion, int first, bool growing,
                        joint_motion *joints, er_link_state *state)
{
    er_real none = 0.0 * load(&motion->cosine[0][first]), one = 1.0 + none;
    const double *g = robot->parameters.gravity;
    vec zero = {none, none, none}, origin = zero, tool;
    frame at = {{{one, none, none}, {none, one, none}, {none, none, one}}};
    spatial v = {zero, zero}, a = {{none - g[0], none - g[1], none - g[2]}, zero};
    for (int i = 0; i < robot->angles; i++) {
        const er_rotation *rotation = &robot->rotation[i];
        joint_motion *joint = &joints[i];
        er_real s = load(&motion->sine[i][first]), c = load(&motion->cosine[i][first]);
        er_real rate = load(&motion->rate[i][first]), bend = load(&motion->acceleration[i][first]);
        if (rotation->shifted)
            origin = add(origin, seen_from_base(&at, rotation->origin));
        FOR_AXIS(rotation->along, turn_columns(along, rotation->axis, s, c, &at));
        vec axis = seen_from_base(&at, rotation->axis);
        joint->axis = (spatial){cross(origin, axis), axis};
        joint->drift = cross_motion(v, joint->axis);
        joint->swing = add_spatial(cross_motion(a, joint->axis), cross_motion(v, joint->drift));
        v.linear = plus(v.linear, joint->axis.linear, rate);
        v.angular = plus(v.angular, axis, rate);
        a.linear = plus(plus(a.linear, joint->axis.linear, bend), joint->drift.linear, rate);
        a.angular = plus(plus(a.angular, axis, bend), joint->drift.angular, rate);
        if (rotation->loaded) {
            move_body(&rotation->body, &at, origin, v, a, &joint->body);
            if (growing)
                find_growth(v, &joint->body);
        }
    }
    tool = add(origin, seen_from_base(&at, robot->tool_position));
    store_vec(state->position, first, tool);
    for (int k = 0; k < 3; k++) {
        const double *R = robot->tool_rotation;
        const double column[3] = {R[k], R[3 + k], R[6 + k]};
        vec seen = seen_from_base(&at, column);
        *(er_real *)&state->rotation[k][first] = seen.x;
        *(er_real *)&state->rotation[3 + k][first] = seen.y;
        *(er_real *)&state->rotation[6 + k][first] = seen.z;
    }
}

static bodies no_bodies(er_real none)
{
    vec zero = {none, none, none};
    symmetric empty = {none, none, none, none, none, none};
    return (bodies){0.0, zero, zero, zero, empty, empty, {zero, zero}};
}

static void ER_NAME(link_loads)(const er_robot *robot, const er_motion *motion, const er_lanes *wrench,
                                er_link_state *state)
{
    joint_motion joints[ER_MAX_ANGLES];
    for (int first = 0; first < ER_LANES; first += ER_WIDTH) {
        vec force = load_vec(wrench, first), moment = load_vec(wrench + 3, first);
        bodies beyond = no_bodies(0.0 * force.x);
        place_chain(robot, motion, first, false, joints, state);
        vec tool = load_vec(state->position, first);
        for (int i = robot->angles - 1; i >= 0; i--) {
            spatial axis = joints[i].axis;
            if (robot->rotation[i].loaded)
                add_bodies(&beyond, &joints[i].body);
            *(er_real *)&state->load[i][first] = power(axis, beyond.force) -
                                                 dot(add(axis.linear, cross(axis.angular, tool)), force) -
                                                 dot(axis.angular, moment);
        }
    }
}

/* Derivatives of the wanted loads by angle i, and of load i by those before it. */
static void find_gradients(const er_wanted *wanted, const joint_motion *joints, const bodies *beyond, int i, int first,
                           vec lever, vec force, vec moment, er_link_derivatives *by)
{
    spatial S = joints[i].axis, P = joints[i].drift, A = joints[i].swing, F = beyond->force;
    spatial carried = carried_by(beyond, S);
    vec pulled = cross(lever, force);
    int row = wanted->row[i];
    if (row >= 0) {
        vec back = twisted_back(beyond, S), turned_moment = cross(S.angular, moment);
        for (int j = 0; j <= i; j++) {
            const joint_motion *before = &joints[j];
            vec axis = before->axis.angular;
            er_real by_angle = dot(back, before->drift.angular) + power(carried, before->swing) - dot(axis, pulled);
            if (j < i)
                by_angle = by_angle - dot(axis, turned_moment);
            *(er_real *)&by->load[0][row][j][first] = by_angle;
            *(er_real *)&by->load[1][row][j][first] = dot(back, axis) + 2.0 * power(carried, before->drift);
            *(er_real *)&by->load[2][row][j][first] = power(carried, before->axis);
        }
    }
    spatial by_angle = add_spatial(twisted(beyond, P.angular), carried_by(beyond, A));
    by_angle.linear = add(by_angle.linear, cross(S.angular, F.linear));
    by_angle.angular = add(by_angle.angular, add(cross(S.angular, F.angular), cross(S.linear, F.linear)));
    by_angle.angular = minus(by_angle.angular, pulled);
    spatial by_rate = carried_by(beyond, P);
    by_rate = add_spatial(twisted(beyond, S.angular), add_spatial(by_rate, by_rate));
    for (int k = 0; k < wanted->count; k++) {
        int j = wanted->angle[k];
        if (j >= i)
            break;
        *(er_real *)&by->load[0][k][i][first] = power(joints[j].axis, by_angle);
        *(er_real *)&by->load[1][k][i][first] = power(joints[j].axis, by_rate);
        *(er_real *)&by->load[2][k][i][first] = power(joints[j].axis, carried);
    }
}

static void ER_NAME(linearise)(const er_robot *robot, const er_motion *motion, const er_lanes *wrench,
                               const er_wanted *wanted, er_link_state *state, er_link_derivatives *by)
{
    joint_motion joints[ER_MAX_ANGLES];
    for (int first = 0; first < ER_LANES; first += ER_WIDTH) {
        vec force = load_vec(wrench, first), moment = load_vec(wrench + 3, first);
        bodies beyond = no_bodies(0.0 * force.x);
        place_chain(robot, motion, first, true, joints, state);
        vec tool = load_vec(state->position, first);
        for (int i = robot->angles - 1; i >= 0; i--) {
            spatial axis = joints[i].axis;
            vec lever = add(axis.linear, cross(axis.angular, tool));
            if (robot->rotation[i].loaded)
                add_moving_bodies(&beyond, &joints[i].body);
            *(er_real *)&by->jacobian[0][i][first] = lever.x;
            *(er_real *)&by->jacobian[1][i][first] = lever.y;
            *(er_real *)&by->jacobian[2][i][first] = lever.z;
            *(er_real *)&by->jacobian[3][i][first] = axis.angular.x;
            *(er_real *)&by->jacobian[4][i][first] = axis.angular.y;
            *(er_real *)&by->jacobian[5][i][first] = axis.angular.z;
            *(er_real *)&state->load[i][first] = power(axis, beyond.force) - dot(lever, force) -
                                                 dot(axis.angular, moment);
            find_gradients(wanted, joints, &beyond, i, first, lever, force, moment, by);
        }
    }
}
