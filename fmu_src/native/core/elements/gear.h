/* What elastic coordinates resist with: the torque of the gears' curves (linear, backlash, spline) and damping.
 * Only gear.c knows a law; a new one is added there.
 *
 * The law of coordinate k changes at +-half_width[k].  In each region (-1 below, 0 inside, 1 above; 1
 * everywhere where the law never changes) it is one smooth branch, continued beyond the region's ends.
 * docs/model.md has the laws, elastic_robot/torque_curves.py and spline_curve.py the same in Python.
 */
#ifndef ER_GEAR_H
#define ER_GEAR_H

#include "../chain/robot_data.h"

/* A law is named by its place in TORQUE_CURVES; there may be so many. */
#define ER_MAX_LAWS 8
extern const int er_gear_laws;

/* Whether a law may change where a gear takes up its backlash. */
bool er_law_switches(int law);

/* Piecewise cubics through points, straight beyond the last; pieces = 0: a straight line. */
typedef struct {
    int points;
    double knot[ER_MAX_KNOTS];         /* angles [rad] */
    double value[ER_MAX_KNOTS];        /* torques there [N m] */
    double cubic[ER_MAX_KNOTS + 1][4]; /* coefficients 1, t, t^2, t^3 of each piece, ends included */
    double start[ER_MAX_KNOTS + 1];    /* angle from which t counts [rad] */
} er_spline;

typedef struct {
    int law;
    int count;                       /* m */
    double stiffness[ER_MAX_ANGLES]; /* [N m/rad] */
    double damping[ER_MAX_ANGLES];   /* [N m s/rad] */
    double backlash[ER_MAX_ANGLES];  /* [rad] */
    double half_width[ER_MAX_ANGLES]; /* [rad], infinite where the law never changes */
    double slip_torque[ER_MAX_COORDINATES]; /* at which all elements slip [N m], of the motors too */
    er_spline spline[ER_MAX_ANGLES];
} er_gears;

/* The gears of given parameters; it allocates nothing. */
void er_gears_build(er_gears *gears, int law, const er_robot *robot, const er_parameters *parameters);

/* S(x) [N m] and dS/dx [N m/rad] of coordinate k along its spline. */
double er_spline_torque(const er_gears *gears, int k, double x);
double er_spline_slope(const er_gears *gears, int k, double x);

/* The law of a coordinate in a region: slope (x - zero), or that of its spline. */
typedef struct {
    bool straight;
    double slope, zero; /* [N m/rad, rad]; 0 of a spline */
} er_branch;

static inline er_branch er_gear_branch(const er_gears *gears, int k, int region)
{
    if (region == 0)
        return (er_branch){true, 0.0, 0.0};
    if (gears->spline[k].points > 0)
        return (er_branch){false, 0.0, 0.0};
    /* Without backlash the region is 1 and the backlash zero. */
    return (er_branch){true, gears->stiffness[k], region * gears->backlash[k]};
}

/* S(x) [N m] of coordinate k on the branch of a region. */
static inline double er_gear_torque(const er_gears *gears, int k, int region, double x)
{
    er_branch branch = er_gear_branch(gears, k, region);
    return branch.straight ? branch.slope * (x - branch.zero) : er_spline_torque(gears, k, x);
}

/* dS/dx [N m/rad] of coordinate k on the branch of a region. */
static inline double er_gear_slope(const er_gears *gears, int k, int region, double x)
{
    if (region == 0)
        return 0.0;
    return gears->spline[k].points > 0 ? er_spline_slope(gears, k, x) : gears->stiffness[k];
}

/* Changes of S(x) [N m] on the branch of a region, and of the slope below [N m/rad], along changes of the
 * stiffness and the backlash of coordinate k; a table of its own takes the place of both. */
double er_gear_along(const er_gears *gears, int k, int region, double x, double stiffness, double backlash);
double er_gear_flank_slope_along(const er_gears *gears, int k, double x, double stiffness, double backlash);

/* dS/dx [N m/rad], of the nearest flank where the gear is inside its backlash. */
double er_gear_flank_slope(const er_gears *gears, int k, double x);

/* Its derivative [N m/rad^2]. */
double er_gear_flank_curvature(const er_gears *gears, int k, double x);

/* Angle [rad] at which the curve carries a torque; 0 where that is not unique. */
double er_gear_deflection(const er_gears *gears, int k, double torque);

/* The region in which x lies. */
int er_gear_region(const er_gears *gears, int k, double x);

/* Whether the law of coordinate k changes anywhere. */
static inline bool er_gear_switches(const er_gears *gears, int k)
{
    return gears->half_width[k] < 1e300;
}

/* Whether the flanks of a coordinate are curved. */
static inline bool er_gear_is_bent(const er_gears *gears, int k)
{
    return gears->spline[k].points > 0;
}

/* Half width of the backlash [rad]; 0 where the law never changes. */
static inline double er_gear_half_width(const er_gears *gears, int k)
{
    return er_gear_switches(gears, k) ? gears->half_width[k] : 0.0;
}

/* A value over the backlash; 0 where the curve does not follow that. */
static inline double er_gear_per_backlash(const er_gears *gears, int k, double value)
{
    return er_gear_switches(gears, k) ? value / gears->backlash[k] : 0.0;
}

/* Boundaries are passed only this far beyond +-half_width [rad], so that rounding does not undo it. */
double er_gear_slack(const er_gears *gears, const er_settings *settings, int k, double tolerance);

/* Below and above which x leaves a region [rad], infinite where it does not: outside the backlash only the side
 * towards it is a boundary. */
void er_gear_edges(const er_gears *gears, const er_settings *settings, int k, int region, double tolerance,
                   double edge[2]);

/* Angles at which the slope or the curvature of a law jumps, rising [rad]; between two of them lies a
 * piece, number p between angle p - 1 and angle p. */
typedef struct {
    int count;
    double angle[ER_MAX_KNOTS];
} er_bends;

void er_bends_find(const er_gears *gears, int k, er_bends *bends);

/* The piece that x lies on, if it lay on `piece` before: a bend is passed `slack` [rad] behind it only, so
 * that rounding does not undo it. */
int er_bends_piece(const er_bends *bends, int piece, double x, double slack);

/* How far x is from where it would leave a piece downwards and upwards [rad]; 1 where it cannot. */
void er_bends_distance(const er_bends *bends, int piece, double x, double slack, double distance[2]);

/* How that changes with x and as the backlash gets `wider` by a part; bends lie at parts of it but for those of
 * a table. */
void er_bends_distance_along(const er_bends *bends, int piece, double x_change, double wider, double slack,
                             double distance[2]);

#endif
