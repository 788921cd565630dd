/* Model exchange: the robot as a differential equation that the master integrates.
 *
 * The states are x, x' and the elongations of elements of hysteresis, and of motors angles, rates, integrals of their
 * servos and elongations of their friction; their derivatives are a function of time, states, inputs and parameters,
 * and of which elements slip.  What an event changes is that, and which bends of the torque curves are watched: the
 * event indicators say how far each gear is from leaving the piece of its curve on which it was at the last event, and
 * each element from slipping or sticking.  Drives follow their trajectory by time, or the inputs as they are at the
 * moment. */
#ifndef ER_EXCHANGE_H
#define ER_EXCHANGE_H

#include "instance.h"

/* Lets time, inputs and parameters as they are set now act on the model, where the master integrates. */
bool er_exchange_hold(er_instance *instance);

/* What was set since the last evaluation is not in the model yet. */
void er_exchange_disturb(er_instance *instance);

/* Chooses pieces, and which elements slip, anew, as events do: `changed` tells of elongations that are other ones
 * now.  Time must be one of the trajectory's. */
bool er_exchange_settle(er_instance *instance, bool *changed);

/* Whether a gear has left its piece; and refuses times that the trajectory does not cover. */
bool er_exchange_completed(er_instance *instance, bool *has_event);

/* The next time event; infinite if there is none. */
double er_exchange_next_event(er_instance *instance);

/* Takes a time [s]. */
bool er_exchange_set_time(er_instance *instance, double time);

#endif
