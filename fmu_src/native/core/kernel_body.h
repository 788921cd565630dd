/* The functions of kernel.h, once for every width of `er_real`.
 *
 * Included by kernel_plain.c and kernel_avx2.c, which define er_real (a double, or a vector of one
 * double for each state), ER_WIDTH (states in it), ER_NAME (names of the functions) and how pairs of
 * complex numbers are multiplied: factor_pair, as_factor, multiply, take_off.
 */

/* Beyond this change [rad] sines come from libm; below it the series are exact to rounding. */
#define SMALL_CHANGE 0.1

typedef struct {
    er_real x, y, z;
} vec;

static inline er_real load(const double *lanes)
{
    return *(const er_real *)lanes;
}

static inline vec add(vec a, vec b)
{
    return (vec){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline vec cross(vec a, vec b)
{
    return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* a x b for a vector b that is the same in all states. */
static inline vec cross_fixed(vec a, const double b[3])
{
    return (vec){a.y * b[2] - a.z * b[1], a.z * b[0] - a.x * b[2], a.x * b[1] - a.y * b[0]};
}

static inline vec scaled(const double v[3], er_real factor)
{
    return (vec){factor * v[0], factor * v[1], factor * v[2]};
}

static inline vec symmetric_times(const double S[6], vec v)
{
    return (vec){S[0] * v.x + S[3] * v.y + S[4] * v.z, S[3] * v.x + S[1] * v.y + S[5] * v.z,
                 S[4] * v.x + S[5] * v.y + S[2] * v.z};
}

/* A rotation about a fixed axis: rows of R = c I + (1 - c) a a^T + s [a]x. */
typedef struct {
    vec row[3];
} turned;

static inline turned turn_about(const double a[3], er_real s, er_real c)
{
    er_real v = 1.0 - c;
    vec va = scaled(a, v), sa = scaled(a, s);
    return (turned){{
        {c + va.x * a[0], va.x * a[1] - sa.z, va.x * a[2] + sa.y},
        {va.y * a[0] + sa.z, c + va.y * a[1], va.y * a[2] - sa.x},
        {va.z * a[0] - sa.y, va.z * a[1] + sa.x, c + va.z * a[2]},
    }};
}

/* From the frame before the rotation to the one behind it: R^T v. */
static inline vec into(const turned *R, vec v)
{
    const vec *r = R->row;
    return (vec){r[0].x * v.x + r[1].x * v.y + r[2].x * v.z,
                 r[0].y * v.x + r[1].y * v.y + r[2].y * v.z,
                 r[0].z * v.x + r[1].z * v.y + r[2].z * v.z};
}

/* And back: R v. */
static inline vec out_of(const turned *R, vec v)
{
    const vec *r = R->row;
    return (vec){r[0].x * v.x + r[0].y * v.y + r[0].z * v.z,
                 r[1].x * v.x + r[1].y * v.y + r[1].z * v.z,
                 r[2].x * v.x + r[2].y * v.y + r[2].z * v.z};
}

/* Vectors of ER_WIDTH states from `first` on. */
static inline vec load_vec(const er_lanes *v, int first)
{
    return (vec){load(&v[0][first]), load(&v[1][first]), load(&v[2][first])};
}

static inline void store_vec(er_lanes *v, int first, vec value)
{
    *(er_real *)&v[0][first] = value.x;
    *(er_real *)&v[1][first] = value.y;
    *(er_real *)&v[2][first] = value.z;
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
            turned R = turn_about(rotation->axis, load(&motion->sine[i][first]),
                                  load(&motion->cosine[i][first]));
            reach = out_of(&R, reach);
            if (rotation->shifted)
                reach = (vec){reach.x + origin[0], reach.y + origin[1], reach.z + origin[2]};
        }
        store_vec(position, first, reach);
    }
}

/* The recursive Newton-Euler algorithm in the bodies' frames: ER_WIDTH states from `first` on. */
static void loads_from(const er_robot *robot, const er_motion *motion, int first,
                       const double gravity[3], const double *wrench, const er_lanes *pull,
                       er_lanes *result)
{
    static const double zero[3] = {0.0, 0.0, 0.0};
    const double *force_at_base = wrench != NULL ? wrench : zero;
    const double *moment_at_base = wrench != NULL ? wrench + 3 : zero;
    turned turns[ER_MAX_ANGLES];
    vec forces[ER_MAX_ANGLES], torques[ER_MAX_ANGLES]; /* that a body needs, about its origin */
    er_real none = 0.0 * load(&motion->cosine[0][first]);
    vec spin = {none, none, none}, spin_rate = spin; /* omega, omega' */
    /* A base that accelerates upwards stands for gravity. */
    vec push = {none - gravity[0], none - gravity[1], none - gravity[2]};
    vec force = {none + force_at_base[0], none + force_at_base[1], none + force_at_base[2]};
    vec moment = {none + moment_at_base[0], none + moment_at_base[1], none + moment_at_base[2]};
    bool loaded = wrench != NULL || pull != NULL;
    int n = robot->angles;

    if (pull != NULL) {
        force = add(force, load_vec(pull, first));
        moment = add(moment, load_vec(pull + 3, first));
    }
    for (int i = 0; i < n; i++) {
        const er_rotation *rotation = &robot->rotation[i];
        er_real rate = load(&motion->rate[i][first]);
        turned *R = &turns[i];
        vec own = scaled(rotation->axis, rate);
        *R = turn_about(rotation->axis, load(&motion->sine[i][first]),
                        load(&motion->cosine[i][first]));
        if (rotation->shifted)
            push = add(push, add(cross_fixed(spin_rate, rotation->origin),
                                 cross(spin, cross_fixed(spin, rotation->origin))));
        push = into(R, push);
        spin = into(R, spin);
        spin_rate = add(into(R, spin_rate), cross(spin, own));
        spin_rate = add(spin_rate,
                        scaled(rotation->axis, load(&motion->acceleration[i][first])));
        spin = add(spin, own);
        if (loaded) {
            force = into(R, force);
            moment = into(R, moment);
        }
        if (rotation->loaded) {
            const er_body *body = &rotation->body;
            vec sling = add(cross_fixed(spin_rate, body->moment),
                            cross(spin, cross_fixed(spin, body->moment)));
            vec weight = cross_fixed(push, body->moment);
            vec wobble = cross(spin, symmetric_times(body->inertia, spin));
            vec swing = symmetric_times(body->inertia, spin_rate);
            forces[i] = (vec){body->mass * push.x + sling.x, body->mass * push.y + sling.y,
                              body->mass * push.z + sling.z};
            torques[i] = (vec){swing.x + wobble.x - weight.x, swing.y + wobble.y - weight.y,
                               swing.z + wobble.z - weight.z};
        }
    }
    if (loaded) { /* what acts on the tool need not be carried by the joints */
        vec lever = cross_fixed(force, robot->tool_position);
        force = (vec){-force.x, -force.y, -force.z};
        moment = (vec){lever.x - moment.x, lever.y - moment.y, lever.z - moment.z};
    }
    for (int i = n - 1; i >= 0; i--) {
        const er_rotation *rotation = &robot->rotation[i];
        if (rotation->loaded) {
            force = add(force, forces[i]);
            moment = add(moment, torques[i]);
        }
        if (rotation->elastic >= 0) {
            const double *a = rotation->axis;
            *(er_real *)&result[rotation->elastic][first] =
                moment.x * a[0] + moment.y * a[1] + moment.z * a[2];
        }
        force = out_of(&turns[i], force);
        moment = out_of(&turns[i], moment);
        if (rotation->shifted) {
            vec lever = cross_fixed(force, rotation->origin);
            moment = (vec){moment.x - lever.x, moment.y - lever.y, moment.z - lever.z};
        }
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

/* sum_j column_j value_j, from lane `first` on. */
static inline er_real mix(const er_lanes *columns, const double *values, int first)
{
    er_real sum = load(&columns[0][first]) * values[0];
    for (int j = 1; j < ER_LANES; j++)
        sum += load(&columns[j][first]) * values[j];
    return sum;
}

static void ER_NAME(stages)(int count, double h, const double *x, const double *v,
                            const er_lanes *acceleration, er_lanes *stage_x, er_lanes *stage_v)
{
    ER_ALIGNED er_lanes once[ER_STAGES], twice[ER_STAGES], node;
    for (int i = 0; i < ER_STAGES; i++) {
        node[i] = h * er_gauss_node[i];
        for (int j = 0; j < ER_STAGES; j++) {
            once[j][i] = h * er_gauss_once[i][j];
            twice[j][i] = h * h * er_gauss_twice[i][j];
        }
    }
    for (int k = 0; k < count; k++)
        for (int first = 0; first < ER_STAGES; first += ER_WIDTH) {
            *(er_real *)&stage_x[k][first] =
                x[k] + load(&node[first]) * v[k] + mix((const er_lanes *)twice, acceleration[k], first);
            *(er_real *)&stage_v[k][first] = v[k] + mix((const er_lanes *)once, acceleration[k], first);
        }
}

/* Overwrites d with 1 / d; false where that is not finite. */
static inline bool invert(er_complex_pair *d)
{
    for (int p = 0; p < ER_PAIRS; p++) {
        double size = d->re[p] * d->re[p] + d->im[p] * d->im[p];
        if (!(size > 0.0 && size < INFINITY))
            return false;
        d->re[p] /= size;
        d->im[p] /= -size;
    }
    return true;
}

static bool ER_NAME(factor)(int n, er_complex_pair *a)
{
    for (int j = 0; j < n; j++) {
        ER_ALIGNED er_complex_pair scaled_column[ER_MAX_ANGLES];
        factor_pair inverse;
        if (!invert(&a[j * n + j]))
            return false;
        inverse = as_factor(&a[j * n + j]);
        for (int i = j + 1; i < n; i++) {
            scaled_column[i] = a[i * n + j];
            multiply(&scaled_column[i], inverse);
        }
        for (int i = j + 1; i < n; i++) {
            factor_pair scaled = as_factor(&scaled_column[i]);
            for (int k = j + 1; k <= i; k++)
                take_off(&a[i * n + k], &a[k * n + j], scaled);
        }
        for (int i = j + 1; i < n; i++)
            a[i * n + j] = scaled_column[i];
    }
    return true;
}

/* By columns, so that the products of a loop do not wait for each other. */
static void solve_pair(int n, const er_complex_pair *a, er_complex_pair *b)
{
    for (int j = 0; j < n; j++) {
        factor_pair known = as_factor(&b[j]);
        for (int i = j + 1; i < n; i++)
            take_off(&b[i], &a[i * n + j], known);
    }
    for (int j = 0; j < n; j++)
        multiply(&b[j], as_factor(&a[j * n + j]));
    for (int i = n - 1; i > 0; i--) {
        factor_pair known = as_factor(&b[i]);
        for (int j = 0; j < i; j++)
            take_off(&b[j], &a[i * n + j], known);
    }
}

static double ER_NAME(improve)(int n, const er_complex_pair *factors, const er_lanes *residual,
                               er_lanes *acceleration)
{
    ER_ALIGNED er_complex_pair b[ER_MAX_ANGLES];
    ER_ALIGNED er_lanes to[ER_STAGES], back[2 * ER_PAIRS];
    double square = 0.0;
    /* A pair of complex numbers is four lanes too: two real parts, two imaginary ones. */
    for (int j = 0; j < ER_STAGES; j++)
        for (int p = 0; p < ER_PAIRS; p++) {
            to[j][p] = er_gauss_to_re[p][j];
            to[j][ER_PAIRS + p] = er_gauss_to_im[p][j];
            back[p][j] = 2.0 * er_gauss_back_re[p][j];
            back[ER_PAIRS + p][j] = -2.0 * er_gauss_back_im[p][j];
        }
    for (int k = 0; k < n; k++)
        for (int first = 0; first < ER_LANES; first += ER_WIDTH)
            *(er_real *)((double *)&b[k] + first) = mix((const er_lanes *)to, residual[k], first);
    solve_pair(n, factors, b);
    for (int k = 0; k < n; k++)
        for (int first = 0; first < ER_STAGES; first += ER_WIDTH) {
            er_lanes correction;
            er_real change = mix((const er_lanes *)back, (const double *)&b[k], first);
            *(er_real *)&acceleration[k][first] = load(&acceleration[k][first]) - change;
            memcpy(correction, &change, sizeof change);
            for (int l = 0; l < ER_WIDTH; l++)
                square += correction[l] * correction[l];
        }
    return sqrt(square);
}

static double ER_NAME(filter)(int n, const er_complex_pair *factors, const double *defect)
{
    ER_ALIGNED er_complex_pair b[ER_MAX_ANGLES];
    double square = 0.0;
    for (int k = 0; k < n; k++)
        b[k] = (er_complex_pair){{defect[k], defect[k]}, {0.0, 0.0}};
    solve_pair(n, factors, b);
    for (int k = 0; k < n; k++)
        square += b[k].re[0] * b[k].re[0] + b[k].im[0] * b[k].im[0];
    return sqrt(square);
}

#undef SMALL_CHANGE
