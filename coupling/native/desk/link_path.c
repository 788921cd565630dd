#include "link_path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/chain/chain.h"
#include "front.h"

enum { ORDERS = 3, POSE = 6, AT_NODE = 0, IN_MIDDLE = 1 };

/* Points that lie at the same place of their intervals, as far as there are others than the last one. */
typedef struct {
    int place, used;             /* AT_NODE or IN_MIDDLE; coefficients that move them */
    int64_t interval[ER_LANES];
    const double *position[ER_LANES], *quaternion[ER_LANES];
    ER_ALIGNED er_lanes wrench[6], theta[ER_MAX_ANGLES];
    er_motion motion;
    er_link_state state;
    er_link_derivatives by;
} points;

/* What iterations work with. */
struct er_link_iterations {
    void *memory;
    const er_desk *desk;
    const er_link_task *task;
    const double *coefficients;
    double damping;
    double *step;
    er_link_report *report;
    er_front front;
    points nodes, middle;
    ER_ALIGNED double rows[ER_MAX_ANGLES * ER_REACH * ER_MAX_ANGLES]; /* of the tilts, by coefficients */
    ER_ALIGNED double pose_rows[POSE * ER_MAX_ANGLES], pose_squares[ER_MAX_ANGLES * ER_MAX_ANGLES];
};

static const double *weights_at(const er_link_task *task, int place, int order)
{
    return task->weights + (place * ORDERS + order) * ER_REACH;
}

static double combined(const double *weights, int used, const double *coefficients, int width)
{
    double sum = 0.0;
    for (int j = 0; j < used; j++)
        sum += weights[j] * coefficients[j * width];
    return sum;
}

/* Places the points: `count` intervals from one on; the last one stands for those that are not there. */
static void take_points(const er_link_iterations *it, int place, int64_t first, int count, int64_t target, points *at)
{
    const er_link_task *task = it->task;
    const double *position = place == AT_NODE ? task->position : task->middle_position;
    const double *quaternion = place == AT_NODE ? task->quaternion : task->middle_quaternion;
    const double *wrench = place == AT_NODE ? task->wrench : task->middle_wrench;
    int n = it->desk->robot.angles;
    at->place = place;
    at->used = place == AT_NODE ? ER_REACH - 1 : ER_REACH;
    for (int s = 0; s < ER_LANES; s++) {
        int64_t beside = s < count ? s : count - 1, row = target + beside;
        const double *c = it->coefficients + (first + beside) * n;
        at->interval[s] = first + beside;
        at->position[s] = position + 3 * row;
        at->quaternion[s] = quaternion + 4 * row;
        for (int k = 0; k < 6; k++)
            at->wrench[k][s] = wrench[6 * row + k];
        for (int i = 0; i < n; i++) {
            at->theta[i][s] = combined(weights_at(task, place, 0), at->used, c + i, n);
            at->motion.rate[i][s] = combined(weights_at(task, place, 1), at->used, c + i, n);
            at->motion.acceleration[i][s] = combined(weights_at(task, place, 2), at->used, c + i, n);
        }
    }
    er_desk_turn(it->desk, at->theta, &at->motion);
    it->desk->links.linearise(&it->desk->robot, &at->motion, at->wrench, &it->desk->tilts, &at->state, &at->by);
}

static void add_to_block(er_link_iterations *it, int64_t i, int64_t k, int angle, double value)
{
    er_front_block(&it->front, i, k)[angle * (it->front.size + 1)] += value;
}

/* An enlarged diagonal is positive definite where rounding has left none. */
static void enlarge_diagonal(er_link_iterations *it, int64_t node, int angle, double value)
{
    if (it->damping > 0.0)
        add_to_block(it, node, node, angle, it->damping * value);
}

/* Errors of the pose, weighted, of point s. */
static void find_pose_errors(er_link_iterations *it, const points *at, int s, double errors[POSE])
{
    const er_link_task *task = it->task;
    er_link_report *report = it->report;
    double rotation[9], reference[9], turn[3], apart[3];
    for (int k = 0; k < 9; k++)
        rotation[k] = at->state.rotation[k][s];
    er_desk_rotation(at->quaternion[s], reference);
    er_rotation_between(rotation, reference, turn);
    for (int k = 0; k < 3; k++) {
        apart[k] = at->state.position[k][s] - at->position[s][k];
        errors[k] = task->position_weight * apart[k];
        errors[3 + k] = task->rotation_weight * turn[k];
    }
    report->position = fmax(report->position, sqrt(er_dot(apart, apart)));
    report->rotation = fmax(report->rotation, sqrt(er_dot(turn, turn)));
}

