#include "chain.h"

#include <math.h>
#include <string.h>

void er_angles(const er_robot *robot, const double *q, const double *x, double *theta)
{
    memset(theta, 0, (size_t)robot->angles * sizeof *theta);
    for (int i = 0; i < robot->joints; i++)
        theta[robot->drive_angle[i]] = q[i];
    for (int k = 0; x != NULL && k < robot->elastics; k++)
        theta[robot->elastic_angle[k]] += x[k];
}

/* R turned on about an axis of its own frame: by Rodrigues' formula, or two of its columns in their plane. */
static void turn_frame(const er_rotation *rotation, double angle, double R[9])
{
    const double *a = rotation->axis;
    int along = rotation->along;
    double s, c;
    er_sine_and_cosine(angle, &s, &c);
    if (along != ER_ASKEW) {
        double *first = R + (along + 1) % 3, *second = R + (along + 2) % 3;
        s *= a[along];
        for (int row = 0; row < 9; row += 3) {
            double p = first[row], q = second[row];
            first[row] = c * p + s * q;
            second[row] = c * q - s * p;
        }
    } else {
        double local[9], turned[9], v = 1.0 - c;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                local[3 * i + j] = v * a[i] * a[j];
        for (int i = 0; i < 3; i++)
            local[4 * i] += c;
        local[1] -= s * a[2], local[2] += s * a[1];
        local[3] += s * a[2], local[5] -= s * a[0];
        local[6] -= s * a[1], local[7] += s * a[0];
        er_compose(R, local, turned);
        memcpy(R, turned, sizeof turned);
    }
}

/* Goes from the frame before a rotation, with origin o, to the one behind it. */
static void pass_rotation(const er_rotation *rotation, double angle, double R[9], double o[3])
{
    if (rotation->shifted) {
        double step[3];
        er_rotate(R, rotation->origin, step);
        for (int k = 0; k < 3; k++)
            o[k] += step[k];
    }
    turn_frame(rotation, angle, R);
}

void er_place_tool(const er_robot *robot, const double *theta, double position[3], double rotation[9])
{
    double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, o[3] = {0, 0, 0};
    for (int i = 0; i < robot->angles; i++)
        pass_rotation(&robot->rotation[i], theta[i], R, o);
    er_rotate(R, robot->tool_position, position);
    for (int k = 0; k < 3; k++)
        position[k] += o[k];
    er_compose(R, robot->tool_rotation, rotation);
}

/* A body seen from base axes, about the point that lies at `offset` from its origin, in base axes. */
static void see_body(const er_body *body, const double R[9], const double offset[3], er_body *seen)
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    const double *I = body->inertia;
    const double full[9] = {I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2]};
    double half[9], h[3], moment[3], m = body->mass;
    er_compose(R, full, half);
    er_rotate(R, body->moment, h);
    seen->mass = m;
    for (int i = 0; i < 3; i++)
        moment[i] = seen->moment[i] = h[i] - m * offset[i];
    /* Steiner's theorem from one point to another, of which neither is the centre of mass. */
    for (int k = 0; k < 6; k++) {
        int i = row[k], j = column[k];
        double turned = er_dot(half + 3 * i, R + 3 * j);
        seen->inertia[k] = turned + h[i] * offset[j] + offset[i] * moment[j];
        if (i == j)
            seen->inertia[k] -= er_dot(h, offset) + er_dot(offset, moment);
    }
}

/* Frames of all rotations, base to tool: `frames` and `origins` in base axes. */
static void place_frames(const er_robot *robot, const double *theta, er_placement *placement, double (*frames)[9])
{
    double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, o[3] = {0, 0, 0}, tool[3];
    int n = robot->angles;
    for (int i = 0; i < n; i++) {
        const er_rotation *rotation = &robot->rotation[i];
        pass_rotation(rotation, theta[i], R, o);
        er_rotate(R, rotation->axis, placement->axis[i]); /* its own turn leaves an axis alone */
        memcpy(placement->arm[i], o, sizeof o);
        if (frames != NULL)
            memcpy(frames[i], R, sizeof R);
    }
    er_rotate(R, robot->tool_position, tool);
    for (int k = 0; k < 3; k++)
        placement->tool_position[k] = o[k] + tool[k];
    er_compose(R, robot->tool_rotation, placement->tool_rotation);
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < 3; k++)
            placement->arm[i][k] = placement->tool_position[k] - placement->arm[i][k];
        er_cross(placement->axis[i], placement->arm[i], placement->lever[i]);
    }
}

