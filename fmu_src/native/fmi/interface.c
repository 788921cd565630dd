#include "interface.h"

#include <string.h>

/* The place of a block in the table. */
static bool read_block(er_lines *lines, int *block)
{
    er_lines_word(lines);
    for (*block = 0; *block < er_block_count; (*block)++)
        if (strcmp(lines->word, er_blocks[*block].name) == 0)
            return true;
    return er_lines_refuse(lines, "the name of a block of variables");
}

/* Lowest and highest angle of each drive. */
static bool read_limits(er_interface *in, int joints, er_lines *lines)
{
    for (int i = 0; i < joints; i++)
        if (!er_lines_numbers(lines, 2, in->limit[i]))
            return false;
    return true;
}

/* Blocks of the states and of their derivatives, and the nominal. */
static bool read_state(er_interface *in, er_lines *lines)
{
    er_state_block *state = &in->state[in->states];
    if (in->states == ER_MAX_STATES)
        return er_lines_refuse(lines, "fewer blocks of states");
    if (!read_block(lines, &state->block))
        return false;
    if (!er_is_state_block(state->block))
        return er_lines_refuse(lines, "a block of states");
    if (!read_block(lines, &state->derivative) || !er_lines_numbers(lines, 1, &state->nominal))
        return false;
    in->states++;
    return true;
}

static bool read_indicator(er_interface *in, er_lines *lines)
{
    int *block = &in->indicator[in->indicators];
    if (in->indicators == ER_MAX_STATES)
        return er_lines_refuse(lines, "fewer blocks of event indicators");
    if (!read_block(lines, block))
        return false;
    if (er_blocks[*block].kind != ER_LOCAL)
        return er_lines_refuse(lines, "a block of event indicators");
    in->indicators++;
    return true;
}

/* Block, unit and names of the elements of an array. */
static bool read_reals(er_interface *in, er_lines *lines)
{
    char unit[ER_UNIT];
    int block, first = in->reals;
    if (!read_block(lines, &block))
        return false;
    if (in->size[block] == 0)
        in->first[block] = first;
    if (in->first[block] + in->size[block] != first)
        return er_lines_refuse(lines, "each block's variables one after another");
    if (!er_lines_text(lines, ER_UNIT, unit, "a unit of less than 16 letters"))
        return false;
    do {
        int k = in->reals++;
        if (k == ER_MAX_REALS)
            return er_lines_refuse(lines, "at most as many reals as the largest robot has");
        if (!er_lines_text(lines, ER_NAME, in->name[k], "a name of less than 64 letters"))
            return false;
        for (char *letter = in->name[k]; *letter != '\0'; letter++)
            if (*letter == ER_BLANK)
                *letter = ' ';
        strcpy(in->unit[k], unit);
        in->block[k] = (unsigned char)block;
        in->size[block]++;
    } while (!er_lines_at_end(lines));
    in->array[first] = (unsigned char)(in->reals - first);
    return true;
}

/* Name, start value, which a string of any text need not have, and choices where there are any. */
static bool read_string(er_string *string, int choices, er_lines *lines)
{
    char start[ER_CHOICE] = "";
    if (!er_lines_text(lines, ER_NAME, string->name, "a name of less than 64 letters") ||
        (choices > 0 && !er_lines_text(lines, ER_CHOICE, start, "a start value")) ||
        (choices == 0 && !er_lines_at_end(lines) &&
         !er_lines_text(lines, ER_NAME, string->text, "a start value of less than 64 letters")))
        return false;
    string->start = choices > 0 ? -1 : 0;
    string->choices = choices;
    for (int k = 0; k < choices; k++) {
        if (!er_lines_text(lines, ER_CHOICE, string->choice[k], "one more choice"))
            return false;
        if (strcmp(start, string->choice[k]) == 0)
            string->start = k;
    }
    return string->start >= 0 || er_lines_refuse(lines, "choices with the start value among them");
}

/* How often a block of states or of local variables must be among the states, their derivatives and the event
 * indicators. */
static bool require_once(const er_interface *in, int block, int times, er_lines *lines)
{
    bool is_required = in->size[block] > 0 && (er_is_state_block(block) || er_blocks[block].kind == ER_LOCAL);
    return !is_required || times == 1 ||
           er_fail(lines->failure, "the robot's data: expected the block %s once among states, their derivatives and"
                                   " event indicators, got it %d times: build the FMU again",
                   er_blocks[block].name, times);
}

