/* Kinematics, mass matrix and static loads of the chain, in base axes and about the TCP; below them what is reckoned
 * with: vectors of three, matrices of nine numbers (by rows), and small systems of equations.
 *
 * theta has one angle per rotation of the chain, base to tool: theta = S x + drives.
 */
#ifndef ER_CHAIN_H
#define ER_CHAIN_H

#include <math.h>
#include <stdbool.h>

#include "robot_data.h"

/* Where everything is at given angles. */
typedef struct {
    double tool_position[3];        /* TCP in the base frame [m] */
    double tool_rotation[9];        /* base_from_tool, by rows */
    double axis[ER_MAX_ANGLES][3];  /* z_i of each rotation, base axes */
    double lever[ER_MAX_ANGLES][3]; /* z_i x (TCP - o_i): the TCP's velocity per theta_i' [m] */
    double arm[ER_MAX_ANGLES][3];   /* TCP - o_i, base axes [m] */
    er_body outer[ER_MAX_ANGLES];   /* all bodies from rotation i to the tool, about the TCP */
} er_placement;

/* Fills in theta from drives and elastic coordinates; x may be NULL for the rigid robot. */
void er_angles(const er_robot *robot, const double *q, const double *x, double *theta);

/* TCP in the base frame [m] and base_from_tool, by rows, alone. */
void er_place_tool(const er_robot *robot, const double *theta, double position[3], double rotation[9]);

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
double er_turns_sign(er_turns *turns, const er_robot *robot, const double *theta, const double quaternion[4]);

/* Entries of a stiffness, xx, xy, xz, yy, yz, zz, and their rows and columns. */
#define ER_SYMMETRIC 6
static const int er_row[ER_SYMMETRIC] = {0, 0, 0, 1, 1, 2}, er_column[ER_SYMMETRIC] = {0, 1, 2, 1, 2, 2};

static inline double er_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void er_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* sum += a x b */
static inline void er_add_cross(const double a[3], const double b[3], double sum[3])
{
    double product[3];
    er_cross(a, b, product);
    for (int c = 0; c < 3; c++)
        sum[c] += product[c];
}

/* Below this angle [rad] the series are exact to rounding; tilts and gears give way by less. */
#define ER_SMALL_ANGLE 0.01

static inline void er_sine_and_cosine(double angle, double *s, double *c)
{
    double a2 = angle * angle;
    if (fabs(angle) <= ER_SMALL_ANGLE) {
        *s = angle - angle * a2 * (1.0 / 6.0 - a2 * (1.0 / 120.0 - a2 * (1.0 / 5040.0)));
        *c = 1.0 - a2 * (0.5 - a2 * (1.0 / 24.0 - a2 * (1.0 / 720.0)));
    } else {
        *s = sin(angle);
        *c = cos(angle);
    }
}

/* out = R v */
static inline void er_rotate(const double R[9], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2];
}

/* out = A B */
static inline void er_compose(const double A[9], const double B[9], double out[9])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[3 * i + j] =
                A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

/* out = S v for a symmetric S = xx, yy, zz, xy, xz, yz */
static inline void er_symmetric_times(const double S[6], const double v[3], double out[3])
{
    out[0] = S[0] * v[0] + S[3] * v[1] + S[4] * v[2];
    out[1] = S[3] * v[0] + S[1] * v[1] + S[5] * v[2];
    out[2] = S[4] * v[0] + S[5] * v[1] + S[2] * v[2];
}

/* LU factors of an n x n matrix by rows, with partial pivoting; false if it is singular. */
static inline bool er_lu_factor(int n, double *a, int *pivot)
{
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[i * n + k]) > fabs(a[best * n + k]))
                best = i;
        pivot[k] = best;
        if (!(fabs(a[best * n + k]) > 0.0))
            return false;
        for (int j = 0; best != k && j < n; j++) {
            double swapped = a[k * n + j];
            a[k * n + j] = a[best * n + j];
            a[best * n + j] = swapped;
        }
        for (int i = k + 1; i < n; i++) {
            double factor = a[i * n + k] /= a[k * n + k];
            for (int j = k + 1; j < n; j++)
                a[i * n + j] -= factor * a[k * n + j];
        }
    }
    return true;
}

/* Overwrites a right-hand side with the solution. */
static inline void er_lu_solve(int n, const double *a, const int *pivot, double *b)
{
    for (int k = 0; k < n; k++) {
        double swapped = b[pivot[k]];
        b[pivot[k]] = b[k];
        b[k] = swapped;
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            b[i] -= a[i * n + j] * b[j];
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++)
            b[i] -= a[i * n + j] * b[j];
        b[i] /= a[i * n + i];
    }
}

/* Whether the symmetric part of a matrix is positive definite: Cholesky's method. */
static inline bool er_is_positive(int n, const double *matrix)
{
    double root[ER_MAX_ANGLES * ER_MAX_ANGLES];
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = 0.5 * (matrix[i * n + j] + matrix[j * n + i]);
            for (int k = 0; k < j; k++)
                sum -= root[i * n + k] * root[j * n + k];
            if (i == j && !(sum > 0.0))
                return false;
            root[i * n + j] = i == j ? sqrt(sum) : sum / root[j * n + j];
        }
    return true;
}

#endif
