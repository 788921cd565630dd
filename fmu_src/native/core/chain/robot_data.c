#include "robot_data.h"

#include <math.h>
#include <string.h>

#define FORMAT "elastic-robot"
#define VERSION 3

/* There is room for it: a joint has at most two tilts. */
static er_rotation *add_rotation(er_robot *robot)
{
    er_rotation *rotation = &robot->rotation[robot->angles++];
    memset(rotation, 0, sizeof *rotation);
    rotation->drive = rotation->elastic = -1;
    return rotation;
}

/* Lets the last rotation give way with stiffness, damping and backlash. */
static void add_elastic(er_robot *robot, int tilt, const double values[3])
{
    int k = robot->elastics++;
    robot->rotation[robot->angles - 1].elastic = k;
    robot->elastic_angle[k] = robot->angles - 1;
    robot->elastic_joint[k] = robot->joints - 1;
    robot->elastic_tilt[k] = tilt;
    robot->parameters.stiffness[k] = values[0];
    robot->parameters.damping[k] = values[1];
    robot->parameters.backlash[k] = values[2];
}

static bool read_axis(er_rotation *rotation, er_lines *lines)
{
    const double *a = rotation->axis;
    if (!er_lines_numbers(lines, 3, rotation->axis))
        return false;
    rotation->along = ER_ASKEW;
    for (int k = 0; k < 3; k++)
        if (a[k] * a[k] == 1.0 && a[(k + 1) % 3] == 0.0 && a[(k + 2) % 3] == 0.0)
            rotation->along = k;
    return true;
}

static bool read_joint(er_robot *robot, er_lines *lines)
{
    er_rotation *rotation;
    if (robot->joints == ER_MAX_JOINTS)
        return er_fail(lines->failure, "the robot's data: expected at most %d joints, got more", ER_MAX_JOINTS);
    rotation = add_rotation(robot);
    rotation->drive = robot->joints;
    rotation->shifted = true;
    robot->drive_angle[robot->joints++] = robot->angles - 1;
    robot->first_error[robot->joints] = robot->errors;
    return er_lines_numbers(lines, 3, rotation->origin) && read_axis(rotation, lines);
}

/* Number of tilts that the last joint has. */
static int count_tilts(const er_robot *robot)
{
    return robot->angles - 1 - robot->drive_angle[robot->joints - 1];
}

/* Whether the last rotation is a joint's own and gives way. */
static bool is_spring(const er_robot *robot)
{
    return count_tilts(robot) == 0 && robot->rotation[robot->angles - 1].elastic >= 0;
}

static bool read_spring(er_robot *robot, er_lines *lines)
{
    double values[3];
    if (count_tilts(robot) > 0 || is_spring(robot))
        return er_lines_refuse(lines, "at most one spring for each joint, before its tilts");
    if (!er_lines_numbers(lines, 3, values))
        return false;
    add_elastic(robot, 0, values);
    return true;
}

static bool read_tilt(er_robot *robot, er_lines *lines)
{
    double values[3] = {0.0, 0.0, 0.0};
    er_rotation *rotation;
    if (count_tilts(robot) == 2)
        return er_lines_refuse(lines, "at most two tilts for each joint");
    rotation = add_rotation(robot);
    if (!read_axis(rotation, lines) || !er_lines_numbers(lines, 2, values))
        return false;
    add_elastic(robot, count_tilts(robot), values);
    return true;
}

static bool read_table(er_robot *robot, er_lines *lines)
{
    er_table *table;
    if (!is_spring(robot))
        return er_lines_refuse(lines, "a table behind its spring");
    table = &robot->table[robot->elastics - 1];
    if (!er_lines_count(lines, 5, ER_MAX_KNOTS, &table->points))
        return false;
    for (int k = 0; k < table->points; k++)
        if (!er_lines_numbers(lines, 1, &table->angle[k]) || !er_lines_numbers(lines, 1, &table->torque[k]))
            return false;
    return true;
}

/* A sine of the kinematic error of the last joint. */
static bool read_error(er_robot *robot, er_lines *lines)
{
    double v[3];
    if (count_tilts(robot) > 0 || robot->errors - robot->first_error[robot->joints - 1] == ER_MAX_ERRORS)
        return er_lines_refuse(lines, "at most eight sines of an error for each joint, before its tilts");
    if (!er_lines_numbers(lines, 3, v))
        return false;
    robot->error[robot->errors++] = (er_error_sine){v[0], v[1], v[2]};
    robot->first_error[robot->joints] = robot->errors;
    return true;
}