/* Adds D^T D and D^T r of the pose, which theta alone moves, of point s. */
static void add_pose(er_link_iterations *it, const points *at, int s)
{
    const er_link_task *task = it->task;
    const er_link_kernel *kernel = &it->desk->links;
    const double *weights = weights_at(task, at->place, 0);
    int n = it->front.size, used = at->used;
    double errors[POSE], right[ER_MAX_ANGLES] = {0.0};
    find_pose_errors(it, at, s, errors);
    for (int c = 0; c < POSE; c++) {
        double weight = c < 3 ? task->position_weight : task->rotation_weight, *row = it->pose_rows + c * n;
        for (int i = 0; i < it->front.quantities; i++) {
            row[i] = weight * at->by.jacobian[c][i][s];
            right[i] += row[i] * errors[c];
        }
    }
    memset(it->pose_squares, 0, (size_t)n * n * sizeof(double));
    kernel->add_products(n, POSE, n, it->pose_rows, it->pose_rows, it->pose_squares);
    for (int j = 0; j < used; j++) {
        int64_t node = at->interval[s] + j;
        double *its_right = er_front_right(&it->front, node);
        for (int i = 0; i < it->front.quantities; i++) {
            its_right[i] -= weights[j] * right[i];
            enlarge_diagonal(it, node, i, weights[j] * weights[j] * it->pose_squares[i * (n + 1)]);
        }
        for (int i = 0; i <= j; i++)
            kernel->add_multiple(n * n, weights[i] * weights[j], it->pose_squares,
                                 er_front_block(&it->front, node - j + i, node));
    }
}

/* The same of the tilts' balance. */
static void add_balance(er_link_iterations *it, const points *at, int s)
{
    const er_robot *robot = &it->desk->robot;
    const er_wanted *tilts = &it->desk->tilts;
    int n = it->front.size, used = at->used, stride = ER_REACH * n;
    for (int t = 0; t < tilts->count; t++) {
        int angle = tilts->angle[t], elastic = robot->rotation[angle].elastic;
        double stiffness = robot->parameters.stiffness[elastic], damping = robot->parameters.damping[elastic];
        double weight = it->task->balance[t], *row = it->rows + t * stride;
        double torque = at->state.load[angle][s] + stiffness * at->theta[angle][s] +
                        damping * at->motion.rate[angle][s];
        it->report->torque = fmax(it->report->torque, fabs(torque));
        double by[ORDERS][ER_MAX_ANGLES];
        for (int order = 0; order < ORDERS; order++)
            for (int i = 0; i < it->front.quantities; i++)
                by[order][i] = at->by.load[order][t][i][s];
        for (int j = 0; j < used; j++) {
            double w0 = weight * weights_at(it->task, at->place, 0)[j];
            double w1 = weight * weights_at(it->task, at->place, 1)[j];
            double w2 = weight * weights_at(it->task, at->place, 2)[j];
            double *its_right = er_front_right(&it->front, at->interval[s] + j), *part = row + j * n;
            for (int i = 0; i < it->front.quantities; i++)
                part[i] = w0 * by[0][i] + w1 * by[1][i] + w2 * by[2][i];
            part[angle] += w0 * stiffness + w1 * damping;
            for (int i = 0; i < it->front.quantities; i++) {
                its_right[i] -= weight * torque * part[i];
                enlarge_diagonal(it, at->interval[s] + j, i, part[i] * part[i]);
            }
        }
    }
    for (int j = 0; j < used; j++)
        for (int i = 0; i <= j; i++)
            it->desk->links.add_products(n, tilts->count, stride, it->rows + i * n, it->rows + j * n,
                                         er_front_block(&it->front, at->interval[s] + i, at->interval[s] + j));
}

/* The same of the joints' motion beside the rigid robot's. */
static void add_joints(er_link_iterations *it, const points *at, int s)
{
    const er_robot *robot = &it->desk->robot;
    const er_link_task *task = it->task;
    const double *value = weights_at(task, at->place, 0), *bend = weights_at(task, at->place, 2);
    double of_bend = task->acceleration_weight, of_value = task->tether;
    for (int d = 0; d < robot->joints; d++) {
        int angle = robot->drive_angle[d];
        const double *rigid = task->rigid + at->interval[s] * robot->joints + d;
        double bent = of_bend * (at->motion.acceleration[angle][s] - combined(bend, at->used, rigid, robot->joints));
        double apart = of_value * (at->theta[angle][s] - combined(value, at->used, rigid, robot->joints));
        for (int j = 0; j < at->used; j++) {
            int64_t node = at->interval[s] + j;
            er_front_right(&it->front, node)[angle] -= of_bend * bend[j] * bent + of_value * value[j] * apart;
            for (int i = 0; i <= j; i++)
                add_to_block(it, node - j + i, node, angle,
                             of_bend * of_bend * bend[i] * bend[j] + of_value * of_value * value[i] * value[j]);
        }
    }
}

