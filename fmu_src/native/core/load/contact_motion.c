#include "contact_motion.h"

#include <string.h>

/* Levers of the lowest point, a distance r from the TCP that does not turn with the tool, and how its
 * velocity sum_i lever_i theta_i' follows the angles: with rates up to rotation i, omega_i, and the rate u_i
 * of TCP - o_i
 *
 *     (omega_i x z_i) x (TCP - o_i) + z_i x u_i + (z_i x (omega - omega_i)) x r.
 */
static void find_levers(const er_placement *place, const er_robot *robot, const double *rate, er_contact_motion *motion)
{
    int n = robot->angles;
    double omega[ER_MAX_ANGLES][3], sum[3] = {0.0, 0.0, 0.0}, arm_rate[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            omega[i][c] = sum[c] += rate[i] * place->axis[i][c];
    memcpy(motion->turning, sum, sizeof sum);
    for (int i = n - 1; i >= 0; i--) {
        const double *z = place->axis[i];
        double bone[3], beyond[3], turned[3], *out = motion->lever_rate[i];
        for (int c = 0; c < 3; c++) {
            bone[c] = place->arm[i][c] - (i + 1 < n ? place->arm[i + 1][c] : 0.0);
            beyond[c] = sum[c] - omega[i][c];
        }
        er_add_cross(omega[i], bone, arm_rate);
        er_cross(omega[i], z, turned);
        er_cross(turned, place->arm[i], out);
        er_add_cross(z, arm_rate, out);
        er_cross(z, beyond, turned);
        er_add_cross(turned, motion->offset, out);
        memcpy(motion->lever[i], place->lever[i], sizeof motion->lever[i]);
        er_add_cross(z, motion->offset, motion->lever[i]);
    }
}

void er_contact_motion_at(const er_robot *robot, const er_load *load, double elapsed, const double *theta,
                     const double *rate, er_contact_motion *motion)
{
    er_placement place;
    er_place(robot, theta, &place);
    er_anchor_gap(&load->anchor, elapsed, place.tool_position, motion->gap);
    motion->touch = er_contact_touch(&load->contact, motion->gap);
    for (int c = 0; c < 3; c++)
        motion->offset[c] = -load->contact.radius * motion->touch.normal[c];
    find_levers(&place, robot, rate, motion);
    for (int c = 0; c < 3; c++) {
        motion->touch.velocity[c] = -load->anchor.velocity[c];
        for (int i = 0; i < robot->angles; i++)
            motion->touch.velocity[c] += motion->lever[i][c] * rate[i];
    }
    er_contact_force(&load->contact, &motion->touch, motion->wrench);
    er_cross(motion->offset, motion->wrench, motion->wrench + 3);
}

void er_contact_wrench(const er_contact_motion *motion, double wrench[6])
{
    if (motion->touch.depth > 0.0)
        memcpy(wrench, motion->wrench, sizeof motion->wrench);
    else
        memset(wrench, 0, sizeof motion->wrench);
}

/* Change of the offset -R n. */
static void offset_along(const er_contact *contact, const er_contact_motion *motion,
                         const er_contact *change, const er_touch *along, double offset[3])
{
    for (int c = 0; c < 3; c++)
        offset[c] = -change->radius * motion->touch.normal[c] - contact->radius * along->normal[c];
}

void er_contact_place_along(const er_robot *robot, const er_load *load, const er_contact_motion *motion,
                            const double *theta, const double *rate, const er_load *change, er_touch *along)
{
    double tcp_to_anchor[3], offset[3];
    for (int c = 0; c < 3; c++) {
        tcp_to_anchor[c] = change->anchor.position[c];
        along->velocity[c] = -change->anchor.velocity[c];
        for (int i = 0; i < robot->angles; i++) {
            /* Across n the levers of TCP and lowest point differ, but that does not count here. */
            tcp_to_anchor[c] -= motion->lever[i][c] * theta[i];
            along->velocity[c] += motion->lever[i][c] * rate[i] + motion->lever_rate[i][c] * theta[i];
        }
    }
    er_contact_touch_along(&load->contact, &motion->touch, motion->gap, &change->contact, tcp_to_anchor, along);
    offset_along(&load->contact, motion, &change->contact, along, offset);
    er_add_cross(motion->turning, offset, along->velocity);
}

void er_contact_wrench_along(const er_robot *robot, const er_load *load, const er_contact_motion *motion,
                             const double *theta, const double *rate, const er_load *change, double wrench[6])
{
    er_touch along;
    double offset[3];
    er_contact_place_along(robot, load, motion, theta, rate, change, &along);
    er_contact_along(&load->contact, &motion->touch, &change->contact, &along, wrench);
    offset_along(&load->contact, motion, &change->contact, &along, offset);
    er_cross(motion->offset, wrench, wrench + 3);
    er_add_cross(offset, motion->wrench, wrench + 3);
}