/* All that the model integrates is a state, all that there is of it and of events is told, each state has a
 * derivative. */
static bool require_exchange(const er_interface *in, er_lines *lines)
{
    int times[ER_MAX_BLOCKS] = {0};
    bool good = true;
    for (int k = 0; k < in->states; k++) {
        const er_state_block *state = &in->state[k];
        times[state->block]++;
        times[state->derivative]++;
        if (in->size[state->block] != in->size[state->derivative])
            return er_fail(lines->failure, "the robot's data: expected as many variables of the block %s as of %s,"
                                           " got others: build the FMU again",
                           er_blocks[state->derivative].name, er_blocks[state->block].name);
    }
    for (int k = 0; k < in->indicators; k++)
        times[in->indicator[k]]++;
    for (int k = 0; k < er_block_count && good; k++)
        good = require_once(in, k, times[k], lines);
    return good;
}

/* What the robot makes of the blocks must be what the model has. */
static bool require_sizes(er_interface *in, const er_robot *robot, er_lines *lines)
{
    in->elements = robot->elements;
    for (int k = 0; k < robot->elastics; k++) {
        if (robot->elastic_tilt[k] == 0)
            in->torsion[in->torsions++] = k;
        if (robot->parameters.hysteresis[k] > 0.0)
            in->hysteretic[in->hysteretics++] = k;
    }
    for (int k = 0; k < er_block_count; k++) {
        const er_block *block = &er_blocks[k];
        int size = block->fixed + block->joint * robot->joints + block->elastic * robot->elastics +
                   block->torsion * in->torsions + block->hysteretic * in->hysteretics +
                   block->element * robot->elements + block->motor * robot->motors;
        if (in->size[k] != size)
            return er_fail(lines->failure, "the robot's data: expected %d variables of the block %s,"
                                           " got %d: build the FMU again", size, block->name, in->size[k]);
    }
    return true;
}

bool er_interface_parse(er_interface *in, const er_robot *robot, er_lines *lines)
{
    const int choices[ER_STRINGS] = {0, er_gear_laws, 2, ER_INITIALS, ER_DRIVES};
    double tolerance[4];
    memset(in, 0, sizeof *in);
    if (!er_lines_next(lines) || !er_lines_key(lines, "tolerance") ||
        !er_lines_numbers(lines, 4, tolerance) || !er_lines_next(lines))
        return false;
    for (int k = 0; k < 4; k++)
        if (!(tolerance[k] > 0.0))
            return er_fail(lines->failure, "the robot's data: expected tolerances > 0, got %g: build the"
                           " FMU again", tolerance[k]);
    in->tolerance = (er_tolerance){tolerance[0], tolerance[1], tolerance[2], tolerance[3]};
    while (strcmp(lines->word, "state") == 0)
        if (!read_state(in, lines) || !er_lines_next(lines))
            return false;
    while (strcmp(lines->word, "indicator") == 0)
        if (!read_indicator(in, lines) || !er_lines_next(lines))
            return false;
    if (!er_lines_key(lines, "limits") || !read_limits(in, robot->joints, lines) || !er_lines_next(lines))
        return false;
    while (strcmp(lines->word, "reals") == 0)
        if (!read_reals(in, lines) || !er_lines_next(lines))
            return false;
    for (int k = 0; k < ER_STRINGS; k++)
        if (!er_lines_key(lines, "string") || !read_string(&in->string[k], choices[k], lines) || !er_lines_next(lines))
            return false;
    return er_lines_key(lines, "end") && require_sizes(in, robot, lines) && require_exchange(in, lines);
}

bool er_require_range(const er_interface *interface, unsigned reference, double value, er_failure *failure)
{
    er_range range = er_block_of(interface, reference)->range;
    char number[ER_NUMBER_TEXT];
    if (range == ER_ANY_NUMBER || (range == ER_POSITIVE ? value > 0.0 : value >= 0.0))
        return true;
    return er_fail(failure, "%s: expected a number %s, got %s %s", interface->name[reference],
                   range == ER_POSITIVE ? "> 0" : ">= 0", er_shown(value, number), interface->unit[reference]);
}
