/* The linear part of a step, once for every width of `er_real`: stage positions, Newton's corrections.
 *
 * Included behind kernel_vector.h; how pairs of complex numbers are multiplied is told by the includer:
 * pair, read_pair, set_real, as_factor, invert, multiply, take_off.
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
    for (int first = 0; first < ER_STAGES; first += ER_WIDTH) {
        er_real node = load(&er_gauss_node[first]);
        for (int k = 0; k < count; k++) {
            er_real once = mix(er_gauss_once, acceleration[k], first);
            er_real twice = mix(er_gauss_twice, acceleration[k], first);
            *(er_real *)&stage_x[k][first] = x[k] + h * (node * v[k] + h * twice);
            *(er_real *)&stage_v[k][first] = v[k] + h * once;
        }
    }
}

static void ER_NAME(spread)(int count, const double *values, er_lanes *lanes)
{
    for (int k = 0; k < count; k++)
        for (int first = 0; first < ER_LANES; first += ER_WIDTH)
            *(er_real *)&lanes[k][first] = values[k] + 0.0 * load(&er_gauss_from_pairs[0][first]);
}

static bool ER_NAME(factor)(int n, er_complex_pair *a, er_factor *factors)
{
    ER_ALIGNED er_complex_pair scaled;
    for (int j = 0; j < n; j++) {
        er_factor *diagonal = &factors[j * n + j];
        if (!invert(&a[j * n + j]))
            return false;
        as_factor(&a[j * n + j], diagonal);
        for (int i = j + 1; i < n; i++) {
            multiply(&a[i * n + j], diagonal, &scaled);
            as_factor(&scaled, &factors[i * n + j]);
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

/* By columns, so that the products of a loop do not wait for each other; by two of them, so that each
 * entry is loaded and stored half as often. */
static void solve_pair(int n, const er_factor *restrict factors, er_complex_pair *restrict b)
{
    for (int j = 0; j + 1 < n; j += 2) {
        pair first = read_pair(&b[j]), second;
        take_off(&b[j + 1], &factors[(j + 1) * n + j], &first);
        second = read_pair(&b[j + 1]);
        for (int i = j + 2; i < n; i++) {
            take_off(&b[i], &factors[i * n + j], &first);
            take_off(&b[i], &factors[i * n + j + 1], &second);
        }
    }
    for (int j = 0; j < n; j++)
        multiply(&b[j], &factors[j * n + j], &b[j]);
    for (int i = n - 1; i > 0; i -= 2) {
        pair first = read_pair(&b[i]), second;
        take_off(&b[i - 1], &factors[i * n + i - 1], &first);
        second = read_pair(&b[i - 1]);
        for (int j = 0; j < i - 1; j++) {
            take_off(&b[j], &factors[i * n + j], &first);
            take_off(&b[j], &factors[(i - 1) * n + j], &second);
        }
    }
}

static double sum_of(const er_lanes lanes)
{
    return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

static double ER_NAME(improve)(int n, const er_factor *factors, const er_lanes *residual,
                               er_lanes *acceleration)
{
    ER_ALIGNED er_complex_pair b[ER_MAX_ANGLES];
    ER_ALIGNED er_lanes square;
    for (int first = 0; first < ER_LANES; first += ER_WIDTH)
        for (int k = 0; k < n; k++)
            *(er_real *)((double *)&b[k] + first) = mix(er_gauss_to_pairs, residual[k], first);
    solve_pair(n, factors, b);
    for (int first = 0; first < ER_STAGES; first += ER_WIDTH) {
        er_real sum = 0.0 * load(&er_gauss_from_pairs[0][first]);
        for (int k = 0; k < n; k++) {
            er_real change = mix(er_gauss_from_pairs, (const double *)&b[k], first);
            *(er_real *)&acceleration[k][first] = load(&acceleration[k][first]) - change;
            sum += change * change;
        }
        *(er_real *)&square[first] = sum;
    }
    return sqrt(sum_of(square));
}

static double ER_NAME(filter)(int n, const er_factor *factors, const double *defect)
{
    ER_ALIGNED er_complex_pair b[ER_MAX_ANGLES];
    ER_ALIGNED er_lanes square;
    for (int k = 0; k < n; k++)
        set_real(&b[k], defect[k]);
    solve_pair(n, factors, b);
    for (int first = 0; first < ER_LANES; first += ER_WIDTH) {
        er_real sum = 0.0 * load(&er_gauss_from_pairs[0][first]);
        for (int k = 0; k < n; k++) {
            er_real part = load((const double *)&b[k] + first);
            sum += part * part;
        }
        *(er_real *)&square[first] = sum;
    }
    return sqrt(square[0] + square[ER_PAIRS]);
}
