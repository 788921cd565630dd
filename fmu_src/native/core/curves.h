/* Restoring torque of the elastic coordinates: linear, backlash, spline.
 *
 * The law of coordinate k changes at +-half_width[k].  In each region (-1 below, 0 inside, 1 above; 1
 * everywhere where the law never changes) it is one smooth branch, continued beyond the region's ends.
 * docs/model.md has the laws, elastic_robot/torque_curves.py and spline_curve.py the same in Python.
 */
#ifndef ER_CURVES_H
#define ER_CURVES_H

#include "kernel.h"
#include "robot_data.h"

/* In the order of TORQUE_CURVES. */
typedef enum { ER_LINEAR, ER_BACKLASH, ER_SPLINE, ER_CURVES } er_curve_kind;

/* Piecewise cubics through points, straight beyond the last; pieces = 0: a straight line. */
typedef struct {
    int points;
    double knot[ER_MAX_KNOTS];         /* angles [rad] */
    double value[ER_MAX_KNOTS];        /* torques there [N m] */
    double cubic[ER_MAX_KNOTS + 1][4]; /* coefficients 1, t, t^2, t^3 of each piece, ends included */
    double start[ER_MAX_KNOTS + 1];    /* angle from which t counts [rad] */
} er_spline;

typedef struct {
    er_curve_kind kind;
    int count;                       /* m */
    double stiffness[ER_MAX_ANGLES]; /* [N m/rad] */
    double backlash[ER_MAX_ANGLES];  /* [rad] */
    double half_width[ER_MAX_ANGLES]; /* [rad], infinite where the law never changes */
    er_spline spline[ER_MAX_ANGLES];
} er_curve;

/* The curve of given parameters; it allocates nothing. */
void er_curve_build(er_curve *curve, er_curve_kind kind, const er_robot *robot,
                    const er_parameters *parameters);

/* S(x) [N m] and dS/dx [N m/rad] of coordinate k along its spline. */
double er_spline_torque(const er_curve *curve, int k, double x);
double er_spline_slope(const er_curve *curve, int k, double x);

/* The law of a coordinate in a region: slope (x - zero), or that of its spline. */
typedef struct {
    bool straight;
    double slope, zero; /* [N m/rad, rad]; 0 of a spline */
} er_branch;

static inline er_branch er_curve_branch(const er_curve *curve, int k, int region)
{
    if (region == 0)
        return (er_branch){true, 0.0, 0.0};
    if (curve->spline[k].points > 0)
        return (er_branch){false, 0.0, 0.0};
    /* Without play the region is 1 and the backlash zero. */
    return (er_branch){true, curve->stiffness[k], region * curve->backlash[k]};
}

/* S(x) [N m] of coordinate k on the branch of a region. */
static inline double er_curve_torque(const er_curve *curve, int k, int region, double x)
{
    er_branch branch = er_curve_branch(curve, k, region);
    return branch.straight ? branch.slope * (x - branch.zero) : er_spline_torque(curve, k, x);
}

/* dS/dx [N m/rad] of coordinate k on the branch of a region. */
static inline double er_curve_slope(const er_curve *curve, int k, int region, double x)
{
    if (region == 0)
        return 0.0;
    return curve->spline[k].points > 0 ? er_spline_slope(curve, k, x) : curve->stiffness[k];
}

/* Changes of S(x) [N m] on the branch of a region, and of the slope below [N m/rad], along changes of the
 * stiffness and the backlash of coordinate k; a table of its own takes the place of both. */
double er_curve_along(const er_curve *curve, int k, int region, double x, double stiffness,
                      double backlash);
double er_curve_flank_slope_along(const er_curve *curve, int k, double x, double stiffness,
                                  double backlash);

/* dS/dx [N m/rad], of the nearest flank where the gear is inside its play. */
double er_curve_flank_slope(const er_curve *curve, int k, double x);

/* Its derivative [N m/rad^2]. */
double er_curve_flank_curvature(const er_curve *curve, int k, double x);

/* Angle [rad] at which the curve carries a torque; 0 where that is not unique. */
double er_curve_deflection(const er_curve *curve, int k, double torque);

/* The region in which x lies. */
int er_curve_region(const er_curve *curve, int k, double x);

/* Whether the law of coordinate k changes anywhere. */
static inline bool er_curve_switches(const er_curve *curve, int k)
{
    return curve->half_width[k] < 1e300;
}

#endif
