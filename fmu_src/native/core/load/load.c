#include "load.h"

#include <math.h>
#include <string.h>

void er_load_advance(er_load *load, double elapsed)
{
    for (int k = 0; k < 6; k++)
        load->wrench[k] += elapsed * load->rate[k];
    for (int c = 0; c < 3; c++)
        load->anchor.position[c] += elapsed * load->anchor.velocity[c];
}

bool er_load_changes(const er_load *load)
{
    bool changes = false;
    for (int k = 0; k < 6; k++)
        changes |= load->rate[k] != 0.0;
    return changes;
}

bool er_load_yields(const er_load *load)
{
    return er_anchor_holds(&load->anchor) || er_contact_holds(&load->contact);
}

/* How the contact at rest is touched; false where it is not. */
static bool is_touching(const er_load *load, const double tcp[3], double gap[3], er_touch *touch)
{
    if (!er_contact_holds(&load->contact))
        return false;
    er_anchor_gap(&load->anchor, 0.0, tcp, gap);
    *touch = er_contact_touch(&load->contact, gap);
    return touch->depth > 0.0;
}

void er_load_wrench(const er_load *load, const double tcp[3], double wrench[6])
{
    double gap[3], pull[3];
    er_touch touch;
    memcpy(wrench, load->wrench, sizeof load->wrench);
    if (er_anchor_holds(&load->anchor)) {
        er_anchor_gap(&load->anchor, 0.0, tcp, gap);
        er_anchor_times(load->anchor.stiffness, gap, pull);
        for (int c = 0; c < 3; c++)
            wrench[c] += pull[c];
    }
    if (is_touching(load, tcp, gap, &touch)) {
        er_contact_force(&load->contact, &touch, pull);
        for (int c = 0; c < 3; c++)
            wrench[c] += pull[c];
    }
}

void er_load_support(const er_load *load, const double tcp[3], double stiffness[ER_SYMMETRIC])
{
    double gap[3];
    er_touch touch;
    memcpy(stiffness, load->anchor.stiffness, sizeof load->anchor.stiffness);
    if (is_touching(load, tcp, gap, &touch))
        for (int k = 0; k < ER_SYMMETRIC; k++)
            stiffness[k] += load->contact.stiffness * touch.normal[er_row[k]] * touch.normal[er_column[k]];
}

void er_load_support_chain(const er_load *load, const er_robot *robot, const er_placement *placement, double *matrix)
{
    int m = robot->elastics;
    double stiffness[ER_SYMMETRIC];
    er_load_support(load, placement->tool_position, stiffness);
    for (int i = 0; i < m; i++) {
        double pull[3];
        er_anchor_times(stiffness, placement->lever[robot->elastic_angle[i]], pull);
        for (int j = 0; j < m; j++)
            matrix[i * m + j] += er_dot(pull, placement->lever[robot->elastic_angle[j]]);
    }
}

void er_load_force_along(const er_load *load, const double tcp[3], const er_load *change,
                         const double tcp_change[3], double force[3])
{
    double gap[3], gap_change[3], push[3];
    er_touch touch, along;
    er_anchor_gap(&load->anchor, 0.0, tcp, gap);
    er_anchor_along(&load->anchor, gap, &change->anchor, tcp_change, force);
    if (!is_touching(load, tcp, gap, &touch))
        return;
    for (int c = 0; c < 3; c++)
        gap_change[c] = change->anchor.position[c] - tcp_change[c];
    er_contact_touch_along(&load->contact, &touch, gap, &change->contact, gap_change, &along);
    memset(along.velocity, 0, sizeof along.velocity);
    er_contact_along(&load->contact, &touch, &change->contact, &along, push);
    for (int c = 0; c < 3; c++)
        force[c] += push[c];
}

void er_load_support_along(const er_load *load, const double tcp[3], const er_load *change,
                           double stiffness[ER_SYMMETRIC])
{
    static const double nowhere[3] = {0.0, 0.0, 0.0};
    double gap[3];
    er_touch touch, along;
    memcpy(stiffness, change->anchor.stiffness, sizeof change->anchor.stiffness);
    if (!is_touching(load, tcp, gap, &touch))
        return;
    er_contact_touch_along(&load->contact, &touch, gap, &change->contact, nowhere, &along);
    for (int k = 0; k < ER_SYMMETRIC; k++) {
        int i = er_row[k], j = er_column[k];
        stiffness[k] += change->contact.stiffness * touch.normal[i] * touch.normal[j] +
                        load->contact.stiffness * (along.normal[i] * touch.normal[j] +
                                                   touch.normal[i] * along.normal[j]);
    }
}
