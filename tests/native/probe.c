/* The C core behind plain arrays, for tests through ctypes. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "chain.h"
#include "file.h"
#include "interface.h"
#include "model.h"
#include "outputs.h"
#include "sensitivity.h"
#include "trajectory_build.h"

static er_failure failure;

/* Wrench, then the anchor's position and velocity and the stiffness of its spring, then the contact. */
enum { LOAD_ENTRIES = 18 + ER_CONTACT_ENTRIES };

static er_load load_of(const double values[LOAD_ENTRIES])
{
    er_load load;
    memset(&load, 0, sizeof load);
    memcpy(load.wrench, values, sizeof load.wrench);
    memcpy(load.anchor.position, values + 6, sizeof load.anchor.position);
    memcpy(load.anchor.velocity, values + 9, sizeof load.anchor.velocity);
    memcpy(load.anchor.stiffness, values + 12, sizeof load.anchor.stiffness);
    for (int k = 0; k < ER_CONTACT_ENTRIES; k++)
        *er_contact_entry(&load.contact, k) = values[18 + k];
    return load;
}

/* A command to stand still. */
static er_command standing(const er_model *model, const double *q)
{
    er_command command;
    memset(&command, 0, sizeof command);
    for (int i = 0; i < model->robot.joints; i++) {
        command.q[i] = q[i];
        command.jerk[i] = NAN;
    }
    return command;
}

const char *probe_failure(void)
{
    return failure.text;
}

er_model *probe_create(const char *text)
{
    er_robot *robot = malloc(sizeof *robot);
    er_model *model = NULL;
    er_lines lines;
    er_lines_start(&lines, text, &failure);
    if (er_robot_parse(robot, &lines))
        model = er_model_create(robot);
    free(robot);
    return model;
}

/* Whether these are the data of an FMU. */
bool probe_read(const char *text)
{
    er_robot *robot = malloc(sizeof *robot);
    er_interface *interface = malloc(sizeof *interface);
    er_lines lines;
    bool good;
    er_lines_start(&lines, text, &failure);
    good = er_robot_parse(robot, &lines) && er_interface_parse(interface, robot, &lines);
    free(interface);
    free(robot);
    return good;
}

/* The folder that a URI names, cut to 200 bytes; false if it names none. */
bool probe_uri(const char *uri, bool windows, char folder[200])
{
    char *path = er_folder_from_uri(uri, windows);
    snprintf(folder, 200, "%s", path != NULL ? path : "");
    free(path);
    return path != NULL;
}

void probe_free(er_model *model)
{
    er_model_free(model);
}

void probe_use_plain_kernel(er_model *model)
{
    model->kernel = er_plain_kernel();
}

/* Frames, Jacobian (6 x angles), mass matrix, static torque and its gradient at theta. */
void probe_chain(const er_model *model, const double *theta, const double *wrench, double *pose,
                 double *jacobian, double *mass, double *torque, double *gradient)
{
    const er_robot *robot = &model->robot;
    er_placement p;
    er_place_bodies(robot, theta, &p);
    er_pose(p.tool_position, p.tool_rotation, pose);
    for (int i = 0; i < robot->angles; i++)
        for (int c = 0; c < 3; c++) {
            jacobian[c * robot->angles + i] = p.lever[i][c];
            jacobian[(3 + c) * robot->angles + i] = p.axis[i][c];
        }
    er_mass_matrix(robot, &p, mass);
    er_static_torque(robot, &p, robot->parameters.gravity, wrench, torque);
    er_static_torque_gradient(robot, &p, robot->parameters.gravity, wrench, gradient);
}

/* Loads of four states; theta, rate, acceleration and load by [angle or x][state].  The drives' sines are
 * those of `reference` changed by the rest; of an elastic joint drive and gear have one half each. */
