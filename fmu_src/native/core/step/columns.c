/* The columns of sensitivities: what each follows, cause by cause, and the motors in it. */
#include "columns.h"

#include <math.h>
#include <string.h>

#include "motor_step.h"

/* Columns of a cause. */
static int columns_of(const er_robot *robot, er_cause cause)
{
    switch (cause) {
    case ER_BY_WRENCH:
    case ER_BY_RATE: return 6;
    case ER_BY_SPRING: return ER_SYMMETRIC;
    case ER_BY_CONTACT: return 5;
    case ER_BY_ANCHOR:
    case ER_BY_ANCHOR_VELOCITY:
    case ER_BY_NORMAL:
    case ER_BY_GRAVITY: return 3;
    case ER_BY_Q:
    case ER_BY_QD:
    case ER_BY_QDD: return robot->joints;
    case ER_BY_FRICTION:
    case ER_BY_TORQUE: return robot->motors;
    case ER_BY_START: return 1;
    default: return robot->elastics;
    }
}

int er_first_column(const er_robot *robot, er_cause cause)
{
    int first = 0;
    for (int before = 0; before < (int)cause; before++)
        first += columns_of(robot, (er_cause)before);
    return first;
}

er_cause er_cause_of(const er_robot *robot, int column, int *entry)
{
    er_cause cause = ER_BY_WRENCH;
    for (*entry = column; *entry >= columns_of(robot, cause); cause++)
        *entry -= columns_of(robot, cause);
    return cause;
}

void er_parameter_along(const er_robot *robot, int column, double factor, er_parameters *change)
{
    int entry;
    switch (er_cause_of(robot, column, &entry)) {
    case ER_BY_GRAVITY: change->gravity[entry] += factor; break;
    case ER_BY_STIFFNESS: change->stiffness[entry] += factor; break;
    case ER_BY_DAMPING: change->damping[entry] += factor; break;
    case ER_BY_BACKLASH: change->backlash[entry] += factor; break;
    case ER_BY_HYSTERESIS: change->hysteresis[entry] += factor; break;
    case ER_BY_FRICTION: change->friction[entry] += factor; break;
    default: break;
    }
}

double *er_contact_entry(er_contact *contact, int place)
{
    double *const entries[] = {&contact->stiffness, &contact->dissipation, &contact->radius,
                               &contact->friction, &contact->slip_speed};
    return place < 5 ? entries[place] : &contact->normal[place - 5];
}

er_share er_share_of(const er_sensitivity *s, const er_robot *robot, int column, double elapsed)
{
    er_share share;
    int entry;
    er_cause cause = er_cause_of(robot, column, &entry);
    memset(&share, 0, sizeof share);
    share.joint = -1;
    switch (cause) {
    case ER_BY_WRENCH: share.load.wrench[entry] = 1.0; break;
    case ER_BY_Q:
    case ER_BY_QD:
    case ER_BY_QDD:
        if (s->drive == ER_TORQUE && robot->joint_motor[entry] >= 0)
            return share;
        share.joint = entry;
        er_command_at(s->commanded[entry][cause - ER_BY_Q], elapsed, &share.q, &share.qd, &share.qdd);
        break;
    case ER_BY_ANCHOR: share.load.anchor.position[entry] = 1.0; break;
    case ER_BY_ANCHOR_VELOCITY:
        share.load.anchor.position[entry] = elapsed;
        share.load.anchor.velocity[entry] = 1.0;
        break;
    case ER_BY_SPRING: share.load.anchor.stiffness[entry] = 1.0; break;
    case ER_BY_RATE: share.load.wrench[entry] = elapsed; break;
    case ER_BY_CONTACT: *er_contact_entry(&share.load.contact, entry) = 1.0; break;
    case ER_BY_NORMAL: share.load.contact.normal[entry] = 1.0; break;
    default: break;
    }
    return share;
}

er_drive_change er_column_command(const er_sensitivity *s, const er_run *r, int d, int column, double time)
{
    er_share share = er_share_of(s, r->system->robot, column, time - s->start);
    if (share.joint != r->system->robot->motor[d].joint)
        return (er_drive_change){0.0, 0.0, 0.0};
    return (er_drive_change){share.q, share.qd, share.qdd};
}

