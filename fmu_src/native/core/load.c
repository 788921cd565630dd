#include "load.h"

#include <math.h>
#include <string.h>

/* Rounding may leave an eigenvalue this much below zero, relative to the largest. */
#define INDEFINITE 1e-9
/* Sweeps of Jacobi's method; three are enough for rounding. */
#define SWEEPS 6

/* Rising eigenvalues of a symmetric matrix by Jacobi's method (Golub and Van Loan 2013, sec. 8.5). */
static void find_eigenvalues(const double K[ER_SYMMETRIC], double value[3])
{
    double a[3][3] = {{K[0], K[1], K[2]}, {K[1], K[3], K[4]}, {K[2], K[4], K[5]}};
    for (int turn = 0; turn < 3 * SWEEPS; turn++) {
        int p = turn % 3 == 2 ? 1 : 0, q = turn % 3 == 0 ? 1 : 2, other = 3 - p - q;
        double half = 0.5 * (a[q][q] - a[p][p]), off = a[p][q], t, c, s, at_p, at_q;
        if (off == 0.0)
            continue;
        t = copysign(1.0, half) * off / (fabs(half) + hypot(half, off));
        c = 1.0 / sqrt(1.0 + t * t), s = t * c;
        a[p][p] -= t * off, a[q][q] += t * off;
        a[p][q] = a[q][p] = 0.0;
        at_p = c * a[other][p] - s * a[other][q];
        at_q = s * a[other][p] + c * a[other][q];
        a[other][p] = a[p][other] = at_p, a[other][q] = a[q][other] = at_q;
    }
    for (int k = 0; k < 3; k++) {
        int place = k;
        for (; place > 0 && value[place - 1] > a[k][k]; place--)
            value[place] = value[place - 1];
        value[place] = a[k][k];
    }
}

bool er_anchor_require(const er_anchor *anchor, er_failure *failure)
{
    double scaled[ER_SYMMETRIC], value[3], scale = 0.0;
    for (int k = 0; k < ER_SYMMETRIC; k++)
        scale = fmax(scale, fabs(anchor->stiffness[k]));
    if (scale == 0.0)
        return true;
    for (int k = 0; k < ER_SYMMETRIC; k++)
        scaled[k] = anchor->stiffness[k] / scale; /* no product is out of range */
    find_eigenvalues(scaled, value);
    if (value[0] >= -INDEFINITE * fmax(fabs(value[0]), fabs(value[2])))
        return true;
    return er_fail(failure, "stiffness of the contact spring (anchor.kxx to anchor.kzz): expected no"
                            " eigenvalue below 0, got %.6g, %.6g, %.6g N/m: a contact pushes back in every"
                            " direction, so leave out what does not",
                   value[0] * scale, value[1] * scale,
                   value[2] * scale);
}

bool er_anchor_holds(const er_anchor *anchor)
{
    bool holds = false;
    for (int k = 0; k < ER_SYMMETRIC; k++)
        holds |= anchor->stiffness[k] != 0.0;
    return holds;
}

void er_anchor_times(const double K[ER_SYMMETRIC], const double v[3], double out[3])
{
    out[0] = K[0] * v[0] + K[1] * v[1] + K[2] * v[2];
    out[1] = K[1] * v[0] + K[3] * v[1] + K[4] * v[2];
    out[2] = K[2] * v[0] + K[4] * v[1] + K[5] * v[2];
}

void er_anchor_gap(const er_anchor *anchor, double elapsed, const double tcp[3], double gap[3])
{
    for (int c = 0; c < 3; c++)
        gap[c] = anchor->position[c] + elapsed * anchor->velocity[c] - tcp[c];
}

void er_anchor_along(const er_anchor *anchor, const double gap[3], const er_anchor *change,
                     const double tcp_change[3], double force[3])
{
    double gap_change[3], of_stiffness[3];
    for (int c = 0; c < 3; c++)
        gap_change[c] = change->position[c] - tcp_change[c];
    er_anchor_times(anchor->stiffness, gap_change, force);
    er_anchor_times(change->stiffness, gap, of_stiffness);
    for (int c = 0; c < 3; c++)
        force[c] += of_stiffness[c];
}

void er_load_move(er_load *load, double elapsed)
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
static bool touches(const er_load *load, const double tcp[3], double gap[3], er_touch *touch)
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
    if (touches(load, tcp, gap, &touch)) {
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
    if (touches(load, tcp, gap, &touch))
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
    if (!touches(load, tcp, gap, &touch))
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
    if (!touches(load, tcp, gap, &touch))
        return;
    er_contact_touch_along(&load->contact, &touch, gap, &change->contact, nowhere, &along);
    for (int k = 0; k < ER_SYMMETRIC; k++) {
        int i = er_row[k], j = er_column[k];
        stiffness[k] += change->contact.stiffness * touch.normal[i] * touch.normal[j] +
                        load->contact.stiffness * (along.normal[i] * touch.normal[j] +
                                                   touch.normal[i] * along.normal[j]);
    }
}