void probe_loads(const er_model *model, const double *reference, const double *theta,
                 const double *rate, const double *acceleration, const double *wrench, double *load)
{
    const er_robot *robot = &model->robot;
    er_nodes nodes;
    er_reference at;
    er_motion motion;
    ER_ALIGNED er_lanes x[3][ER_MAX_ANGLES], result[ER_MAX_ANGLES];
    for (int i = 0; i < robot->angles; i++) {
        int d = robot->rotation[i].drive, k = robot->rotation[i].elastic;
        const double *values[3] = {theta, rate, acceleration};
        er_lanes *drives[3] = {nodes.q, nodes.qd, nodes.qdd};
        for (int c = 0; c < 3; c++)
            for (int l = 0; l < ER_LANES; l++) {
                double all = values[c][i * ER_LANES + l];
                double half = d >= 0 && k >= 0 ? 0.5 * (all - (c == 0 ? reference[i] : 0.0)) : 0.0;
                if (d >= 0)
                    drives[c][d][l] = all - half;
                if (k >= 0)
                    x[c][k][l] = d >= 0 ? half : all;
            }
        if (d >= 0) {
            at.angle[d] = reference[i];
            at.sine[d] = sin(reference[i]);
            at.cosine[d] = cos(reference[i]);
        }
    }
    model->kernel.move(robot, &nodes, &at, (const er_lanes *)x[0], (const er_lanes *)x[1],
                       (const er_lanes *)x[2], &motion);
    model->kernel.loads(robot, &motion, ER_LANES, robot->parameters.gravity, wrench, NULL, result);
    memcpy(load, result, (size_t)robot->elastics * sizeof(er_lanes));
}

/* Position of the TCP in four states, by [axis][state]; theta and wrench by [angle or axis][state].  And the
 * loads that a wrench of each state adds. */
void probe_pull(const er_model *model, const double *theta, const double *wrench, double *position,
                double *load)
{
    const er_robot *robot = &model->robot;
    er_motion motion;
    ER_ALIGNED er_lanes result[ER_MAX_ANGLES], without[ER_MAX_ANGLES];
    ER_ALIGNED er_vector reach;
    ER_ALIGNED er_pull pull;
    memset(&motion, 0, sizeof motion);
    for (int i = 0; i < robot->angles; i++)
        for (int l = 0; l < ER_LANES; l++) {
            motion.sine[i][l] = sin(theta[i * ER_LANES + l]);
            motion.cosine[i][l] = cos(theta[i * ER_LANES + l]);
        }
    memcpy(pull, wrench, sizeof pull);
    model->kernel.reach(robot, &motion, ER_LANES, reach);
    memcpy(position, reach, sizeof reach);
    model->kernel.loads(robot, &motion, ER_LANES, robot->parameters.gravity, NULL, NULL, without);
    model->kernel.loads(robot, &motion, ER_LANES, robot->parameters.gravity, NULL,
                        (const er_lanes *)pull, result);
    for (int k = 0; k < robot->elastics; k++)
        for (int l = 0; l < ER_LANES; l++)
            load[k * ER_LANES + l] = result[k][l] - without[k][l];
}

/* Derivative of these loads along directions, by [angle][state], and a change of the wrench. */
void probe_tangent(const er_model *model, const double *theta, const double *rate,
                   const double *acceleration, const double *wrench, const double *direction,
                   const double *wrench_direction, double *load)
{
    const er_robot *robot = &model->robot;
    size_t count = (size_t)robot->angles * ER_LANES, bytes = count * sizeof(double);
    er_motion motion;
    er_links links;
    er_direction along;
    ER_ALIGNED er_lanes result[ER_MAX_ANGLES];
    for (int i = 0; i < robot->angles; i++)
        for (int l = 0; l < ER_LANES; l++) {
            motion.sine[i][l] = sin(theta[i * ER_LANES + l]);
            motion.cosine[i][l] = cos(theta[i * ER_LANES + l]);
        }
    memcpy(motion.rate, rate, bytes);
    memcpy(motion.acceleration, acceleration, bytes);
    memcpy(along.angle, direction, bytes);
    memcpy(along.rate, direction + count, bytes);
    memcpy(along.acceleration, direction + 2 * count, bytes);
    model->kernel.link(robot, &motion, robot->parameters.gravity, wrench, NULL, &links);
    memset(result, 0, sizeof result);
    model->kernel.tangent(robot, &links, &along, wrench_direction, NULL, result);
    memcpy(load, result, (size_t)robot->elastics * sizeof(er_lanes));
}