static void add_point(er_link_iterations *it, const points *at, int s)
{
    add_pose(it, at, s);
    add_balance(it, at, s);
    add_joints(it, at, s);
}

/* Adds the conditions that begin at a node. */
static void add_conditions(er_link_iterations *it, int64_t node)
{
    const er_link_task *task = it->task;
    enum { MET = ER_REACH - 1 };
    int n = it->desk->robot.angles;
    for (int64_t c = 0; c < task->conditions; c++) {
        const double *weights = task->condition_weights + c * MET;
        int angle = (int)task->condition_angle[c];
        if (task->condition_first[c] != node)
            continue;
        double missed = combined(weights, MET, it->coefficients + node * n + angle, n) - task->condition_target[c];
        for (int j = 0; j < MET; j++) {
            er_front_right(&it->front, node + j)[angle] -= weights[j] * missed;
            for (int i = 0; i <= j; i++)
                add_to_block(it, node + i, node + j, angle, weights[i] * weights[j]);
        }
    }
}

/* Goes back over the store and writes what it holds; what was written before shows what the cut has done. */
static void write_changes(er_link_iterations *it)
{
    er_front *front = &it->front;
    int n = front->quantities;
    er_front_go_back(front);
    for (int64_t node = front->first; node < front->next; node++) {
        const double *change = er_front_change(front, node);
        double *row = it->step + node * n;
        for (int i = 0; i < n; i++) {
            if (front->first > 0 && node < front->first + ER_REACH - 1)
                it->report->cut = fmax(it->report->cut, fabs(change[i] - row[i]));
            row[i] = change[i];
        }
    }
}

static bool eliminate_node(er_link_iterations *it, int reach)
{
    if (er_front_is_full(&it->front)) {
        write_changes(it);
        er_front_keep_last(&it->front);
    }
    return er_front_eliminate(&it->front, reach);
}

/* Adds the middle of an interval if it is an outermost one; whether it is. */
static bool add_middle(er_link_iterations *it, int64_t interval)
{
    int64_t count = it->task->intervals, edge = it->task->edge;
    if (interval >= count || (interval >= edge && interval < count - edge))
        return false;
    take_points(it, IN_MIDDLE, interval, 1, interval < edge ? interval : interval - count + 2 * edge, &it->middle);
    add_point(it, &it->middle, 0);
    return true;
}

static bool follow_path(er_link_iterations *it)
{
    int64_t count = it->task->intervals, last = count + ER_REACH - 2;
    er_front_start(&it->front);
    for (int64_t node = 0; node <= last; node++) {
        int64_t reach = last - node < ER_REACH - 2 ? last - node : ER_REACH - 2;
        if (node <= count) {
            int64_t rest = count + 1 - node;
            if (node % ER_LANES == 0)
                take_points(it, AT_NODE, node, rest < ER_LANES ? (int)rest : ER_LANES, node, &it->nodes);
            add_point(it, &it->nodes, (int)(node % ER_LANES));
            if (add_middle(it, node))
                reach = ER_REACH - 1;
            add_conditions(it, node);
        }
        if (!eliminate_node(it, (int)reach))
            return false;
    }
    write_changes(it);
    return true;
}

er_link_iterations *er_link_iterations_create(const er_desk *desk, int64_t lag)
{
    void *memory = calloc(1, sizeof(er_link_iterations) + ER_ALIGNMENT);
    er_link_iterations *it = er_aligned(memory);
    if (memory == NULL)
        return NULL;
    it->memory = memory;
    it->desk = desk;
    if (!er_front_create(&it->front, &desk->links, desk->robot.angles, lag)) {
        free(memory);
        return NULL;
    }
    return it;
}

void er_link_iterations_free(er_link_iterations *links)
{
    er_front_free(&links->front);
    free(links->memory);
}

bool er_link_iterations_improve(er_link_iterations *links, const er_link_task *task, const double *coefficients,
                      double damping, double *step, er_link_report *report)
{
    int64_t count = (task->intervals + ER_REACH - 1) * links->desk->robot.angles;
    memset(report, 0, sizeof *report);
    links->task = task;
    links->coefficients = coefficients;
    links->damping = damping;
    links->step = step;
    links->report = report;
    if (!follow_path(links))
        return false;
    for (int64_t k = 0; k < count; k++)
        report->step = fmax(report->step, fabs(step[k]));
    return true;
}
