/* Kinematics, mass matrix and static loads of the chain, in base axes and about the TCP.
 *
 * theta has one angle per rotation of the chain, base to tool: theta = S x + drives.
 */
#ifndef ER_CHAIN_H
#define ER_CHAIN_H

#include "robot_data.h"

/* Where everything is at given angles. */
typedef struct {
    double tool_position[3];        /* TCP in the base frame [m] */
    double tool_rotation[9];        /* base_from_tool, by rows */
    double axis[ER_MAX_ANGLES][3];  /* z_i of each rotation, base axes */
    double lever[ER_MAX_ANGLES][3]; /* z_i x (TCP - o_i): the TCP's velocity per theta_i' [m] */
    double arm[ER_MAX_ANGLES][3];   /* TCP - o_i, base axes [m] */
    er_body beyond[ER_MAX_ANGLES];  /* all bodies from rotation i to the tool, about the TCP */
} er_placement;

/* Fills in theta from drives and elastic coordinates; x may be NULL for the rigid robot. */
void er_angles(const er_robot *robot, const double *q, const double *x, double *theta);

/* TCP in the base frame [m] and base_from_tool, by rows, alone. */
void er_place_tool(const er_robot *robot, const double *theta, double position[3],
                   double rotation[9]);

/* Places the frames: TCP, axes and arms; `bodies` are done by er_place_bodies. */
void er_place(const er_robot *robot, const double *theta, er_placement *placement);

/* The same with the bodies beyond each rotation, for the functions below. */
void er_place_bodies(const er_robot *robot, const double *theta, er_placement *placement);

/* Mass matrix in the rows and columns of x [kg m^2], m x m by rows. */
void er_mass_matrix(const er_robot *robot, const er_placement *placement, double *mass);

/* Torque J^T w - g that the elastic coordinates must carry at rest [N m]. */
void er_static_torque(const er_robot *robot, const er_placement *placement, const double gravity[3],
                      const double wrench[6], double *torque);

/* d(static torque)/dx [N m/rad], m x m by rows: entry i, j is that of torque i by x_j. */
void er_static_torque_gradient(const er_robot *robot, const er_placement *placement,
                               const double gravity[3], const double wrench[6], double *gradient);

/* Pose x, y, z, qx, qy, qz, qw of a placement, qw >= 0: er_turns_sign tells the other quaternion. */
void er_pose(const double position[3], const double rotation[9], double pose[7]);

/* Rotation vector r [rad] with R = exp(r) R_reference, base axes. */
void er_rotation_between(const double rotation[9], const double reference[9], double vector[3]);

/* Which of the two unit quaternions of its orientation a tool has.
 *
 * The product of the turns along the chain, each by the half of its angle, is continuous in the angles: the
 * quaternion that is taken after it does not jump to its opposite where the tool has turned by 180 degrees,
 * and follows from the angles alone, not from the way there.  elastic_robot/turns.py is the same in Python.
 */

/* A product that serves all angles nearby. */
typedef struct {
    bool set; /* there is one */
    double theta[ER_MAX_ANGLES];
    double quaternion[4]; /* x, y, z, w */
} er_turns;

/* 1 where a tool's quaternion is that of the turns by these angles, -1 where it is the opposite. */
double er_turns_sign(er_turns *turns, const er_robot *robot, const double *theta,
                     const double quaternion[4]);

#endif