/* One pass of Newton's method from rest: matrices by [pair][row][column], of which the lower triangles count;
 * residual and acceleration by [x][stage].  Returns the length of the change, NaN if they are singular. */
double probe_newton(const er_model *model, int n, const double *re, const double *im,
                    const double *residual, double *acceleration)
{
    ER_ALIGNED er_complex_pair matrix[ER_MAX_ANGLES * ER_MAX_ANGLES];
    ER_ALIGNED er_factor inverse[ER_MAX_ANGLES * ER_MAX_ANGLES];
    ER_ALIGNED er_lanes given[ER_MAX_ANGLES], change[ER_MAX_ANGLES];
    double length = NAN;
    for (int i = 0; i < n * n; i++)
        for (int p = 0; p < ER_PAIRS; p++) {
            matrix[i].re[p] = i % n <= i / n ? re[p * n * n + i] : NAN;
            matrix[i].im[p] = i % n <= i / n ? im[p * n * n + i] : NAN;
        }
    memcpy(given, residual, (size_t)n * sizeof *given);
    memset(change, 0, sizeof change);
    if (model->kernel.invert(n, matrix, inverse))
        length = model->kernel.improve(n, inverse, (const er_lanes *)given, change);
    memcpy(acceleration, change, (size_t)n * sizeof *change);
    return length;
}

/* Columns of the wrench, x and x' each, over a step that is then taken back; returns the passes of
 * the column that took most, 0 if it fails. */
int probe_columns(er_model *model, double end, const double *q, const double *load_values,
                  double accuracy, double *x, double *v)
{
    const er_state state = model->memory.state;
    const er_load load = load_of(load_values);
    int m = model->robot.elastics;
    const er_command command = standing(model, q);
    bool good;
    er_sensitivity_start(&model->sensitivity, &model->robot, ER_BY_WRENCH, ER_BY_WRENCH, state.time);
    model->sensitivity.accuracy = accuracy;
    good = er_model_follow(model, &state, &model->memory.past, end, &command, &load, &failure);
    for (int column = 0; column < 6; column++) {
        memcpy(x + column * m, model->sensitivity.x[column], (size_t)m * sizeof *x);
        memcpy(v + column * m, model->sensitivity.v[column], (size_t)m * sizeof *v);
    }
    return good && model->sensitivity.reason == NULL ? model->sensitivity.passes : 0;
}

void probe_curve(er_model *model, int kind, int region, int count, const double *x, double *torque,
                 double *slope, double *deflection)
{
    er_gears_build(&model->gears, kind, &model->robot, &model->memory.parameters);
    for (int k = 0; k < model->robot.elastics; k++)
        for (int i = 0; i < count; i++) {
            int at = k * count + i;
            int branch = region == 2 ? er_gear_region(&model->gears, k, x[at]) : region;
            torque[at] = er_gear_torque(&model->gears, k, branch, x[at]);
            slope[at] = er_gear_slope(&model->gears, k, branch, x[at]);
            deflection[at] = er_gear_deflection(&model->gears, k, torque[at]);
        }
}