void er_place(const er_robot *robot, const double *theta, er_placement *placement)
{
    place_frames(robot, theta, placement, NULL);
}

void er_place_bodies(const er_robot *robot, const double *theta, er_placement *placement)
{
    double frames[ER_MAX_ANGLES][9];
    er_body sum;
    place_frames(robot, theta, placement, frames);
    memset(&sum, 0, sizeof sum);
    for (int i = robot->angles - 1; i >= 0; i--) {
        if (robot->rotation[i].loaded) {
            er_body seen;
            see_body(&robot->rotation[i].body, frames[i], placement->arm[i], &seen);
            sum.mass += seen.mass;
            for (int k = 0; k < 3; k++)
                sum.moment[k] += seen.moment[k];
            for (int k = 0; k < 6; k++)
                sum.inertia[k] += seen.inertia[k];
        }
        placement->outer[i] = sum;
    }
}

/* M_ij = twist_j . momentum of the bodies beyond i that move with twist_i, for j at or before i. */
void er_mass_matrix(const er_robot *robot, const er_placement *placement, double *mass)
{
    int m = robot->elastics;
    for (int k = 0; k < m; k++) {
        int i = robot->elastic_angle[k];
        const er_body *body = &placement->outer[i];
        const double *v = placement->lever[i], *omega = placement->axis[i];
        double linear[3], angular[3], swept[3];
        er_cross(omega, body->moment, linear);
        er_cross(body->moment, v, swept);
        er_symmetric_times(body->inertia, omega, angular);
        for (int c = 0; c < 3; c++) {
            linear[c] += body->mass * v[c];
            angular[c] += swept[c];
        }
        for (int l = 0; l <= k; l++) {
            int j = robot->elastic_angle[l];
            double entry =
                er_dot(placement->lever[j], linear) + er_dot(placement->axis[j], angular);
            mass[k * m + l] = mass[l * m + k] = entry;
        }
    }
}

/* z_i x (first moment about o_i of the bodies beyond i): how weight moves per theta_i [kg m]. */
static void weight_lever(const er_placement *placement, int i, double out[3])
{
    const er_body *body = &placement->outer[i];
    double about_joint[3];
    for (int c = 0; c < 3; c++)
        about_joint[c] = body->moment[c] + body->mass * placement->arm[i][c];
    er_cross(placement->axis[i], about_joint, out);
}

void er_static_torque(const er_robot *robot, const er_placement *placement, const double gravity[3],
                      const double wrench[6], double *torque)
{
    for (int k = 0; k < robot->elastics; k++) {
        int i = robot->elastic_angle[k];
        double lever[3];
        weight_lever(placement, i, lever);
        torque[k] = er_dot(placement->lever[i], wrench) + er_dot(placement->axis[i], wrench + 3) +
                    er_dot(lever, gravity);
    }
}

/* With j at or before i, z_j turns all that lies behind it; with j after i only the lever of i
 * grows, and both give z_first x (lever of the later) [Bruyninckx1996]. */
void er_static_torque_gradient(const er_robot *robot, const er_placement *placement,
                               const double gravity[3], const double wrench[6], double *gradient)
{
    int m = robot->elastics;
    for (int k = 0; k < m; k++) {
        int i = robot->elastic_angle[k];
        const double *z = placement->axis[i];
        double weight[3], of_force[3], of_weight[3], of_moment[3];
        weight_lever(placement, i, weight);
        er_cross(placement->lever[i], wrench, of_force);
        er_cross(weight, gravity, of_weight);
        er_cross(z, wrench + 3, of_moment);
        for (int l = 0; l <= k; l++) {
            const double *before = placement->axis[robot->elastic_angle[l]];
            double both = er_dot(before, of_force) + er_dot(before, of_weight);
            gradient[k * m + l] = gradient[l * m + k] = both;
            if (l < k) /* the axis z_i itself turns with theta_j */
                gradient[k * m + l] += er_dot(before, of_moment);
        }
    }
}

