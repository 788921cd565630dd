#include "robot_data.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../io/number.h"
#include "../io/text_file.h"

#define FORMAT "elastic-robot"
#define VERSION 1
#define MOST_WORD 80

/* Where the text is read, and the joint that the present lines belong to. */
typedef struct {
    const char *at;
    int line;
    char word[MOST_WORD];
    er_robot *robot;
    er_failure *failure;
} reader;

static bool refuse(reader *r, const char *needed)
{
    return er_fail(r->failure, "the robot's data, line %d: found '%s'; needed is %s", r->line,
                   r->word, needed);
}

static void skip_blanks(reader *r)
{
    while (*r->at == ' ' || *r->at == '\t' || *r->at == '\r')
        r->at++;
}

static void read_word(reader *r)
{
    size_t length = 0;
    skip_blanks(r);
    for (; *r->at > ' '; r->at++)
        if (length + 1 < MOST_WORD)
            r->word[length++] = *r->at;
    r->word[length] = '\0';
}

static bool read_numbers(reader *r, int count, double *values)
{
    for (int k = 0; k < count; k++) {
        skip_blanks(r);
        if (!er_read_number(&r->at, &values[k])) {
            read_word(r);
            return refuse(r, "a finite number");
        }
    }
    return true;
}

static bool read_count(reader *r, int least, int most, int *count)
{
    double value;
    if (!read_numbers(r, 1, &value))
        return false;
    if (!(value >= least && value <= most) || value != floor(value))
        return er_fail(r->failure, "the robot's data, line %d: found %g; needed is a whole number"
                       " from %d to %d", r->line, value, least, most);
    *count = (int)value;
    return true;
}

static er_rotation *add_rotation(reader *r)
{
    er_robot *robot = r->robot;
    er_rotation *rotation;
    if (robot->angles == ER_MAX_ANGLES)
        return NULL;
    rotation = &robot->rotation[robot->angles++];
    memset(rotation, 0, sizeof *rotation);
    rotation->drive = rotation->elastic = -1;
    return rotation;
}

/* Lets the last rotation give way with stiffness, damping and backlash. */
static void add_elastic(reader *r, int tilt, const double values[3])
{
    er_robot *robot = r->robot;
    int k = robot->elastics++;
    robot->rotation[robot->angles - 1].elastic = k;
    robot->elastic_angle[k] = robot->angles - 1;
    robot->elastic_joint[k] = robot->joints - 1;
    robot->elastic_tilt[k] = tilt;
    robot->parameters.stiffness[k] = values[0];
    robot->parameters.damping[k] = values[1];
    robot->parameters.backlash[k] = values[2];
}

static bool read_joint(reader *r)
{
    er_robot *robot = r->robot;
    er_rotation *rotation;
    if (robot->joints == ER_MAX_JOINTS)
        return er_fail(r->failure, "the robot has more than %d joints; needed are at most %d",
                       ER_MAX_JOINTS, ER_MAX_JOINTS);
    rotation = add_rotation(r);
    rotation->drive = robot->joints;
    rotation->shifted = true;
    robot->drive_angle[robot->joints++] = robot->angles - 1;
    return read_numbers(r, 3, rotation->origin) && read_numbers(r, 3, rotation->axis);
}

static bool read_tilt(reader *r)
{
    double values[3] = {0.0, 0.0, 0.0};
    int before = r->robot->elastics, order = 1;
    er_rotation *rotation = add_rotation(r);
    if (rotation == NULL)
        return refuse(r, "at most two tilts for each joint");
    if (before > 0 && r->robot->elastic_joint[before - 1] == r->robot->joints - 1)
        order = r->robot->elastic_tilt[before - 1] + 1;
    if (!read_numbers(r, 3, rotation->axis) || !read_numbers(r, 2, values))
        return false;
    add_elastic(r, order, values);
    return true;
}

static bool read_table(reader *r)
{
    er_table *table = &r->robot->table[r->robot->elastics - 1];
    if (r->robot->elastics == 0 || !read_count(r, 5, ER_MAX_KNOTS, &table->points))
        return refuse(r, "a table behind its spring");
    for (int k = 0; k < table->points; k++)
        if (!read_numbers(r, 1, &table->angle[k]) || !read_numbers(r, 1, &table->torque[k]))
            return false;
    return true;
}

/* Adds a body, given by mass, centre of mass and inertia about that, to the last rotation. */
static bool read_body(reader *r)
{
    double v[10], *c = v + 1, *i = v + 4;
    er_body *body = &r->robot->rotation[r->robot->angles - 1].body;
    if (r->robot->angles == 0)
        return refuse(r, "a joint before its body");
    if (!read_numbers(r, 10, v))
        return false;
    r->robot->rotation[r->robot->angles - 1].loaded = true;
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

static bool read_line(reader *r)
{
    double values[3];
    if (strcmp(r->word, "guid") == 0) {
        read_word(r);
        if (strlen(r->word) >= ER_MAX_GUID)
            return refuse(r, "a shorter guid");
        strcpy(r->robot->guid, r->word);
        return true;
    }
    if (strcmp(r->word, "gravity") == 0)
        return read_numbers(r, 3, r->robot->parameters.gravity);
    if (strcmp(r->word, "tcp") == 0)
        return read_numbers(r, 3, r->robot->tool_position) &&
               read_numbers(r, 9, r->robot->tool_rotation);
    if (strcmp(r->word, "joint") == 0)
        return read_joint(r);
    if (r->robot->joints == 0)
        return refuse(r, "guid, gravity, tcp or joint");
    if (strcmp(r->word, "spring") == 0) {
        if (!read_numbers(r, 3, values))
            return false;
        add_elastic(r, 0, values);
        return true;
    }
    if (strcmp(r->word, "table") == 0)
        return read_table(r);
    if (strcmp(r->word, "tilt") == 0)
        return read_tilt(r);
    if (strcmp(r->word, "body") == 0)
        return read_body(r);
    return refuse(r, "joint, spring, table, tilt, body or end");
}

bool er_robot_parse(er_robot *robot, const char *text, er_failure *failure)
{
    reader r = {text, 1, "", robot, failure};
    int version = 0;
    memset(robot, 0, sizeof *robot);
    read_word(&r);
    if (strcmp(r.word, FORMAT) != 0)
        return refuse(&r, "'" FORMAT "'");
    if (!read_count(&r, VERSION, VERSION, &version))
        return false;
    for (;;) {
        skip_blanks(&r);
        if (*r.at != '\n' && *r.at != '\0') {
            read_word(&r);
            return refuse(&r, "the line's end");
        }
        if (*r.at == '\0') {
            strcpy(r.word, "the text's end");
            return refuse(&r, "the line 'end'");
        }
        r.at++;
        r.line++;
        read_word(&r);
        if (strcmp(r.word, "end") == 0)
            break;
        if (r.word[0] != '\0' && !read_line(&r))
            return false;
    }
    if (robot->joints == 0)
        return er_fail(failure, "the robot's data have no joint; needed is at least one");
    return true;
}

bool er_robot_read(er_robot *robot, const char *path, er_failure *failure)
{
    size_t size;
    char *text = er_read_file(path, &size);
    bool good;
    if (text == NULL)
        return er_fail(failure, "the robot's data %s cannot be read: %s", path, strerror(errno));
    good = er_robot_parse(robot, text, failure);
    free(text);
    return good;
}
