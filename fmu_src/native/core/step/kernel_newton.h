/* The linear part of a step, once for every width of `er_real`: stage positions, Newton's corrections; and the motors
 * at its nodes.
 *
 * Included behind kernel_vector.h, by a file that includes motors.h; how pairs of complex numbers are multiplied is
 * told by the includer: pair, read_pair, set_real, as_factor, take_reciprocal, multiply, take_off, and the sums of
 * products: product, as_product, product_of, add_product, write_product.
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

static void ER_NAME(finish)(int count, double h, const er_lanes *acceleration, double *x, double *v)
{
    for (int k = 0; k < count; k++) {
        double rate = 0.0, position = 0.0;
        for (int j = 0; j < ER_STAGES; j++) {
            rate += er_gauss_end_rate[j] * acceleration[k][j];
            position += er_gauss_end_position[j] * acceleration[k][j];
        }
        x[k] += h * (v[k] + h * position);
        v[k] += h * rate;
    }
}

static void ER_NAME(spread)(int count, const double *values, er_lanes *lanes)
{
    for (int k = 0; k < count; k++)
        for (int first = 0; first < ER_LANES; first += ER_WIDTH)
            *(er_real *)&lanes[k][first] = values[k] + 0.0 * load(&er_gauss_from_pairs[0][first]);
}

/* Row k of L and of its inverse are found side by side: what equation k takes off those below it, it takes
 * off their rows of the inverse as well. */
static bool ER_NAME(invert)(int n, er_complex_pair *restrict a, er_factor *restrict inverse)
{
    pair row[ER_MAX_ANGLES]; /* k: of L^-1, the diagonal, what is left of column k of A */
    ER_ALIGNED er_complex_pair one;
    set_real(&one, 1.0);
    for (int k = 0; k < n; k++) {
        ER_ALIGNED er_factor pivot, scaled;
        ER_ALIGNED er_complex_pair quotient;
        if (!take_reciprocal(&a[k * n + k]))
            return false;
        as_factor(&a[k * n + k], &pivot);
        inverse[k * n + k] = pivot;
        row[k] = read_pair(&one);
        for (int j = 0; j < k; j++) {
            row[j] = read_pair(&a[k * n + j]);
            as_factor(&a[k * n + j], &inverse[k * n + j]);
            multiply(&row[j], &pivot, &quotient);
            as_factor(&quotient, &inverse[j * n + k]);
        }
        for (int i = k + 1; i < n; i++)
            row[i] = read_pair(&a[i * n + k]);
        for (int i = k + 1; i < n; i++) {
            multiply(&row[i], &pivot, &quotient);
            as_factor(&quotient, &scaled);
            set_real(&a[i * n + k], 0.0);
            for (int j = 0; j <= i; j++)
                take_off(&a[i * n + j], &scaled, &row[j]);
        }
    }
    return true;
}

/* Two rows of a matrix times b, from column `first` to before `last`; each entry of b is loaded once. */
ER_INLINE void add_rows(const er_factor *row, const er_factor *next, int first, int last,
                        const er_complex_pair *b, product *one, product *two)
{
    for (int j = first; j < last; j++) {
        add_product(one, &row[j], &b[j]);
        add_product(two, &next[j], &b[j]);
    }
}

ER_INLINE void solve_pair(int n, const er_factor *restrict inverse, const er_complex_pair *restrict b,
                          er_complex_pair *restrict x)
{
    ER_ALIGNED er_complex_pair y[ER_MAX_ANGLES];
    for (int i = 0; i < n; i += 2) {
        const er_factor *row = &inverse[i * n], *next = i + 1 < n ? row + n : row;
        product one = as_product(&b[i]), two = as_product(&b[i + 1 < n ? i + 1 : i]);
        add_rows(row, next, 0, i, b, &one, &two);
        write_product(&one, &y[i]);
        if (i + 1 < n) {
            add_product(&two, &next[i], &b[i]);
            write_product(&two, &y[i + 1]);
        }
    }
    for (int i = 0; i < n; i += 2) {
        const er_factor *row = &inverse[i * n], *next = i + 1 < n ? row + n : row;
        product one = product_of(&row[i], &y[i]), two = {0};
        add_rows(row, next, i + 1, n, y, &one, &two);
        write_product(&one, &x[i]);
        if (i + 1 < n)
            write_product(&two, &x[i + 1]);
    }
}