/* Quaternion from the largest of its four components, so that no small number is divided by. */
void er_pose(const double position[3], const double R[9], double pose[7])
{
    double trace = R[0] + R[4] + R[8], q[4], length = 0.0;
    int i = R[4] > R[0] ? 1 : 0, j, k;
    if (R[8] > R[4 * i])
        i = 2;
    if (trace > R[4 * i]) {
        q[3] = 1.0 + trace;
        for (int c = 0; c < 3; c++) {
            j = (c + 1) % 3, k = (c + 2) % 3;
            q[c] = R[3 * k + j] - R[3 * j + k];
        }
    } else {
        j = (i + 1) % 3, k = (i + 2) % 3;
        q[i] = 1.0 + R[4 * i] - R[4 * j] - R[4 * k];
        q[j] = R[3 * j + i] + R[3 * i + j];
        q[k] = R[3 * k + i] + R[3 * i + k];
        q[3] = R[3 * k + j] - R[3 * j + k];
    }
    for (int c = 0; c < 4; c++)
        length += q[c] * q[c];
    length = copysign(sqrt(length), q[3]);
    for (int c = 0; c < 3; c++)
        pose[c] = position[c];
    for (int c = 0; c < 4; c++)
        pose[3 + c] = q[c] / length;
}

void er_rotation_between(const double rotation[9], const double reference[9], double vector[3])
{
    double back[9], relative[9], origin[3] = {0, 0, 0}, pose[7], sine, angle, scale;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            back[3 * i + j] = reference[3 * j + i];
    er_compose(rotation, back, relative);
    er_pose(origin, relative, pose);
    sine = sqrt(er_dot(pose + 3, pose + 3));
    angle = 2.0 * atan2(sine, pose[6]);
    scale = sine > 0.0 ? angle / sine : 2.0;
    for (int k = 0; k < 3; k++)
        vector[k] = scale * pose[3 + k];
}

/* Angles that differ by less in sum turn a tool by less than half a turn [rad]: the scalar product of its
 * quaternions is positive then. */
#define NEARBY 2.0

/* q p into q. */
static void multiply_quaternion(double q[4], const double p[4])
{
    double crossed[3], w = q[3] * p[3] - er_dot(q, p);
    er_cross(q, p, crossed);
    for (int c = 0; c < 3; c++)
        q[c] = q[3] * p[c] + p[3] * q[c] + crossed[c];
    q[3] = w;
}

static void multiply_turns(er_turns *turns, const er_robot *robot, const double *theta)
{
    static const double origin[3] = {0.0, 0.0, 0.0};
    double pose[7], *q = turns->quaternion;
    q[0] = q[1] = q[2] = 0.0;
    q[3] = 1.0;
    for (int i = 0; i < robot->angles; i++) {
        const double *axis = robot->rotation[i].axis;
        double sine = sin(0.5 * theta[i]);
        const double turn[4] = {axis[0] * sine, axis[1] * sine, axis[2] * sine, cos(0.5 * theta[i])};
        multiply_quaternion(q, turn);
    }
    er_pose(origin, robot->tool_rotation, pose);
    multiply_quaternion(q, pose + 3);
    memcpy(turns->theta, theta, (size_t)robot->angles * sizeof *theta);
    turns->set = true;
}

double er_turns_sign(er_turns *turns, const er_robot *robot, const double *theta, const double quaternion[4])
{
    const double *near = turns->theta, *q = turns->quaternion;
    double apart[2] = {0.0, 0.0}; /* two sums at a time */
    int i = 0, n = robot->angles;
    for (; i + 1 < n; i += 2) {
        apart[0] += fabs(theta[i] - near[i]);
        apart[1] += fabs(theta[i + 1] - near[i + 1]);
    }
    if (i < n)
        apart[0] += fabs(theta[i] - near[i]);
    if (!turns->set || !(apart[0] + apart[1] < NEARBY))
        multiply_turns(turns, robot, theta);
    return (quaternion[0] * q[0] + quaternion[1] * q[1]) +
                       (quaternion[2] * q[2] + quaternion[3] * q[3]) <
                   0.0
               ? -1.0
               : 1.0;
}
