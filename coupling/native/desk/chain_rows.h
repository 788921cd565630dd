/* Loads, poses and masses of a robot at many instants: rows of numbers, for whoever calls the library.
 *
 * Rows of a motion are theta, theta', theta'' of all angles of the chain, base to tool [rad, rad/s, rad/s^2], those of
 * a wrench are force and moment on the robot at the TCP, in base axes [N, N m].  Any numbers may be given: what is not
 * finite comes out as it is.
 */
#ifndef ER_CHAIN_ROWS_H
#define ER_CHAIN_ROWS_H

#include <stdint.h>

#include "export.h"
#include "link_kernel.h"

/* A robot and what its loads are computed with. */
typedef struct {
    er_robot robot;
    er_link_kernel links;
    er_wanted all, tilts; /* angles of the chain: every one, and the tilts */
} er_desk;

#define ER_MESSAGE 400

/* Reads the text of a robot; NULL, with a message, if it cannot be read or does not fit into memory. */
ER_EXPORT er_desk *er_desk_create(const char *text, char message[ER_MESSAGE]);
ER_EXPORT er_desk *er_desk_create_plain(const char *text, char message[ER_MESSAGE]); /* that uses plain C */
ER_EXPORT void er_desk_free(er_desk *desk);

/* M theta'' + h - J^T w less the balancers' torques [N m], (count, angles). */
ER_EXPORT void er_desk_loads(const er_desk *desk, int64_t count, const double *theta, const double *rate,
                             const double *acceleration, const double *wrench, double *load);

/* The same with its derivatives by theta, theta', theta'' (count, 3, angles, angles), and of the TCP the Jacobian in
 * base axes (count, 6, angles), position [m] and rotation by rows. */
ER_EXPORT void er_desk_linearise(const er_desk *desk, int64_t count, const double *theta, const double *rate,
                                 const double *acceleration, const double *wrench, double *load, double *by,
                                 double *jacobian, double *position, double *rotation);

/* TCP in the base frame [m], (count, 3), and base_from_tool by rows, (count, 9). */
ER_EXPORT void er_desk_place(const er_desk *desk, int64_t count, const double *theta, double *position, double *rotation);

/* Mass matrices in the rows and columns of the elastic coordinates [kg m^2], (count, m, m). */
ER_EXPORT void er_desk_masses(const er_desk *desk, int64_t count, const double *theta, double *mass);

/* Takes the torques of balancers off loads in `states` states, and their slopes off the derivatives of those that are
 * wanted by theta, unless these are NULL. */
void er_desk_relieve(const er_desk *desk, const er_lanes *theta, const er_wanted *wanted, er_link_state *state,
                     er_link_derivatives *by);

/* Rotation by rows of a unit quaternion x, y, z, w. */
void er_desk_rotation(const double quaternion[4], double rotation[9]);

/* Sines and cosines of angles in ER_LANES states. */
void er_desk_turn(const er_desk *desk, const er_lanes *theta, er_motion *motion);

#endif
