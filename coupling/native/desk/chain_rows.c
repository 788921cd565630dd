#include "chain_rows.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/chain/chain.h"
#include "core/elements/gear_parts.h"

static void want_angle(er_wanted *wanted, int angle)
{
    wanted->row[angle] = wanted->count;
    wanted->angle[wanted->count++] = angle;
}

static void find_wanted(er_desk *desk)
{
    const er_robot *robot = &desk->robot;
    for (int i = 0; i < robot->angles; i++) {
        int elastic = robot->rotation[i].elastic;
        desk->tilts.row[i] = -1;
        want_angle(&desk->all, i);
        if (elastic >= 0 && robot->elastic_tilt[elastic] > 0)
            want_angle(&desk->tilts, i);
    }
}

er_desk *er_desk_create(const char *text, char message[ER_MESSAGE])
{
    er_desk *desk = calloc(1, sizeof *desk);
    er_failure failure;
    er_lines lines;
    message[0] = '\0';
    if (desk == NULL) {
        snprintf(message, ER_MESSAGE, "the robot does not fit into memory");
        return NULL;
    }
    er_lines_start(&lines, text, &failure);
    if (!er_robot_parse(&desk->robot, &lines)) {
        snprintf(message, ER_MESSAGE, "%.*s", ER_MESSAGE - 1, failure.text);
        free(desk);
        return NULL;
    }
    desk->links = er_best_link_kernel();
    find_wanted(desk);
    return desk;
}

er_desk *er_desk_create_plain(const char *text, char message[ER_MESSAGE])
{
    er_desk *desk = er_desk_create(text, message);
    if (desk != NULL)
        desk->links = er_plain_link_kernel();
    return desk;
}

void er_desk_free(er_desk *desk)
{
    free(desk);
}

void er_desk_turn(const er_desk *desk, const er_lanes *theta, er_motion *motion)
{
    for (int i = 0; i < desk->robot.angles; i++)
        for (int s = 0; s < ER_LANES; s++)
            er_sine_and_cosine(theta[i][s], &motion->sine[i][s], &motion->cosine[i][s]);
}

void er_desk_relieve(const er_desk *desk, const er_lanes *theta, const er_wanted *wanted, er_link_state *state,
                     er_link_derivatives *by)
{
    const er_robot *robot = &desk->robot;
    for (int b = 0; b < robot->balancers; b++) {
        const er_balancer *balancer = &robot->balancer[b];
        int angle = robot->drive_angle[robot->elastic_joint[balancer->coordinate]], row = wanted->row[angle];
        for (int s = 0; s < ER_LANES; s++) {
            er_balance balance = er_balance_at(balancer, theta[angle][s]);
            state->load[angle][s] -= balance.torque;
            if (by != NULL && row >= 0)
                by->load[0][row][angle][s] -= balance.slope;
        }
    }
}

void er_desk_rotation(const double q[4], double R[9])
{
    double x = q[0], y = q[1], z = q[2], w = q[3];
    R[0] = 1.0 - 2.0 * (y * y + z * z), R[1] = 2.0 * (x * y - z * w), R[2] = 2.0 * (x * z + y * w);
    R[3] = 2.0 * (x * y + z * w), R[4] = 1.0 - 2.0 * (x * x + z * z), R[5] = 2.0 * (y * z - x * w);
    R[6] = 2.0 * (x * z - y * w), R[7] = 2.0 * (y * z + x * w), R[8] = 1.0 - 2.0 * (x * x + y * y);
}

/* States from row `first` on, of which there are `count`: the last one stands for those that are not there. */
static void read_lanes(int width, int64_t first, int64_t count, const double *rows, er_lanes *lanes)
{
    for (int s = 0; s < ER_LANES; s++) {
        const double *row = rows + (first + s < count ? first + s : count - 1) * width;
        for (int i = 0; i < width; i++)
            lanes[i][s] = row[i];
    }
}

/* Column `width` entries of state s. */
static void write_row(int width, int s, const er_lanes *lanes, double *row)
{
    for (int i = 0; i < width; i++)
        row[i] = lanes[i][s];
}

typedef struct {
    ER_ALIGNED er_lanes theta[ER_MAX_ANGLES], wrench[6];
    er_motion motion;
} loaded_motion;

static void read_motion(const er_desk *desk, int64_t first, int64_t count, const double *theta, const double *rate,
                        const double *acceleration, const double *wrench, loaded_motion *read)
{
    int n = desk->robot.angles;
    read_lanes(n, first, count, theta, read->theta);
    read_lanes(n, first, count, rate, read->motion.rate);
    read_lanes(n, first, count, acceleration, read->motion.acceleration);
    read_lanes(6, first, count, wrench, read->wrench);
    er_desk_turn(desk, read->theta, &read->motion);
}

void er_desk_loads(const er_desk *desk, int64_t count, const double *theta, const double *rate,
                   const double *acceleration, const double *wrench, double *load)
{
    int n = desk->robot.angles;
    for (int64_t first = 0; first < count; first += ER_LANES) {
        loaded_motion read;
        er_link_state state;
        read_motion(desk, first, count, theta, rate, acceleration, wrench, &read);
        desk->links.loads(&desk->robot, &read.motion, read.wrench, &state);
        er_desk_relieve(desk, read.theta, &desk->all, &state, NULL);
        for (int s = 0; s < ER_LANES && first + s < count; s++)
            write_row(n, s, state.load, load + (first + s) * n);
    }
}

void er_desk_linearise(const er_desk *desk, int64_t count, const double *theta, const double *rate,
                       const double *acceleration, const double *wrench, double *load, double *by,
                       double *jacobian, double *position, double *rotation)
{
    int n = desk->robot.angles;
    for (int64_t first = 0; first < count; first += ER_LANES) {
        loaded_motion read;
        er_link_state state;
        er_link_derivatives derivatives;
        read_motion(desk, first, count, theta, rate, acceleration, wrench, &read);
        desk->links.linearise(&desk->robot, &read.motion, read.wrench, &desk->all, &state, &derivatives);
        er_desk_relieve(desk, read.theta, &desk->all, &state, &derivatives);
        for (int s = 0; s < ER_LANES && first + s < count; s++) {
            int64_t k = first + s;
            write_row(n, s, state.load, load + k * n);
            write_row(3, s, state.position, position + 3 * k);
            write_row(9, s, state.rotation, rotation + 9 * k);
            for (int c = 0; c < 6; c++)
                write_row(n, s, derivatives.jacobian[c], jacobian + (6 * k + c) * n);
            for (int order = 0; order < 3; order++)
                for (int i = 0; i < n; i++)
                    write_row(n, s, derivatives.load[order][i], by + ((3 * k + order) * n + i) * n);
        }
    }
}

void er_desk_place(const er_desk *desk, int64_t count, const double *theta, double *position, double *rotation)
{
    for (int64_t k = 0; k < count; k++)
        er_place_tool(&desk->robot, theta + k * desk->robot.angles, position + 3 * k, rotation + 9 * k);
}

void er_desk_masses(const er_desk *desk, int64_t count, const double *theta, double *mass)
{
    int m = desk->robot.elastics;
    for (int64_t k = 0; k < count; k++) {
        er_placement placement;
        er_place_bodies(&desk->robot, theta + k * desk->robot.angles, &placement);
        er_mass_matrix(&desk->robot, &placement, mass + k * m * m);
    }
}