/* Points of the balancer of the last joint: angle, torque and slope each. */
static bool read_balancer(er_robot *robot, er_lines *lines)
{
    int k = robot->elastics - 1;
    er_balancer *balancer = &robot->balancer[robot->balancers];
    if (!is_spring(robot) || (robot->balancers > 0 && balancer[-1].coordinate == k))
        return er_lines_refuse(lines, "at most one balancer for each joint, behind its spring");
    balancer->coordinate = k;
    if (!er_lines_count(lines, 3, ER_MAX_BALANCER_POINTS, &balancer->points))
        return false;
    for (int j = 0; j < balancer->points; j++) {
        if (!er_lines_numbers(lines, 1, &balancer->angle[j]) || !er_lines_numbers(lines, 1, &balancer->torque[j]) ||
            !er_lines_numbers(lines, 1, &balancer->slope[j]))
            return false;
        if (j > 0 && !(balancer->angle[j] > balancer->angle[j - 1]))
            return er_lines_refuse(lines, "rising angles of a balancer");
    }
    robot->balancers++;
    return true;
}

/* An element of hysteresis; its share is its torque until all of its gear are known. */
static bool read_stop(er_robot *robot, er_lines *lines)
{
    int k = robot->elastics - 1, before = 0;
    double values[2];
    if (!is_spring(robot))
        return er_lines_refuse(lines, "an element of hysteresis behind its spring");
    for (int j = 0; j < robot->elements; j++)
        before += robot->element[j].coordinate == k;
    if (before == ER_MAX_STOPS)
        return er_lines_refuse(lines, "at most six elements of hysteresis for each joint");
    if (!er_lines_numbers(lines, 2, values))
        return false;
    if (!(values[0] > 0.0 && values[1] > 0.0))
        return er_lines_refuse(lines, "a torque and an angle above zero");
    robot->element[robot->elements++] = (er_element){k, values[0], values[1]};
    robot->parameters.hysteresis[k] += values[0];
    return true;
}

/* Inertia; friction, its slip angle, viscous, Stribeck's part and rate; gains, feed-forward, limit; friction by load. */
static bool read_motor(er_robot *robot, er_lines *lines)
{
    double v[12];
    if (!is_spring(robot) || (robot->motors > 0 && robot->motor[robot->motors - 1].joint == robot->joints - 1))
        return er_lines_refuse(lines, "at most one motor for each joint, behind its spring");
    if (!er_lines_numbers(lines, 12, v))
        return false;
    if (!(v[0] > 0.0 && v[2] > 0.0 && v[5] > 0.0))
        return er_lines_refuse(lines, "inertia, slip angle and Stribeck's rate above zero");
    robot->parameters.friction[robot->motors] = v[1];
    robot->motor[robot->motors++] =
        (er_motor){robot->joints - 1, robot->elastics - 1, v[0], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9],
                   v[10] > 0.0 ? v[10] : INFINITY, v[11]};
    return true;
}

/* What moves each coordinate, and which elements act on it. */
static void set_owners(er_robot *robot)
{
    int coordinates = robot->elastics + robot->motors, j = 0;
    for (int k = 0; k < ER_MAX_COORDINATES; k++)
        robot->motor_of[k] = -1;
    for (int i = 0; i < ER_MAX_JOINTS; i++)
        robot->joint_motor[i] = -1;
    for (int d = 0; d < robot->motors; d++) {
        robot->motor_of[robot->elastics + d] = d;
        robot->motor_of[robot->motor[d].coordinate] = d;
        robot->joint_motor[robot->motor[d].joint] = d;
    }
    for (int k = 0; k < coordinates; k++) {
        robot->first_element[k] = j;
        while (j < er_all_elements(robot) && robot->element[j].coordinate == k)
            j++;
    }
    robot->first_element[coordinates] = j;
}

/* Those of the motors come last; shares were torques. */
static void finish_elements(er_robot *robot)
{
    for (int j = 0; j < robot->elements; j++)
        robot->element[j].share /= robot->parameters.hysteresis[robot->element[j].coordinate];
    for (int d = 0; d < robot->motors; d++)
        robot->element[robot->elements + d] =
            (er_element){robot->elastics + d, 1.0, robot->motor[d].slip_angle};
}

