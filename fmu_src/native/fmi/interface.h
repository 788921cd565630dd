/* The FMU's variables: the table of elastic_robot/interface.py, in the order of its value references. */
#ifndef ER_INTERFACE_H
#define ER_INTERFACE_H

#include "../core/robot_data.h"

/* Blocks of variables; the reals first, the strings last. */
typedef enum {
    ER_WRENCH,
    ER_Q_CMD,
    ER_QD_CMD,
    ER_QDD_CMD,
    ER_TCP,
    ER_VELOCITY,
    ER_RIGID,
    ER_DEVIATION,
    ER_COMPLIANCE,
    ER_DEFLECTION,
    ER_GRAVITY,
    ER_STIFFNESS,
    ER_DAMPING,
    ER_BACKLASH_WIDTH,
    ER_STRINGS,
    ER_BLOCKS
} er_block;

enum { ER_TRAJECTORY, ER_TORQUE_CURVE, ER_MODE, ER_INITIAL_STATE, ER_STRING_COUNT };

/* More reals than any robot has: 6 + 29 + 3 + 4 per joint and 3 per elastic coordinate. */
#define ER_MAX_REALS (38 + 4 * ER_MAX_JOINTS + 3 * ER_MAX_ANGLES)

typedef struct {
    int first[ER_BLOCKS + 1];          /* value reference of each block's first variable */
    unsigned char block[ER_MAX_REALS]; /* of each real variable */
    int twist[ER_MAX_JOINTS];          /* entry of x of each backlash */
} er_layout;

void er_layout_of(const er_robot *robot, er_layout *layout);

/* Number of real variables. */
static inline int er_real_count(const er_layout *layout)
{
    return layout->first[ER_STRINGS];
}

static inline bool er_is_input(er_block block)
{
    return block <= ER_QDD_CMD;
}

static inline bool er_is_output(er_block block)
{
    return block >= ER_TCP && block <= ER_DEFLECTION;
}

/* FMI 3.0 joins reals to arrays, which have the value reference of their first element: number of
 * elements of the variable with a reference, 0 if there is none. */
int er_array_size(const er_layout *layout, unsigned reference);

#define ER_VARIABLE_TEXT 64

/* Name of a real variable, as in modelDescription.xml, and its unit. */
void er_variable_name(const er_layout *layout, const er_robot *robot, int reference,
                      char name[ER_VARIABLE_TEXT]);
const char *er_variable_unit(const er_layout *layout, int reference);

/* One value of a block of parameters by its place; NULL if it is not a block of parameters. */
double *er_parameter(const er_layout *layout, er_parameters *parameters, er_block block, int k);

/* Refuses parameters that cannot be those of a robot, with the name of the first. */
bool er_require_parameters(const er_layout *layout, const er_robot *robot,
                           const er_parameters *parameters, er_failure *failure);

#endif
