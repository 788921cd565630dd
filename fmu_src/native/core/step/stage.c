/* Drives, motion, pull and contact at the nodes of a step. */
#include "stage.h"

#include <math.h>

#include "motor_step.h"

enum { MOST = ER_MAX_ANGLES };

/* What is there already is kept: drives often stand still. */
static void refer_to(int joints, const er_nodes *end, er_reference *reference)
{
    for (int i = 0; i < joints; i++) {
        double q = end->q[i][0];
        bool same = q == reference->angle[i] &&
                    (reference->sine[i] != 0.0 || reference->cosine[i] != 0.0);
        if (same)
            continue;
        reference->angle[i] = q;
        reference->sine[i] = sin(q);
        reference->cosine[i] = cos(q);
    }
}

/* The chain goes with what the gears make of drives that follow their commands. */
static void transmit_nodes(const er_run *r, er_nodes *nodes)
{
    const er_robot *robot = r->system->robot;
    for (int i = 0; i < robot->joints; i++) {
        bool moves_itself = r->motors > 0 && robot->joint_motor[i] >= 0;
        if (!er_has_gear_error(robot, i) || moves_itself)
            continue;
        for (int l = 0; l < ER_LANES; l++)
            er_transmit(robot, i, &nodes->q[i][l], &nodes->qd[i][l], &nodes->qdd[i][l]);
    }
}

/* Commands at the times of nodes. */
static void command_nodes(const er_run *r, const er_lanes time, er_nodes *nodes)
{
    const er_system *system = r->system;
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], qdd[ER_MAX_JOINTS];
    for (int l = 0; l < ER_LANES; l++)
        nodes->elapsed[l] = time[l] - system->start;
    if (system->drives->trajectory == NULL) {
        r->means->kernel.drive(system->robot->joints, system->drives->powers, nodes);
        return;
    }
    for (int l = 0; l < ER_LANES; l++) {
        if (l == 0 || time[l] != time[l - 1])
            er_drives_at(system->drives, time[l], q, qd, qdd);
        for (int i = 0; i < system->robot->joints; i++) {
            nodes->q[i][l] = q[i];
            nodes->qd[i][l] = qd[i];
            nodes->qdd[i][l] = qdd[i];
        }
    }
}

/* Drives at the times of nodes. */
static void drive_nodes(const er_run *r, const er_lanes time, er_nodes *nodes)
{
    command_nodes(r, time, nodes);
    if (r->system->robot->errors > 0)
        transmit_nodes(r, nodes);
}

void er_drive_step(const er_run *r, double time, double h)
{
    er_workspace *w = r->work;
    er_lanes stages, end;
    for (int l = 0; l < ER_LANES; l++) {
        stages[l] = time + h * er_gauss_node[l];
        end[l] = time + h;
    }
    drive_nodes(r, stages, &w->stages);
    drive_nodes(r, end, &w->end);
    refer_to(r->system->robot->joints, &w->end, &w->reference);
}

void er_stage_motion(const er_run *r, const er_nodes *nodes, const er_lanes *acceleration)
{
    er_workspace *w = r->work;
    r->means->kernel.move(r->system->robot, nodes, &w->reference, (const er_lanes *)w->x,
                          (const er_lanes *)w->v, acceleration, &w->motion);
}

void er_stage_gap(const er_run *r, const er_nodes *nodes, int states)
{
    er_workspace *w = r->work;
    const er_anchor *anchor = &r->system->load.anchor;
    r->means->kernel.reach(r->system->robot, &w->motion, states, w->gap);
    for (int c = 0; c < 3; c++)
        for (int l = 0; l < states; l++)
            w->gap[c][l] = anchor->position[c] + nodes->elapsed[l] * anchor->velocity[c] -
                           w->gap[c][l];
}

