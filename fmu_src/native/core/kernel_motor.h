/* Motors at the nodes of a step, once for every set of instructions: compilers make vectors of the loops over lanes.
 *
 * Included behind kernel_newton.h, of which `stages` is used, by a file that includes motors.h.
 */

/* Adds sum_j columns_j values_j. */
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
        double *wanted = work->wanted[d], *integral = work->integral[d];
        er_lanes growth;
        for (int l = 0; l < ER_LANES; l++) {
            wanted[l] = er_servo_wanted(motor, work->stage_p[d][l], work->stage_pv[d][l], qd[l]);
            growth[l] = h * motor->integral_gain * wanted[l];
            integral[l] = work->start_integral[d];
        }
        if (law.integral == ER_GROWS)
            add_mixed(er_gauss_once, growth, integral);
        for (int l = 0; law.integral == ER_KEEPS && l < ER_LANES; l++)
            integral[l] = law.side * motor->torque_limit - motor->rate_gain * wanted[l];
    }
}

/* x and v of the chain become wind-ups; what acts on gears beside their torque, the residual so far, is kept. */
static void ER_NAME(motor_wind_up)(const er_robot *robot, int motors, const er_nodes *nodes, int states, er_lanes *x,
                                   er_lanes *v, const er_lanes *residual, er_motor_work *work)
{
    for (int d = 0; d < motors; d++) {
        const er_motor *motor = &robot->motor[d];
        const int k = motor->coordinate, i = motor->joint;
        const double *p = work->stage_p[d], *pv = work->stage_pv[d];
        memcpy(work->load[d], residual[k], sizeof work->load[d]);
        for (int l = 0; l < ER_LANES; l++) {
            x[k][l] -= p[l];
            v[k][l] -= pv[l];
            work->winds[d][l] = 1.0;
            work->error[d][l] = 0.0;
        }
        for (int l = 0; er_has_gear_error(robot, i) && l < states; l++) {
            er_gear_error error = er_gear_error_at(robot, i, nodes->q[i][l] + p[l]);
            x[k][l] -= error.value;
            v[k][l] -= error.slope * (nodes->qd[i][l] + pv[l]);
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
            double asked = er_servo_asked(motor, work->wanted[d][l], work->integral[d][l]);
            given[l] = torque != NULL ? torque[d] : er_servo_torque(motor, work->law[d], asked);
        }
        for (int l = 0; l < ER_LANES; l++)
            friction[l] = slip_torque[d];
        for (int l = 0; motor->stribeck > 0.0 && l < ER_LANES; l++)
            friction[l] *= er_stribeck_left(motor, qd[l] + work->stage_pv[d][l]);
        for (int l = 0; l < ER_LANES; l++) {
            double gear = residual[motor->coordinate][l] - work->load[d][l], rate = qd[l] + work->stage_pv[d][l];
            double part = er_friction_part(work, d, q[l] + work->stage_p[d][l]);
            friction[l] = (friction[l] + motor->load_friction * fabs(gear)) * part + motor->viscous * rate;
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
        er_lanes change, own = {0.0};
        er_pairs moved = {0.0}, force;
        for (int l = 0; l < ER_LANES; l++)
            change[l] = chain[l] - work->before[d][l];
        add_mixed(er_gauss_to_pairs, change, moved);
        times(work->gear[d], moved, force);
        for (int p = 0; p < 2 * ER_PAIRS; p++)
            force[p] -= work->left[d][p];
        times(work->yields[d], force, moved);
        add_mixed(er_gauss_from_pairs, moved, own);
        for (int l = 0; l < ER_LANES; l++) {
            motor_acceleration[d][l] += own[l];
            squares[l] += own[l] * own[l];
        }
    }
    return squares[0] + squares[1] + squares[2] + squares[3];
}
