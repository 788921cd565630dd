/* The linear part of a step, once for every width of `er_real`: stage positions, Newton's corrections.
 *
 * Included behind kernel_vector.h; how pairs of complex numbers are multiplied is told by the includer:
 * pair, read_pair, as_factor, multiply, take_off.
 */

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

static bool ER_NAME(factor)(int n, er_complex_pair *a, er_factor *factors)
{
    ER_ALIGNED er_complex_pair scaled[ER_MAX_ANGLES];
    for (int j = 0; j < n; j++) {
        er_factor *diagonal = &factors[j * n + j];
        if (!invert(&a[j * n + j]))
            return false;
        as_factor(&a[j * n + j], diagonal);
        for (int i = j + 1; i < n; i++) {
            scaled[i] = a[i * n + j];
            multiply(&scaled[i], diagonal);
            as_factor(&scaled[i], &factors[i * n + j]);
        }
        for (int i = j + 1; i < n; i++) {
            const er_factor factor = factors[i * n + j];
            for (int k = j + 1; k <= i; k++) {
                pair column = read_pair(&a[k * n + j]);
                take_off(&a[i * n + k], &factor, &column);
            }
        }
    }
    return true;
}

/* By columns, so that the products of a loop do not wait for each other. */
static void solve_pair(int n, const er_factor *factors, er_complex_pair *b)
{
    for (int j = 0; j < n; j++) {
        pair known = read_pair(&b[j]);
        for (int i = j + 1; i < n; i++)
            take_off(&b[i], &factors[i * n + j], &known);
    }
    for (int j = 0; j < n; j++)
        multiply(&b[j], &factors[j * n + j]);
    for (int i = n - 1; i > 0; i--) {
        pair known = read_pair(&b[i]);
        for (int j = 0; j < i; j++)
            take_off(&b[j], &factors[i * n + j], &known);
    }
}

static double ER_NAME(improve)(int n, const er_factor *factors, const er_lanes *residual,
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

static double ER_NAME(filter)(int n, const er_factor *factors, const double *defect)
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