void er_motor_column_begin(const er_sensitivity *s, const er_run *r, const er_state *state, int column,
                           er_motor_column *column_motors)
{
    memcpy(column_motors->x, s->x[column], sizeof column_motors->x);
    memcpy(column_motors->v, s->v[column], sizeof column_motors->v);
    memset(column_motors->acceleration, 0, sizeof column_motors->acceleration);
    for (int d = 0; d < r->motors; d++) {
        er_drive_change at = er_column_command(s, r, d, column, state->time);
        er_gear_error error;
        int k = r->system->robot->motor[d].coordinate;
        column_motors->p[d] = s->motors[column].angle[d] - at.q;
        column_motors->pv[d] = s->motors[column].rate[d] - at.qd;
        error = er_gear_error_at(r->system->robot, r->system->robot->motor[d].joint, state->motors.angle[d]);
        column_motors->x[k] += column_motors->p[d] + error.slope * s->motors[column].angle[d];
        column_motors->v[k] += column_motors->pv[d] + error.slope * s->motors[column].rate[d] +
                     error.bend * state->motors.rate[d] * s->motors[column].angle[d];
    }
}

/* The error of a motor's gear at a stage, and the rate of the motor there [rad/s]. */
static er_gear_error error_at(const er_run *r, int d, int l, double *rate)
{
    int i = r->system->robot->motor[d].joint;
    const er_nodes *nodes = &r->work->stages;
    const er_motor_work *work = &r->work->motors;
    *rate = nodes->qd[i][l] + work->stage_pv[d][l];
    return er_gear_error_at(r->system->robot, i, nodes->q[i][l] + work->stage_p[d][l]);
}

void er_motor_column_gears(const er_sensitivity *s, const er_run *r, const er_state *state, double h, int column,
                           er_motor_column *column_motors, er_lanes *load)
{
    r->means->kernel.stages(r->motors, h, column_motors->p, column_motors->pv, (const er_lanes *)column_motors->acceleration, column_motors->stage_p,
                            column_motors->stage_pv);
    for (int d = 0; d < r->motors; d++) {
        int k = r->system->robot->motor[d].coordinate;
        for (int l = 0; l < ER_STAGES; l++) {
            double turned = column_motors->stage_p[d][l], faster = column_motors->stage_pv[d][l], rate;
            if (r->system->robot->errors > 0) {
                er_gear_error error = error_at(r, d, l, &rate);
                er_drive_change at = er_column_command(s, r, d, column, state->time + h * er_gauss_node[l]);
                turned += error.slope * (column_motors->stage_p[d][l] + at.q);
                faster += error.slope * (column_motors->stage_pv[d][l] + at.qd) + error.bend * rate * (column_motors->stage_p[d][l] + at.q);
            }
            load[k][l] -= s->slope[k][l] * turned + r->system->gears->damping[k] * faster;
            column_motors->gear[d][l] = load[k][l];
        }
    }
}

/* Growth of z along a column at a stage [N m/s], but where it keeps the torque at its limit, and w [rad/s]. */
static double find_growth(const er_run *r, int d, int l, const er_motor_column *column_motors, er_drive_change at, double *rate_error)
{
    const er_motor *motor = &r->system->robot->motor[d];
    *rate_error = er_servo_rate_error(motor, column_motors->stage_p[d][l], column_motors->stage_pv[d][l], at.qd);
    return r->work->motors.law[d].integral == ER_GROWS ? motor->integral_gain * *rate_error : 0.0;
}

/* Friction along a column at a stage [N m], under the gear's torque and what the column changes of that. */
static double friction_along(const er_sensitivity *s, const er_run *r, int d, int l, int column,
                             const er_motor_column *column_motors, er_drive_change at, double torque, double torque_along)
{
    const er_robot *robot = r->system->robot;
    const er_motor *motor = &robot->motor[d];
    const er_motor_work *work = &r->work->motors;
    const er_nodes *nodes = &r->work->stages;
    double slip_torque = r->system->gears->slip_torque[r->m + d], by_angle = work->stuck[d], by_rate, part, changed;
    double angle = nodes->q[motor->joint][l] + work->stage_p[d][l];
    double rate = nodes->qd[motor->joint][l] + work->stage_pv[d][l], by_part = er_stribeck_part(motor, rate);
    int entry;
    er_cause cause = er_cause_of(robot, column, &entry);
    part = er_friction_part(work, d, angle);
    er_motor_friction(motor, slip_torque, 0.0, part, rate, &by_rate);
    changed = s->elongation[column][robot->elements + d] / motor->slip_angle +
              by_angle * (column_motors->stage_p[d][l] + at.q - s->motors[column].angle[d]);
    return (slip_torque * by_part + motor->load_friction * fabs(torque)) * changed +
           copysign(motor->load_friction, torque) * part * torque_along +
           by_rate * (column_motors->stage_pv[d][l] + at.qd) + (cause == ER_BY_FRICTION && entry == d ? by_part * part : 0.0);
}

