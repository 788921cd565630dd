/* Event indicators of model exchange: how far what obeys a law is from where it obeys another. */
#ifndef ER_INDICATORS_H
#define ER_INDICATORS_H

#include "instance.h"

/* As many values as one of the kinds of event indicators below may have. */
enum { ER_MAX_INDICATORS = 2 * ER_MAX_JOINTS > ER_MAX_ELEMENTS ? 2 * ER_MAX_JOINTS : ER_MAX_ELEMENTS };

/* Turns a rate into a way, of about a first step [s]. */
#define ER_REVERSAL_TIME 1e-3

/* The bends of a torsion's curve; returns how far behind them a piece ends [rad]. */
double er_indicate_torsion(const er_instance *instance, int torsion, er_bends *bends);

/* Ways from x to the bends of a torsion's curve below and above [rad]: to those of its piece while the
 * master integrates, else to the nearest. */
void er_indicate_bends(const er_instance *instance, double *ways);

/* How they change with x and backlash. */
void er_indicate_bends_along(const er_instance *instance, const er_change *change, double *ways);

/* Ways of the elements, behind those of gears those of motors, to their slip angles [rad], of those that slip to the
 * reversal of their coordinates, which is their rate times ER_REVERSAL_TIME; 1 of motors that do not move by
 * themselves; and how they change. */
void er_indicate_slips(const er_instance *instance, double *ways);
void er_indicate_slips_along(const er_instance *instance, const er_change *change, double *ways);

/* Ways of the motors' servos to their torque limits [N m], 1 without one or without servo; and how they change. */
void er_indicate_limits(const er_instance *instance, double *ways);
void er_indicate_limits_along(const er_instance *instance, const er_change *change, double *ways);

#endif
