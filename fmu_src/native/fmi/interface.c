#include "interface.h"

#include <stdio.h>
#include <string.h>

void er_layout_of(const er_robot *robot, er_layout *layout)
{
    int n = robot->joints, m = robot->elastics, twists = 0, reference = 0;
    for (int k = 0; k < m; k++)
        if (robot->elastic_tilt[k] == 0)
            layout->twist[twists++] = k;
    {
        const int size[ER_BLOCKS] = {6, n, n, n, 7, 3, 7, 6, 6, m, 3, m, m, twists, ER_STRING_COUNT};
        for (int block = 0; block < ER_BLOCKS; block++) {
            layout->first[block] = reference;
            if (block != ER_STRINGS)
                memset(layout->block + reference, block, (size_t)size[block]);
            reference += size[block];
        }
        layout->first[ER_BLOCKS] = reference;
    }
}

int er_array_size(const er_layout *layout, unsigned reference)
{
    er_block block;
    int k, size;
    if (reference >= (unsigned)er_real_count(layout))
        return 0;
    block = (er_block)layout->block[reference];
    k = (int)reference - layout->first[block];
    size = layout->first[block + 1] - layout->first[block];
    switch (block) {
    case ER_WRENCH: case ER_TCP: case ER_RIGID: case ER_DEVIATION: /* place and turn */
        return k == 0 ? 3 : k == 3 ? size - 3 : 0;
    case ER_STIFFNESS: case ER_DAMPING: case ER_BACKLASH_WIDTH: /* scalars that name their joint */
        return 1;
    default:
        return k == 0 ? size : 0;
    }
}

void er_variable_name(const er_layout *layout, const er_robot *robot, int reference,
                      char name[ER_VARIABLE_TEXT])
{
    static const char *const axis[] = {"x", "y", "z"};
    static const char *const pose[] = {"x", "y", "z", "qx", "qy", "qz", "qw"};
    static const char *const tensor[] = {"xx", "xy", "xz", "yy", "yz", "zz"};
    static const char *const drive[] = {"q_cmd", "qd_cmd", "qdd_cmd"};
    static const char *const property[] = {"stiffness", "damping", "backlash"};
    er_block block = (er_block)layout->block[reference];
    int k = reference - layout->first[block];
    switch (block) {
    case ER_WRENCH:
        snprintf(name, ER_VARIABLE_TEXT, "%s.%s", k < 3 ? "force" : "moment", axis[k % 3]);
        break;
    case ER_Q_CMD: case ER_QD_CMD: case ER_QDD_CMD:
        snprintf(name, ER_VARIABLE_TEXT, "%s[%d]", drive[block - ER_Q_CMD], k + 1);
        break;
    case ER_TCP: case ER_RIGID:
        snprintf(name, ER_VARIABLE_TEXT, "%s.%s", block == ER_TCP ? "tcp" : "rigid", pose[k]);
        break;
    case ER_VELOCITY:
        snprintf(name, ER_VARIABLE_TEXT, "tcp.v%s", axis[k]);
        break;
    case ER_DEVIATION:
        snprintf(name, ER_VARIABLE_TEXT, "deviation.%s%s", k < 3 ? "" : "r", axis[k % 3]);
        break;
    case ER_COMPLIANCE:
        snprintf(name, ER_VARIABLE_TEXT, "compliance.%s", tensor[k]);
        break;
    case ER_DEFLECTION:
        snprintf(name, ER_VARIABLE_TEXT, "deflection[%d]", k + 1);
        break;
    case ER_GRAVITY:
        snprintf(name, ER_VARIABLE_TEXT, "gravity.%s", axis[k]);
        break;
    default: {
        int x = block == ER_BACKLASH_WIDTH ? layout->twist[k] : k;
        int joint = robot->elastic_joint[x] + 1, tilt = robot->elastic_tilt[x];
        const char *what = property[block - ER_STIFFNESS];
        if (tilt == 0)
            snprintf(name, ER_VARIABLE_TEXT, "joint[%d].%s", joint, what);
        else
            snprintf(name, ER_VARIABLE_TEXT, "joint[%d].tilt[%d].%s", joint, tilt, what);
    }
    }
}

const char *er_variable_unit(const er_layout *layout, int reference)
{
    er_block block = (er_block)layout->block[reference];
    int k = reference - layout->first[block];
    switch (block) {
    case ER_WRENCH: return k < 3 ? "N" : "N.m";
    case ER_QD_CMD: return "rad/s";
    case ER_QDD_CMD: return "rad/s2";
    case ER_TCP: case ER_RIGID: return k < 3 ? "m" : "1";
    case ER_VELOCITY: return "m/s";
    case ER_DEVIATION: return k < 3 ? "m" : "rad";
    case ER_COMPLIANCE: return "m/N";
    case ER_GRAVITY: return "m/s2";
    case ER_STIFFNESS: return "N.m/rad";
    case ER_DAMPING: return "N.m.s/rad";
    default: return "rad";
    }
}

double *er_parameter(const er_layout *layout, er_parameters *parameters, er_block block, int k)
{
    switch (block) {
    case ER_GRAVITY: return &parameters->gravity[k];
    case ER_STIFFNESS: return &parameters->stiffness[k];
    case ER_DAMPING: return &parameters->damping[k];
    case ER_BACKLASH_WIDTH: return &parameters->backlash[layout->twist[k]];
    default: return NULL;
    }
}

bool er_require_parameters(const er_layout *layout, const er_robot *robot,
                           const er_parameters *parameters, er_failure *failure)
{
    er_parameters given = *parameters;
    for (int reference = layout->first[ER_STIFFNESS]; reference < er_real_count(layout);
         reference++) {
        er_block block = (er_block)layout->block[reference];
        double value = *er_parameter(layout, &given, block, reference - layout->first[block]);
        if (block == ER_STIFFNESS ? !(value > 0.0) : !(value >= 0.0)) {
            char name[ER_VARIABLE_TEXT], number[ER_NUMBER_TEXT];
            er_variable_name(layout, robot, reference, name);
            return er_fail(failure, "%s is %s %s; needed is a number %s", name,
                           er_shown(value, number), er_variable_unit(layout, reference),
                           block == ER_STIFFNESS ? "> 0" : ">= 0");
        }
    }
    return true;
}