static double sum_of(const er_lanes lanes)
{
    return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

static double ER_NAME(improve)(int n, const er_factor *inverse, const er_lanes *residual, er_lanes *acceleration)
{
    ER_ALIGNED er_complex_pair b[ER_MAX_ANGLES], x[ER_MAX_ANGLES];
    ER_ALIGNED er_lanes square;
    for (int first = 0; first < ER_LANES; first += ER_WIDTH)
        for (int k = 0; k < n; k++)
            *(er_real *)((double *)&b[k] + first) = mix(er_gauss_to_pairs, residual[k], first);
    solve_pair(n, inverse, b, x);
    for (int first = 0; first < ER_STAGES; first += ER_WIDTH) {
        er_real sum = 0.0 * load(&er_gauss_from_pairs[0][first]);
        for (int k = 0; k < n; k++) {
            er_real change = mix(er_gauss_from_pairs, (const double *)&x[k], first);
            *(er_real *)&acceleration[k][first] = load(&acceleration[k][first]) - change;
            sum += change * change;
        }
        *(er_real *)&square[first] = sum;
    }
    return sqrt(sum_of(square));
}

static double ER_NAME(filter)(int n, const er_factor *inverse, const double *defect)
{
    ER_ALIGNED er_complex_pair b[ER_MAX_ANGLES], x[ER_MAX_ANGLES];
    ER_ALIGNED er_lanes square;
    for (int k = 0; k < n; k++)
        set_real(&b[k], defect[k]);
    solve_pair(n, inverse, b, x);
    for (int first = 0; first < ER_LANES; first += ER_WIDTH) {
        er_real sum = 0.0 * load(&er_gauss_from_pairs[0][first]);
        for (int k = 0; k < n; k++) {
            er_real part = load((const double *)&x[k] + first);
            sum += part * part;
        }
        *(er_real *)&square[first] = sum;
    }
    return sqrt(square[0] + square[ER_PAIRS]);
}

/* Adds sum_j columns_j values_j.  Compilers make vectors of the loops over lanes, here and in the motors'. */
ER_INLINE void add_mixed(const er_lanes *columns, const double *values, double *lanes)
{
    for (int j = 0; j < ER_LANES; j++)
        for (int l = 0; l < ER_LANES; l++)
            lanes[l] += columns[j][l] * values[j];
}

static void ER_NAME(motor_stages)(const er_robot *robot, int motors, double h, const er_nodes *nodes,
                                  const er_lanes *acceleration, er_motor_work *work)
{
    ER_NAME(stages)(motors, h, work->p, work->pv, acceleration, work->stage_p, work->stage_pv);
    for (int d = 0; d < motors; d++) {
        const er_motor *motor = &robot->motor[d];
        const double *qd = nodes->qd[motor->joint];
        const er_servo_law law = work->law[d];
        double *rate_error = work->rate_error[d], *integral = work->integral[d];
        er_lanes growth;
        for (int l = 0; l < ER_LANES; l++) {
            rate_error[l] = er_servo_rate_error(motor, work->stage_p[d][l], work->stage_pv[d][l], qd[l]);
            growth[l] = h * motor->integral_gain * rate_error[l];
            integral[l] = work->start_integral[d];
        }
        if (law.integral == ER_GROWS)
            add_mixed(er_gauss_once, growth, integral);
        for (int l = 0; law.integral == ER_KEEPS && l < ER_LANES; l++)
            integral[l] = law.side * motor->torque_limit - motor->rate_gain * rate_error[l];
    }
}

/* What acts on gears beside their torque, the residual so far, is kept. */
static void ER_NAME(motor_wind_up)(const er_robot *robot, int motors, const er_nodes *nodes, int states,
                                   const er_lanes *x, const er_lanes *v, const er_lanes *residual, er_motor_work *work)
{
    er_lanes *angle = work->wind_up, *rate = work->wind_up_rate;
    memcpy(angle, x, (size_t)robot->elastics * sizeof *angle);
    memcpy(rate, v, (size_t)robot->elastics * sizeof *rate);
    for (int d = 0; d < motors; d++) {
        const er_motor *motor = &robot->motor[d];
        const int k = motor->coordinate, i = motor->joint;
        const double *p = work->stage_p[d], *pv = work->stage_pv[d];
        memcpy(work->load[d], residual[k], sizeof work->load[d]);
        for (int l = 0; l < ER_LANES; l++) {
            angle[k][l] -= p[l];
            rate[k][l] -= pv[l];
            work->winds[d][l] = 1.0;
            work->error[d][l] = 0.0;
        }
        for (int l = 0; er_has_gear_error(robot, i) && l < states; l++) {
            er_gear_error error = er_gear_error_at(robot, i, nodes->q[i][l] + p[l]);
            angle[k][l] -= error.value;
            rate[k][l] -= error.slope * (nodes->qd[i][l] + pv[l]);
            work->winds[d][l] = 1.0 + error.slope;
            work->error[d][l] = error.value;
        }
    }
}

static void ER_NAME(motor_residual)(const er_robot *robot, int motors, const double *slip_torque, const double *torque,
                                    const er_nodes *nodes, const er_lanes *acceleration, const er_lanes *residual,
                                    er_motor_work *work)
{
    for (int d = 0; d < motors; d++) {
        const er_motor *motor = &robot->motor[d];
        const double *q = nodes->q[motor->joint], *qd = nodes->qd[motor->joint], *qdd = nodes->qdd[motor->joint];
        er_lanes given, friction;
        for (int l = 0; l < ER_LANES; l++) {
            double demand = er_servo_demand(motor, work->rate_error[d][l], work->integral[d][l]);
            given[l] = torque != NULL ? torque[d] : er_servo_torque(motor, work->law[d], demand);
        }
        for (int l = 0; l < ER_LANES; l++)
            friction[l] = slip_torque[d];
        for (int l = 0; motor->stribeck > 0.0 && l < ER_LANES; l++)
            friction[l] *= er_stribeck_part(motor, qd[l] + work->stage_pv[d][l]);
        for (int l = 0; l < ER_LANES; l++) {
            double gear = residual[motor->coordinate][l] - work->load[d][l], rate = qd[l] + work->stage_pv[d][l];
            double part = er_friction_part(work, d, q[l] + work->stage_p[d][l]);
            friction[l] = er_friction_at(motor, friction[l], gear, part, rate);
            work->residual[d][l] = motor->inertia * (qdd[l] + acceleration[d][l]) - given[l] -
                                   work->winds[d][l] * gear + friction[l];
        }
    }
}

/* Products of pairs of complex numbers. */
ER_INLINE void times(const er_pairs a, const er_pairs b, er_pairs result)
{
    for (int p = 0; p < ER_PAIRS; p++) {
        double re = a[p] * b[p] - a[ER_PAIRS + p] * b[ER_PAIRS + p];
        result[ER_PAIRS + p] = a[p] * b[ER_PAIRS + p] + a[ER_PAIRS + p] * b[p];
        result[p] = re;
    }
}

static void ER_NAME(motor_before)(const er_robot *robot, int motors, const er_lanes *acceleration, er_lanes *residual,
                                  er_motor_work *work)
{
    for (int d = 0; d < motors; d++) {
        const int k = robot->motor[d].coordinate;
        er_pairs left = {0.0}, passed_on;
        add_mixed(er_gauss_to_pairs, work->residual[d], left);
        times(work->share[d], left, passed_on);
        add_mixed(er_gauss_from_pairs, passed_on, residual[k]);
        memcpy(work->left[d], left, sizeof left);
        memcpy(work->before[d], acceleration[k], sizeof work->before[d]);
    }
}

static double ER_NAME(motor_after)(const er_robot *robot, int motors, const er_lanes *acceleration,
                                   const er_motor_work *work, er_lanes *motor_acceleration)
{
    er_lanes squares = {0.0};
    for (int d = 0; d < motors; d++) {
        const double *chain = acceleration[robot->motor[d].coordinate];
        er_lanes change, change_of_motor = {0.0};
        er_pairs pairs = {0.0}, force;
        for (int l = 0; l < ER_LANES; l++)
            change[l] = chain[l] - work->before[d][l];
        add_mixed(er_gauss_to_pairs, change, pairs);
        times(work->gear[d], pairs, force);
        for (int p = 0; p < 2 * ER_PAIRS; p++)
            force[p] -= work->left[d][p];
        times(work->yields[d], force, pairs);
        add_mixed(er_gauss_from_pairs, pairs, change_of_motor);
        for (int l = 0; l < ER_LANES; l++) {
            motor_acceleration[d][l] += change_of_motor[l];
            squares[l] += change_of_motor[l] * change_of_motor[l];
        }
    }
    return squares[0] + squares[1] + squares[2] + squares[3];
}