/* Angles and rates of the chain at one of the nodes. */
static void find_angles(const er_run *r, const er_nodes *nodes, int l, double *theta, double *rate)
{
    const er_robot *robot = r->system->robot;
    const er_workspace *w = r->work;
    double q[ER_MAX_JOINTS], qd[ER_MAX_JOINTS], x[MOST], v[MOST];
    for (int i = 0; i < robot->joints; i++) {
        q[i] = nodes->q[i][l];
        qd[i] = nodes->qd[i][l];
    }
    for (int k = 0; k < r->m; k++) {
        x[k] = w->x[k][l];
        v[k] = w->v[k][l];
    }
    er_angles(robot, q, x, theta);
    er_angles(robot, qd, v, rate);
}

void er_stage_contact(const er_run *r, const er_nodes *nodes, int states)
{
    double theta[MOST], rate[MOST];
    for (int l = 0; l < states; l++) {
        find_angles(r, nodes, l, theta, rate);
        er_contact_motion_at(r->system->robot, &r->system->load, nodes->elapsed[l], theta, rate, &r->work->contact[l]);
    }
}

const er_lanes *er_stage_pull(const er_run *r, const er_nodes *nodes, int states, bool touching)
{
    er_workspace *w = r->work;
    const er_load *load = &r->system->load;
    if (!r->system->anchored && !r->system->changing && !touching)
        return NULL;
    for (int l = 0; l < states; l++) {
        double pull[3] = {0.0, 0.0, 0.0};
        if (r->system->anchored) {
            const double gap[3] = {w->gap[0][l], w->gap[1][l], w->gap[2][l]};
            er_anchor_times(load->anchor.stiffness, gap, pull);
        }
        for (int k = 0; k < 6; k++)
            w->pull[k][l] = nodes->elapsed[l] * load->rate[k] + (k < 3 ? pull[k] : 0.0) +
                            (touching ? w->contact[l].wrench[k] : 0.0);
    }
    return (const er_lanes *)w->pull;
}

/* Depths of the contact at nodes, from w->x. */
static void depths_at_nodes(const er_run *r, const er_nodes *nodes, int states, double *depth)
{
    const er_robot *robot = r->system->robot;
    const er_load *load = &r->system->load;
    double theta[MOST], rate[MOST], place[3], rotation[9], gap[3];
    for (int l = 0; l < states; l++) {
        find_angles(r, nodes, l, theta, rate);
        er_place_tool(robot, theta, place, rotation);
        er_anchor_gap(&load->anchor, nodes->elapsed[l], place, gap);
        depth[l] = er_contact_touch(&load->contact, gap).depth;
    }
}

double er_contact_depth(const er_run *r, const er_state *state)
{
    er_workspace *w = r->work;
    er_lanes time;
    double depth;
    for (int l = 0; l < ER_LANES; l++)
        time[l] = state->time;
    drive_nodes(r, time, &w->start);
    r->means->kernel.spread(r->m, er_chain_start(r, state).x, w->x);
    depths_at_nodes(r, &w->start, 1, &depth);
    return depth;
}

double er_end_approach(const er_run *r, const er_step *step)
{
    er_workspace *w = r->work;
    r->means->kernel.spread(r->m, step->x, w->x);
    r->means->kernel.spread(r->m, step->v, w->v);
    for (int d = 0; d < r->motors; d++) { /* from wind-ups to the chain */
        const er_motor *motor = &r->system->robot->motor[d];
        er_gear_error error = er_gear_error_at(r->system->robot, motor->joint, step->motors.angle[d]);
        w->x[motor->coordinate][0] += step->motors.p[d] + error.value;
        w->v[motor->coordinate][0] += step->motors.pv[d] + error.slope * step->motors.rate[d];
    }
    er_stage_contact(r, &w->end, 1);
    return er_contact_approach(&w->contact[0].touch);
}

void er_step_depths(const er_run *r, const er_state *state, const er_start *from, er_step *step)
{
    er_workspace *w = r->work;
    const er_kernel *kernel = &r->means->kernel;
    step->depth[0] = er_contact_depth(r, state);
    kernel->stages(r->m, step->length, from->x, from->v, (const er_lanes *)step->acceleration, w->x, w->v);
    depths_at_nodes(r, &w->stages, ER_STAGES, step->depth + 1);
    kernel->spread(r->m, step->x, w->x);
    depths_at_nodes(r, &w->end, 1, step->depth + ER_DEGREE);
}
