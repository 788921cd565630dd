#include "anchor.h"

#include <math.h>

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
                            " direction, so leave out what does not", value[0] * scale, value[1] * scale,
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