/* Adds a body, given by mass, centre of mass and inertia about that, to the last rotation. */
static bool read_body(er_robot *robot, er_lines *lines)
{
    double v[10], *c = v + 1, *i = v + 4;
    er_body *body = &robot->rotation[robot->angles - 1].body;
    if (!er_lines_numbers(lines, 10, v))
        return false;
    robot->rotation[robot->angles - 1].loaded = true;
    body->mass += v[0];
    for (int k = 0; k < 3; k++)
        body->moment[k] += v[0] * c[k];
    body->inertia[0] += i[0] + v[0] * (c[1] * c[1] + c[2] * c[2]);
    body->inertia[1] += i[1] + v[0] * (c[0] * c[0] + c[2] * c[2]);
    body->inertia[2] += i[2] + v[0] * (c[0] * c[0] + c[1] * c[1]);
    body->inertia[3] += i[3] - v[0] * c[0] * c[1];
    body->inertia[4] += i[4] - v[0] * c[0] * c[2];
    body->inertia[5] += i[5] - v[0] * c[1] * c[2];
    return true;
}

/* A setting is a number above zero. */
static bool read_setting(er_robot *robot, er_lines *lines)
{
#define ER_PLACE_SETTING(name) {#name, &robot->settings.name},
    const struct {
        const char *name;
        double *value;
    } settings[] = {ER_EACH_SETTING(ER_PLACE_SETTING)};
    er_lines_word(lines);
    for (size_t k = 0; k < sizeof settings / sizeof *settings; k++)
        if (strcmp(lines->word, settings[k].name) == 0)
            return er_lines_numbers(lines, 1, settings[k].value) &&
                   (*settings[k].value > 0.0 || er_lines_refuse(lines, "a setting above zero"));
    return er_lines_refuse(lines, "the name of a setting");
}

static bool require_settings(const er_robot *robot, er_lines *lines)
{
#define ER_REQUIRE_SETTING(name)                                                                    \
    if (!(robot->settings.name > 0.0))                                                              \
        return er_fail(lines->failure, "the robot's data: expected each setting once, got no "      \
                       #name ": build the FMU again");
    ER_EACH_SETTING(ER_REQUIRE_SETTING)
    return true;
}

static bool read_guid(er_robot *robot, er_lines *lines)
{
    return er_lines_text(lines, ER_MAX_GUID, robot->guid, "a guid of less than 64 letters");
}

static bool read_gravity(er_robot *robot, er_lines *lines)
{
    return er_lines_numbers(lines, 3, robot->parameters.gravity);
}

static bool read_tcp(er_robot *robot, er_lines *lines)
{
    return er_lines_numbers(lines, 3, robot->tool_position) && er_lines_numbers(lines, 9, robot->tool_rotation);
}

/* Lines by their first word: those of the robot, then those of its last joint. */
static bool read_line(er_robot *robot, er_lines *lines)
{
    static const struct {
        const char *key;
        bool (*read)(er_robot *, er_lines *);
    } kinds[] = {{"guid", read_guid}, {"gravity", read_gravity}, {"tcp", read_tcp}, {"setting", read_setting},
                 {"joint", read_joint}, {"error", read_error}, {"spring", read_spring}, {"table", read_table},
                 {"balancer", read_balancer}, {"stop", read_stop}, {"motor", read_motor}, {"tilt", read_tilt},
                 {"body", read_body}};
    const size_t of_robot = 5, count = robot->joints > 0 ? sizeof kinds / sizeof *kinds : of_robot;
    for (size_t k = 0; k < count; k++)
        if (strcmp(lines->word, kinds[k].key) == 0)
            return kinds[k].read(robot, lines);
    return er_lines_refuse(lines, robot->joints == 0 ? "guid, gravity, tcp, setting or joint"
                                                     : "joint, error, spring, table, balancer, stop, motor, tilt, body or end");
}

static double origin_distance(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void set_reach(er_robot *robot)
{
    for (int k = 0; k < robot->elastics; k++) {
        robot->reach[k] = origin_distance(robot->tool_position);
        for (int angle = robot->elastic_angle[k] + 1; angle < robot->angles; angle++)
            robot->reach[k] += origin_distance(robot->rotation[angle].origin);
    }
}

bool er_robot_parse(er_robot *robot, er_lines *lines)
{
    int version = 0;
    memset(robot, 0, sizeof *robot);
    er_lines_word(lines);
    if (strcmp(lines->word, FORMAT) != 0)
        return er_lines_refuse(lines, "'" FORMAT "'");
    if (!er_lines_count(lines, VERSION, VERSION, &version) || !er_lines_next(lines))
        return false;
    while (strcmp(lines->word, "end") != 0)
        if (!read_line(robot, lines) || !er_lines_next(lines))
            return false;
    if (robot->joints == 0)
        return er_fail(lines->failure, "the robot's data: expected at least one joint, got none");
    set_reach(robot);
    finish_elements(robot);
    set_owners(robot);
    return require_settings(robot, lines);
}
