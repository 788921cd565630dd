/* Vectors and rotations in ER_WIDTH states at once, once for every width of `er_real`.
 *
 * Included by kernel_plain.c and kernel_avx2.c, which define er_real (a double, or a vector of one
 * double for each state), ER_WIDTH (states in it) and ER_NAME (names of the functions).
 *
 * Most axes are those of the coordinates, where a turn leaves one component of a vector alone.  So
 * the functions below take `along`, the coordinate axis or ER_ASKEW for any other; where it is a
 * constant, one case of each is left.
 */

#if defined(__GNUC__)
#define ER_INLINE static inline __attribute__((always_inline))
#else
#define ER_INLINE static inline
#endif

typedef struct {
    er_real x, y, z;
} vec;

ER_INLINE er_real load(const double *lanes)
{
    return *(const er_real *)lanes;
}

ER_INLINE vec add(vec a, vec b)
{
    return (vec){a.x + b.x, a.y + b.y, a.z + b.z};
}

ER_INLINE vec cross(vec a, vec b)
{
    return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* a x b for a vector b that is the same in all states. */
ER_INLINE vec cross_fixed(vec a, const double b[3])
{
    return (vec){a.y * b[2] - a.z * b[1], a.z * b[0] - a.x * b[2], a.x * b[1] - a.y * b[0]};
}

ER_INLINE vec scaled(const double v[3], er_real factor)
{
    return (vec){factor * v[0], factor * v[1], factor * v[2]};
}

ER_INLINE vec symmetric_times(const double S[6], vec v)
{
    return (vec){S[0] * v.x + S[3] * v.y + S[4] * v.z, S[3] * v.x + S[1] * v.y + S[5] * v.z,
                 S[4] * v.x + S[5] * v.y + S[2] * v.z};
}

/* a + b factor */
ER_INLINE vec plus(vec a, vec b, er_real factor)
{
    return (vec){a.x + b.x * factor, a.y + b.y * factor, a.z + b.z * factor};
}

ER_INLINE vec minus(vec a, vec b)
{
    return (vec){a.x - b.x, a.y - b.y, a.z - b.z};
}

/* Vectors of ER_WIDTH states from `first` on. */
ER_INLINE vec load_vec(const er_lanes *v, int first)
{
    return (vec){load(&v[0][first]), load(&v[1][first]), load(&v[2][first])};
}

ER_INLINE void store_vec(er_lanes *v, int first, vec value)
{
    *(er_real *)&v[0][first] = value.x;
    *(er_real *)&v[1][first] = value.y;
    *(er_real *)&v[2][first] = value.z;
}

/* A rotation about a fixed axis: rows of R = c I + (1 - c) a a^T + s [a]x; of one along a coordinate
 * axis, its sine and cosine alone. */
typedef struct {
    er_real sine, cosine;
    vec row[3];
} turned;

ER_INLINE turned turn_about(int along, const double a[3], er_real s, er_real c)
{
    turned R;
    if (along == ER_ASKEW) {
        er_real v = 1.0 - c;
        vec va = scaled(a, v), sa = scaled(a, s);
        R.row[0] = (vec){c + va.x * a[0], va.x * a[1] - sa.z, va.x * a[2] + sa.y};
        R.row[1] = (vec){va.y * a[0] + sa.z, c + va.y * a[1], va.y * a[2] - sa.x};
        R.row[2] = (vec){va.z * a[0] - sa.y, va.z * a[1] + sa.x, c + va.z * a[2]};
    } else {
        R.sine = s * a[along];
        R.cosine = c;
    }
    return R;
}

/* From the frame before the rotation to the one behind it: R^T v. */
ER_INLINE vec into(int along, const turned *R, vec v)
{
    er_real s = R->sine, c = R->cosine;
    const vec *r = R->row;
    switch (along) {
    case 0: return (vec){v.x, c * v.y + s * v.z, c * v.z - s * v.y};
    case 1: return (vec){c * v.x - s * v.z, v.y, c * v.z + s * v.x};
    case 2: return (vec){c * v.x + s * v.y, c * v.y - s * v.x, v.z};
    default:
        return (vec){r[0].x * v.x + r[1].x * v.y + r[2].x * v.z,
                     r[0].y * v.x + r[1].y * v.y + r[2].y * v.z,
                     r[0].z * v.x + r[1].z * v.y + r[2].z * v.z};
    }
}

/* And back: R v. */
ER_INLINE vec out_of(int along, const turned *R, vec v)
{
    er_real s = R->sine, c = R->cosine;
    const vec *r = R->row;
    switch (along) {
    case 0: return (vec){v.x, c * v.y - s * v.z, c * v.z + s * v.y};
    case 1: return (vec){c * v.x + s * v.z, v.y, c * v.z - s * v.x};
    case 2: return (vec){c * v.x - s * v.y, c * v.y + s * v.x, v.z};
    default:
        return (vec){r[0].x * v.x + r[0].y * v.y + r[0].z * v.z,
                     r[1].x * v.x + r[1].y * v.y + r[1].z * v.z,
                     r[2].x * v.x + r[2].y * v.y + r[2].z * v.z};
    }
}

/* v + a value */
ER_INLINE vec plus_axis(int along, const double a[3], vec v, er_real value)
{
    switch (along) {
    case 0: v.x += a[0] * value; return v;
    case 1: v.y += a[1] * value; return v;
    case 2: v.z += a[2] * value; return v;
    default: return add(v, scaled(a, value));
    }
}

/* v + b x a value */
ER_INLINE vec plus_cross_axis(int along, const double a[3], vec v, vec b, er_real value)
{
    er_real factor;
    if (along == ER_ASKEW)
        return add(v, cross(b, scaled(a, value)));
    factor = a[along] * value;
    switch (along) {
    case 0: return (vec){v.x, v.y + b.z * factor, v.z - b.y * factor};
    case 1: return (vec){v.x - b.z * factor, v.y, v.z + b.x * factor};
    default: return (vec){v.x + b.y * factor, v.y - b.x * factor, v.z};
    }
}

/* v . a */
ER_INLINE er_real along_axis(int along, const double a[3], vec v)
{
    switch (along) {
    case 0: return a[0] * v.x;
    case 1: return a[1] * v.y;
    case 2: return a[2] * v.z;
    default: return v.x * a[0] + v.y * a[1] + v.z * a[2];
    }
}

/* Does a statement with `along` as a constant. */
#define FOR_AXIS(axis, statement)                                                                   \
    switch (axis) {                                                                                 \
    case 0: { enum { along = 0 }; statement; break; }                                               \
    case 1: { enum { along = 1 }; statement; break; }                                               \
    case 2: { enum { along = 2 }; statement; break; }                                               \
    default: { enum { along = ER_ASKEW }; statement; break; }                                       \
    }