bool probe_reset(er_model *model, int curve, bool quasistatic, bool undeflected, double tolerance,
                 const char *path, double time, const double *q, const double *load_values)
{
    const er_load load = load_of(load_values);
    const er_command command = standing(model, q);
    model->memory.options.curve = curve;
    model->memory.options.quasistatic = quasistatic;
    model->memory.options.initial = undeflected ? ER_UNDEFLECTED : ER_FROM_UNLOADED;
    model->memory.options.tolerance = tolerance;
    strcpy(model->memory.options.trajectory, path);
    return er_model_reset(model, time, &command, &load, &failure);
}

/* Takes the motion of a file for that of the model. */
bool probe_take_file(er_model *model, const char *path)
{
    er_trajectory trajectory;
    if (!er_trajectory_read(&trajectory, path, model->robot.joints, &model->robot.settings, &failure))
        return false;
    er_trajectory_free(&model->trajectory);
    model->trajectory = trajectory;
    model->hint = 0;
    return true;
}

bool probe_step(er_model *model, double end, const double *q, const double *load_values)
{
    const er_load load = load_of(load_values);
    const er_command command = standing(model, q);
    er_state began;
    return er_model_step(model, end, &command, &load, &began, &failure);
}

/* Wrench of the contact and the depth in its plane, and the tries that the last step took. */
long probe_contact(const er_model *model, double *wrench, double *depth)
{
    er_contact_motion motion;
    er_model_contact(model, &motion, wrench);
    *depth = motion.touch.depth;
    return model->work.made;
}

/* Has the growth of a small shift of the state watched; whether one has grown. */
bool probe_watch_growth(er_model *model)
{
    model->watches_growth = true;
    return model->growth.has_grown;
}

/* Stiffness of the contact spring in the matrices of Newton's method. */
void probe_spring_of_matrices(const er_model *model, double *stiffness)
{
    memcpy(stiffness, model->memory.state.linearisation.anchor,
           sizeof model->memory.state.linearisation.anchor);
}

bool probe_outputs(er_model *model, double *tcp, double *velocity, double *rigid,
                   double *deviation, double *compliance, double *x, double *torque)
{
    er_model_tcp(model, tcp);
    er_model_velocity(model, velocity);
    er_model_rigid(model, rigid);
    er_model_deviation(model, deviation);
    memcpy(x, model->memory.state.x, (size_t)model->robot.elastics * sizeof *x);
    for (int k = 0; k < model->robot.elastics; k++)
        torque[k] = er_model_gear_torque(model, k);
    return er_model_compliance(model, compliance, &failure);
}

/* Runs to each time under no wrench along the trajectory; poses and deflections as rows. */
bool probe_run(er_model *model, int count, const double *times, double *rows)
{
    static const double rest[ER_MAX_JOINTS], none[LOAD_ENTRIES];
    int width = 7 + model->robot.elastics;
    for (int i = 0; i < count; i++) {
        if (i > 0 && !probe_step(model, times[i], rest, none))
            return false;
        er_model_tcp(model, rows + i * width);
        memcpy(rows + i * width + 7, model->memory.state.x,
               (size_t)model->robot.elastics * sizeof *rows);
    }
    return true;
}

bool probe_drives(er_model *model, int count, const double *times, double *motion)
{
    er_drives drives;
    int n = model->robot.joints;
    memset(&drives, 0, sizeof drives);
    drives.trajectory = &model->trajectory;
    drives.hint = &model->hint;
    drives.start = model->trajectory.start;
    for (int i = 0; i < count; i++) {
        if (!er_drives_cover(&drives, times[i], model->robot.settings.time_slack, &failure))
            return false;
        er_drives_at(&drives, times[i], motion + 3 * n * i, motion + 3 * n * i + n,
                     motion + 3 * n * i + 2 * n);
    }
    return true;
}

double probe_next_kink(er_model *model, double time, double end, double jump)
{
    er_drives drives;
    memset(&drives, 0, sizeof drives);
    drives.trajectory = &model->trajectory;
    drives.hint = &model->hint;
    drives.start = model->trajectory.start;
    return er_drives_next_kink(&drives, time, end, jump);
}
