/* The FMU's variables: the table of elastic_robot/fmi/interface.py, as robot.txt has it.
 *
 * What a variable means, to read or to set it, is known by its block and its place in it; so is whether
 * it is an input, an output or a parameter.
 */
#ifndef ER_INTERFACE_H
#define ER_INTERFACE_H

#include "../core/anchor.h"
#include "../core/curves.h"

/* Blocks of reals: inputs, outputs, parameters, then what model exchange asks for beside them.  Each has its name in the table and its number
 * of variables: so many, and so many for each joint, elastic coordinate and torsion. */
#define ER_BLOCK_TABLE(BLOCK) \
    BLOCK(ER_WRENCH, "wrench", 6, 0, 0, 0) \
    BLOCK(ER_Q_CMD, "q_cmd", 0, 1, 0, 0) \
    BLOCK(ER_QD_CMD, "qd_cmd", 0, 1, 0, 0) \
    BLOCK(ER_QDD_CMD, "qdd_cmd", 0, 1, 0, 0) \
    BLOCK(ER_ANCHOR, "anchor", 3, 0, 0, 0) \
    BLOCK(ER_ANCHOR_VELOCITY, "anchor_velocity", 3, 0, 0, 0) \
    BLOCK(ER_ANCHOR_STIFFNESS, "anchor_stiffness", ER_SYMMETRIC, 0, 0, 0) \
    BLOCK(ER_WRENCH_RATE, "wrench_rate", 6, 0, 0, 0) \
    BLOCK(ER_CONTACT, "contact", 5, 0, 0, 0) \
    BLOCK(ER_CONTACT_NORMAL, "contact_normal", 3, 0, 0, 0) \
    BLOCK(ER_TCP, "tcp", 7, 0, 0, 0) \
    BLOCK(ER_VELOCITY, "velocity", 3, 0, 0, 0) \
    BLOCK(ER_RIGID, "rigid", 7, 0, 0, 0) \
    BLOCK(ER_DEVIATION, "deviation", 6, 0, 0, 0) \
    BLOCK(ER_COMPLIANCE, "compliance", 6, 0, 0, 0) \
    BLOCK(ER_DEFLECTION, "deflection", 0, 0, 1, 0) \
    BLOCK(ER_DEFLECTION_RATE, "deflection_rate", 0, 0, 1, 0) \
    BLOCK(ER_CONTACT_FORCE, "contact_force", 3, 0, 0, 0) \
    BLOCK(ER_GRAVITY, "gravity", 3, 0, 0, 0) \
    BLOCK(ER_STIFFNESS, "stiffness", 0, 0, 1, 0) \
    BLOCK(ER_DAMPING, "damping", 0, 0, 1, 0) \
    BLOCK(ER_BACKLASH_WIDTH, "backlash", 0, 0, 0, 1) \
    BLOCK(ER_TCP_TOLERANCE, "tolerance", 1, 0, 0, 0) \
    BLOCK(ER_DEFLECTION_DERIVATIVE, "deflection_derivative", 0, 0, 1, 0) \
    BLOCK(ER_RATE_DERIVATIVE, "rate_derivative", 0, 0, 1, 0) \
    BLOCK(ER_BEND, "bend", 0, 0, 0, 2) \
    BLOCK(ER_CONTACT_GAP, "contact_gap", 1, 0, 0, 0)

#define ER_BLOCK_CONSTANT(block, name, fixed, joint, elastic, torsion) block,
typedef enum { ER_BLOCK_TABLE(ER_BLOCK_CONSTANT) ER_BLOCKS } er_block;

/* As many reals as the largest robot has. */
#define ER_BLOCK_MOST(block, name, fixed, joint, elastic, torsion) \
    +fixed + (joint + torsion) * ER_MAX_JOINTS + elastic * ER_MAX_ANGLES
enum { ER_MAX_REALS = ER_BLOCK_TABLE(ER_BLOCK_MOST) };

/* String variables, in their order; the choices of the last three are those of er_options. */
enum { ER_TRAJECTORY, ER_TORQUE_CURVE, ER_MODE, ER_INITIAL_STATE, ER_STRINGS };

#define ER_MAX_CHOICES ER_CURVES
#define ER_NAME 64
#define ER_BLANK '~' /* stands for a blank in a name */
#define ER_UNIT 16
#define ER_CHOICE 16

typedef struct {
    char name[ER_NAME];
    int start;   /* its place among the choices */
    int choices; /* 0: any text */
    char choice[ER_MAX_CHOICES][ER_CHOICE];
} er_string;

/* Errors allowed at the TCP [m]: to begin with, which an experiment's relative tolerance is in proportion to,
 * and the least and the most that follow from one. */
typedef struct {
    double usual, relative, least, most;
} er_tolerance;

/* Value references count from 0 through the reals, by blocks, and go on through the strings to time. */
typedef struct {
    er_tolerance tolerance;
    double nominal[2];           /* of the states: angles [rad] and rates [rad/s] */
    double limit[ER_MAX_JOINTS][2]; /* lowest and highest angle of each drive [rad]; infinite without */
    int reals;
    int first[ER_BLOCKS];        /* value reference of each block's first variable */
    int size[ER_BLOCKS];         /* its number of variables */
    int torsion[ER_MAX_JOINTS];    /* entry of x of each backlash */
    unsigned char block[ER_MAX_REALS]; /* of each real */
    unsigned char array[ER_MAX_REALS]; /* elements of the FMI 3.0 variable that starts there, or 0 */
    char name[ER_MAX_REALS][ER_NAME];  /* of each real, in sentences */
    char unit[ER_MAX_REALS][ER_UNIT];
    er_string string[ER_STRINGS];
} er_interface;

/* Reads the lines that `coupling.fmu_export.interface_text` writes, and checks them for the robot. */
bool er_interface_parse(er_interface *interface, const er_robot *robot, er_lines *lines);

static inline bool er_is_input(er_block block)
{
    return block < ER_TCP;
}

static inline bool er_is_output(er_block block)
{
    return block >= ER_TCP && block < ER_GRAVITY;
}

/* Whether it is an output or local, computed when it is read. */
static inline bool er_is_computed(er_block block)
{
    return er_is_output(block) || block > ER_TCP_TOLERANCE;
}

/* Whether it is a parameter that may change while the model runs. */
static inline bool er_is_tunable(er_block block)
{
    return block >= ER_GRAVITY && block <= ER_BACKLASH_WIDTH;
}

/* Whether it is a continuous state of model exchange. */
static inline bool er_is_state(er_block block)
{
    return block == ER_DEFLECTION || block == ER_DEFLECTION_RATE;
}

/* Elements of the FMI 3.0 variable with a value reference, 0 if there is none. */
static inline int er_array_size(const er_interface *interface, unsigned reference)
{
    return reference < (unsigned)interface->reals ? interface->array[reference] : 0;
}

/* Value reference of time. */
static inline unsigned er_time_reference(const er_interface *interface)
{
    return (unsigned)interface->reals + ER_STRINGS;
}

/* One value of a block of parameters by its place; NULL if it is not a block of parameters. */
double *er_parameter(const er_interface *interface, er_parameters *parameters, er_block block, int k);

/* Refuses a value that is out of the range of a parameter or of a contact's number; others have none. */
bool er_require_range(const er_interface *interface, unsigned reference, double value,
                      er_failure *failure);

#endif
