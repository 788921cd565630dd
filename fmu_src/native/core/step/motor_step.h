/* The motors in a step of the chain: eliminated from its equations, solved beside it; and their servos, the laws that
 * they obey at their torque limits, and what makes them obey another. */
#ifndef ER_MOTOR_STEP_H
#define ER_MOTOR_STEP_H

#include "run.h"

er_start er_chain_start(const er_run *r, const er_state *state);

/* Counts the end of a step from the motors. */
void er_motors_wind_up(const er_run *r, er_step *step);

/* p, p', w and z at the end of a step, from its accelerations. */
void er_motors_end(const er_run *r, const er_state *state, er_step *step);

/* Servos: has those that have a torque limit obey the law of where they stand, which inputs may have moved; whether one
 * obeys another than before. */
bool er_servos_settle(const er_run *r, er_state *state);

/* The law of the servo of a crossing beyond it, in the state there; and has it obeyed. */
er_servo_law er_servo_beyond(const er_run *r, const er_state *state, const er_crossing *crossing);
void er_servo_cross(const er_run *r, er_state *state, const er_crossing *crossing);

/* z' under a law [N m/s]. */
double er_servo_growth(const er_motor *motor, er_servo_law law, double rate_error, double turning);

/* How far beyond its torque limit a servo obeys another law [N m], and by what w it turns [rad/s]: the motor goes as
 * far by it within a longest step, or a first one, as a coordinate may beyond its boundary. */
double er_servo_slack(const er_robot *robot, int d, double tolerance);
double er_servo_rate_slack(const er_robot *robot, double tolerance);

/* Torque by which a gear holds its link at a wind-up and its rate in a step from a state [N m]. */
double er_wind_up_torque(const er_run *r, const er_state *state, int k, double x, double v);

/* Takes the motors out of Newton's matrix, with the slopes that they had when it was linearised: that of each gear
 * becomes less. */
void er_motors_linearise(const er_run *r, const er_state *state);
void er_motors_eliminate(const er_run *r, er_complex_pair *matrix);

/* Adds the motors' defects at the step's end to those of their gears; returns the largest of their own errors, as an
 * acceleration. */
double er_motors_defect(const er_run *r, double *defect);

#endif
