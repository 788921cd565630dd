/* The FMU's variables: the table of elastic_robot/fmi/interface.py, as robot.txt has it.
 *
 * What a variable means, to read or to set it, is known by its block and its place in it; so is whether
 * it is an input, an output or a parameter.
 */
#ifndef ER_INTERFACE_H
#define ER_INTERFACE_H

#include <stddef.h>

#include "../core/model.h"

typedef struct er_instance er_instance;

/* As many blocks of reals, reals and blocks of states or event indicators as there may be. */
enum { ER_MAX_BLOCKS = 64, /* as a mask has bits */
       ER_MAX_REALS = 1024,
       ER_MAX_STATES = 8 };

#define ER_BIT(place) (UINT64_C(1) << (place))

typedef enum { ER_INPUT,
               ER_OUTPUT,
               ER_TUNABLE,
               ER_FIXED,
               ER_LOCAL } er_kind;

/* What a number may be. */
typedef enum { ER_ANY_NUMBER,
               ER_NOT_NEGATIVE,
               ER_POSITIVE } er_range;

/* A block of reals: what it is, and what reads, sets and differentiates it. */
typedef struct {
    const char *name; /* in the table */
    er_kind kind;
    /* Variables: so many, and so many for each of the robot's; `hysteretic` are torsions with elements. */
    int fixed, joint, elastic, torsion, hysteretic, element, motor;
    bool behind_elements; /* in their place those of the gears' elements come first */
    er_range range;
    /* Of inputs and parameters: their place in er_inputs, in bytes; that in er_state of what lies in the state. */
    size_t place;
    size_t along; /* and where er_change has how they change */
    size_t rate;  /* place in er_inputs of an input's derivative by time; 0: it has none */
    er_cause cause; /* of inputs and parameters: what the motion follows with them */
    void (*watch)(er_instance *instance, int reference); /* what else happens when one is set, or NULL */
    /* Of outputs and local variables: their values, and their derivatives along a change; NULL where they lie in the
     * state. */
    bool (*find)(er_instance *instance, double *values);
    bool (*differentiate)(er_instance *instance, const er_change *change, double *derivatives);
    bool from_value; /* the derivatives need the values */
} er_block;

/* The table, in blocks.c. */
extern const er_block er_blocks[];
extern const int er_block_count;

/* String variables, in their order; the choices of all but the first are those of er_options. */
enum { ER_TRAJECTORY,
       ER_TORQUE_CURVE,
       ER_MODE,
       ER_INITIAL_STATE,
       ER_DRIVE,
       ER_STRINGS };

#define ER_MAX_CHOICES ER_MAX_LAWS
#define ER_NAME 64
#define ER_BLANK '~' /* stands for a blank in a name */
#define ER_UNIT 16
#define ER_CHOICE 32

typedef struct {
    char name[ER_NAME];
    char text[ER_NAME]; /* start value where it may be any text */
    int start;   /* its place among the choices */
    int choices; /* 0: any text */
    char choice[ER_MAX_CHOICES][ER_CHOICE];
} er_string;

/* Errors allowed at the TCP [m]: to begin with, which an experiment's relative tolerance is in proportion to,
 * and the least and the most that follow from one. */
typedef struct {
    double usual, relative, least, most;
} er_tolerance;

/* A block of continuous states, and that of their derivatives by time, as STATES of elastic_robot/fmi/outputs.py has
 * them. */
typedef struct {
    int block, derivative;
    double nominal; /* usual size of one */
} er_state_block;

/* Value references count from 0 through the reals, by blocks, and go on through the strings to time. */
typedef struct {
    er_tolerance tolerance;
    int states;                  /* blocks of states of model exchange, in their order */
    er_state_block state[ER_MAX_STATES];
    int indicators;              /* blocks of event indicators, in their order */
    int indicator[ER_MAX_STATES];
    double limit[ER_MAX_JOINTS][2]; /* lowest and highest angle of each drive [rad]; infinite without */
    int reals;
    int first[ER_MAX_BLOCKS];        /* value reference of each block's first variable */
    int size[ER_MAX_BLOCKS];         /* its number of variables */
    int elements;                    /* of gears' hysteresis */
    int torsions;                    /* entries of x with a backlash */
    int torsion[ER_MAX_JOINTS];      /* these entries */
    int hysteretics;                 /* entries of x with elements of hysteresis */
    int hysteretic[ER_MAX_JOINTS];   /* these entries */
    unsigned char block[ER_MAX_REALS]; /* of each real */
    unsigned char array[ER_MAX_REALS]; /* elements of the FMI 3.0 variable that starts there, or 0 */
    char name[ER_MAX_REALS][ER_NAME];  /* of each real, in sentences */
    char unit[ER_MAX_REALS][ER_UNIT];
    er_string string[ER_STRINGS];
} er_interface;

/* Reads the lines that `coupling.fmu_export.native_fmu` writes, and checks them for the robot. */
bool er_interface_parse(er_interface *interface, const er_robot *robot, er_lines *lines);

static inline const er_block *er_block_of(const er_interface *interface, unsigned reference)
{
    return &er_blocks[interface->block[reference]];
}

/* Place of a variable in its block, by the robot's entries of x where that has one for each torsion. */
static inline int er_entry(const er_interface *interface, unsigned reference)
{
    int block = interface->block[reference], k = (int)reference - interface->first[block];
    return er_blocks[block].torsion > 0       ? interface->torsion[k]
           : er_blocks[block].hysteretic > 0  ? interface->hysteretic[k]
           : er_blocks[block].behind_elements ? interface->elements + k
                                              : k;
}

/* Whether it is an output or local, computed when it is read. */
static inline bool er_is_computed(const er_block *block)
{
    return block->kind == ER_OUTPUT || block->kind == ER_LOCAL;
}

/* Whether a block, by its place, is of continuous states: outputs that lie in the model's state. */
static inline bool er_is_state_block(int block)
{
    return er_blocks[block].kind == ER_OUTPUT && er_blocks[block].place > 0;
}

/* Whether it is a continuous state of model exchange. */
static inline bool er_is_state(const er_interface *interface, unsigned reference)
{
    return er_is_state_block(interface->block[reference]);
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

/* Refuses a value that is out of the range of a parameter or of a contact's number; others have none. */
bool er_require_range(const er_interface *interface, unsigned reference, double value, er_failure *failure);

#endif
