/* What a motion follows, cause by cause, and the columns that it has for each. */
#include "sensitivity.h"

#include <string.h>

/* Columns of a cause. */
static int columns_of(const er_robot *robot, er_cause cause)
{
    switch (cause) {
    case ER_BY_WRENCH:
    case ER_BY_RATE: return 6;
    case ER_BY_SPRING: return ER_SYMMETRIC;
    case ER_BY_CONTACT: return 5;
    case ER_BY_ANCHOR:
    case ER_BY_ANCHOR_VELOCITY:
    case ER_BY_NORMAL:
    case ER_BY_GRAVITY: return 3;
    case ER_BY_Q:
    case ER_BY_QD:
    case ER_BY_QDD: return robot->joints;
    case ER_BY_FRICTION:
    case ER_BY_TORQUE: return robot->motors;
    default: return robot->elastics;
    }
}

int er_first_column(const er_robot *robot, er_cause cause)
{
    int first = 0;
    for (int before = 0; before < (int)cause; before++)
        first += columns_of(robot, (er_cause)before);
    return first;
}

er_cause er_cause_of(const er_robot *robot, int column, int *entry)
{
    er_cause cause = ER_BY_WRENCH;
    for (*entry = column; *entry >= columns_of(robot, cause); cause++)
        *entry -= columns_of(robot, cause);
    return cause;
}

void er_parameter_along(const er_robot *robot, int column, double factor, er_parameters *change)
{
    int entry;
    switch (er_cause_of(robot, column, &entry)) {
    case ER_BY_GRAVITY: change->gravity[entry] += factor; break;
    case ER_BY_STIFFNESS: change->stiffness[entry] += factor; break;
    case ER_BY_DAMPING: change->damping[entry] += factor; break;
    case ER_BY_BACKLASH: change->backlash[entry] += factor; break;
    case ER_BY_HYSTERESIS: change->hysteresis[entry] += factor; break;
    case ER_BY_FRICTION: change->friction[entry] += factor; break;
    default: break;
    }
}

double *er_contact_entry(er_contact *contact, int place)
{
    double *const entries[] = {&contact->stiffness, &contact->dissipation, &contact->radius,
                               &contact->friction, &contact->slip_speed};
    return place < 5 ? entries[place] : &contact->normal[place - 5];
}

er_share er_share_of(const er_sensitivity *s, const er_robot *robot, int column, double elapsed)
{
    er_share share;
    int entry;
    er_cause cause = er_cause_of(robot, column, &entry);
    memset(&share, 0, sizeof share);
    share.joint = -1;
    switch (cause) {
    case ER_BY_WRENCH: share.load.wrench[entry] = 1.0; break;
    case ER_BY_Q:
    case ER_BY_QD:
    case ER_BY_QDD:
        if (s->drive == ER_TORQUE && robot->joint_motor[entry] >= 0)
            return share;
        share.joint = entry;
        er_command_at(s->commanded[entry][cause - ER_BY_Q], elapsed, &share.q, &share.qd, &share.qdd);
        break;
    case ER_BY_ANCHOR: share.load.anchor.position[entry] = 1.0; break;
    case ER_BY_ANCHOR_VELOCITY:
        share.load.anchor.position[entry] = elapsed;
        share.load.anchor.velocity[entry] = 1.0;
        break;
    case ER_BY_SPRING: share.load.anchor.stiffness[entry] = 1.0; break;
    case ER_BY_RATE: share.load.wrench[entry] = elapsed; break;
    case ER_BY_CONTACT: *er_contact_entry(&share.load.contact, entry) = 1.0; break;
    case ER_BY_NORMAL: share.load.contact.normal[entry] = 1.0; break;
    default: break;
    }
    return share;
}