void er_motor_column_residual(const er_sensitivity *s, const er_run *r, const er_state *state, double h, int column,
                              const er_motor_column *column_motors, const er_lanes *gear)
{
    const er_robot *robot = r->system->robot;
    er_motor_work *work = &r->work->motors;
    int entry;
    er_cause cause = er_cause_of(robot, column, &entry);
    for (int d = 0; d < r->motors; d++) {
        const er_motor *motor = &robot->motor[d];
        const bool loaded = er_motor_is_loaded(robot, d);
        const int k = motor->coordinate;
        double growth[ER_STAGES], rate_error[ER_STAGES];
        er_drive_change at[ER_STAGES];
        for (int l = 0; l < ER_STAGES; l++) {
            at[l] = er_column_command(s, r, d, column, state->time + h * er_gauss_node[l]);
            growth[l] = find_growth(r, d, l, column_motors, at[l], &rate_error[l]);
        }
        for (int l = 0; l < ER_STAGES; l++) {
            double torque = cause == ER_BY_TORQUE && entry == d ? 1.0 : 0.0, held = 0.0, rate;
            double follows = column_motors->gear[d][l] + gear[k][l];
            er_gear_error error = {0.0, 0.0, 0.0, 0.0};
            if (s->drive == ER_SERVO && work->law[d].side == 0) {
                torque = er_servo_demand(motor, rate_error[l], s->motors[column].integral[d]);
                for (int j = 0; j < ER_STAGES; j++)
                    torque += h * er_gauss_once[j][l] * growth[j];
            }
            if (loaded) {
                error = error_at(r, d, l, &rate);
                held = er_wind_up_torque(r, state, k, er_wind_up(r)[k][l], er_wind_up_rate(r)[k][l]);
            }
            work->residual[d][l] = motor->inertia * (column_motors->acceleration[d][l] + at[l].qdd) - torque -
                                   (1.0 + error.slope) * follows -
                                   error.bend * held * (column_motors->stage_p[d][l] + at[l].q) +
                                   friction_along(s, r, d, l, column, column_motors, at[l], held, follows);
        }
    }
}

void er_motor_column_end(er_sensitivity *s, const er_run *r, const er_state *state, const er_step *step, int column,
                         const er_motor_column *column_motors)
{
    const double h = step->length;
    const er_robot *robot = r->system->robot;
    er_motor_change *motors = &s->motors[column];
    double p[ER_MAX_JOINTS], pv[ER_MAX_JOINTS], before[ER_MAX_JOINTS];
    memcpy(p, column_motors->p, sizeof p);
    memcpy(pv, column_motors->pv, sizeof pv);
    memcpy(before, motors->angle, sizeof before);
    r->means->kernel.finish(r->motors, h, (const er_lanes *)column_motors->acceleration, p, pv);
    for (int d = 0; d < r->motors; d++) {
        int k = robot->motor[d].coordinate;
        er_drive_change at = er_column_command(s, r, d, column, state->time + h);
        er_gear_error error = er_gear_error_at(robot, robot->motor[d].joint, step->motors.angle[d]);
        for (int l = 0; l < ER_STAGES; l++) {
            double rate_error;
            er_drive_change then = er_column_command(s, r, d, column, state->time + h * er_gauss_node[l]);
            double growth = find_growth(r, d, l, column_motors, then, &rate_error);
            motors->integral[d] += s->drive == ER_SERVO ? h * er_gauss_end_rate[l] * growth : 0.0;
        }
        if (r->work->motors.law[d].integral == ER_KEEPS)
            motors->integral[d] = -robot->motor[d].rate_gain * er_servo_rate_error(&robot->motor[d], p[d], pv[d], at.qd);
        motors->angle[d] = p[d] + at.q;
        motors->rate[d] = pv[d] + at.qd;
        s->x[column][k] -= p[d] + error.slope * motors->angle[d];
        s->v[column][k] -=
            pv[d] + error.slope * motors->rate[d] + error.bend * step->motors.rate[d] * motors->angle[d];
    }
    er_stops_follow_motors(robot, &state->stops, before, motors->angle, s->elongation[column]);
}
