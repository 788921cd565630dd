/* Model exchange: the robot as a differential equation that the master integrates.
 *
 * The states are x and x'; their derivatives are a function of time, states, inputs and parameters alone.
 * What an event changes is only which bends of the torque curves are watched: the event indicators say
 * how far each gear is from leaving the piece of its curve on which it was at the last event.  Drives
 * follow their trajectory by time, or the inputs as they are at the moment.
 */
#ifndef ER_EXCHANGE_H
#define ER_EXCHANGE_H

#include "../core/tangent.h"
#include "instance.h"

/* Whether states and time are the master's: initialisation has ended. */
bool er_exchange_runs(const er_instance *instance);

/* Lets time, inputs and parameters as they are set now act on the model, where the master integrates. */
bool er_exchange_hold(er_instance *instance);

/* What was set since the last evaluation is not in the model yet. */
void er_exchange_disturb(er_instance *instance);

/* Ways from x to the bends of a torsion's curve below and above [rad]: to those of its piece while the
 * master integrates, else to the nearest. */
void er_exchange_bends(const er_instance *instance, double *ways);

/* How they change with x and backlash. */
void er_exchange_bends_along(const er_instance *instance, const er_change *change, double *ways);

/* Chooses the pieces anew, as events do.  Time must be one of the trajectory's. */
bool er_exchange_settle(er_instance *instance);

/* Whether a gear has left its piece; and refuses times that the trajectory does not cover. */
bool er_exchange_completed(er_instance *instance, bool *has_event);

/* The next time event; infinite if there is none. */
double er_exchange_next_event(er_instance *instance);

/* Takes a time [s]. */
bool er_exchange_set_time(er_instance *instance, double time);

#endif
