#include "hysteresis.h"

#include <math.h>

double er_elements_torque(const er_robot *robot, int k, double slip_torque, const double *elongation)
{
    double sum = 0.0;
    for (int j = robot->first_element[k]; j < robot->first_element[k + 1]; j++)
        sum += robot->element[j].share / robot->element[j].angle * elongation[j];
    return slip_torque * sum;
}

void er_stops_stiffness(const er_robot *robot, const double *slip_torque, const er_stops *stops,
                        double *stiffness)
{
    for (int j = 0; j < robot->elements; j++)
        if (stops->slipping[j] == 0)
            stiffness[robot->element[j].coordinate] += er_element_stiffness(robot, slip_torque, j);
}

void er_stops_follow(const er_robot *robot, const er_stops *stops, const double *before,
                     const double *after, double *elongation)
{
    for (int j = 0; j < robot->elements; j++) {
        int k = robot->element[j].coordinate;
        if (stops->slipping[j] == 0)
            elongation[j] += after[k] - before[k];
    }
}

void er_stops_follow_motors(const er_robot *robot, const er_stops *stops, const double *before,
                            const double *after, double *elongation)
{
    for (int d = 0; d < robot->motors; d++)
        if (stops->slipping[robot->elements + d] == 0)
            elongation[robot->elements + d] += after[d] - before[d];
}

void er_stops_slip(const er_robot *robot, er_stops *stops, int j, int direction)
{
    stops->slipping[j] = direction;
    stops->elongation[j] = direction * robot->element[j].angle;
}

bool er_stops_slips_too(const er_robot *robot, const er_stops *stops, int j, int first, int direction)
{
    return j == first ||
           (stops->slipping[j] == 0 && direction * stops->elongation[j] >= robot->element[j].angle);
}

void er_stops_stick(const er_robot *robot, er_stops *stops, int coordinate)
{
    for (int j = robot->first_element[coordinate]; j < robot->first_element[coordinate + 1]; j++)
        stops->slipping[j] = 0;
}

bool er_stops_idle(const er_robot *robot, const double *slip_torque, int coordinate)
{
    int d = coordinate - robot->elastics;
    return slip_torque[coordinate] == 0.0 && !(d >= 0 && robot->motor[d].load_friction > 0.0);
}

void er_stops_limit(const er_robot *robot, er_stops *stops)
{
    for (int j = 0; j < er_all_elements(robot); j++)
        if (stops->slipping[j] == 0 && fabs(stops->elongation[j]) > robot->element[j].angle)
            er_stops_slip(robot, stops, j, stops->elongation[j] > 0.0 ? 1 : -1);
}

double er_stop_slack(const er_robot *robot, int j, double tolerance)
{
    const er_settings *settings = &robot->settings;
    return fmin(settings->slack * tolerance, settings->slack_of_width * robot->element[j].angle);
}

/* Within a first step the coordinate goes as far as its elements may beyond their slip angles. */
double er_reversal_slack(const er_robot *robot, int coordinate, double tolerance)
{
    double least = INFINITY;
    for (int j = robot->first_element[coordinate]; j < robot->first_element[coordinate + 1]; j++)
        least = fmin(least, er_stop_slack(robot, j, tolerance));
    return least / robot->settings.first_step;
}

double er_rest_torque(const er_robot *robot, const double *slip_torque, const er_history *history, int k,
                      double x, double *slope)
{
    double torque = 0.0;
    *slope = 0.0;
    for (int j = robot->first_element[k]; j < robot->first_element[k + 1]; j++) {
        double angle = robot->element[j].angle, stiffness = er_element_stiffness(robot, slip_torque, j);
        double elongation = history->elongation[j] + x - history->x[k];
        if (fabs(elongation) < angle)
            *slope += stiffness;
        torque += stiffness * fmax(fmin(elongation, angle), -angle);
    }
    return torque;
}

void er_stops_rest(const er_robot *robot, const er_history *history, const double *x, er_stops *stops)
{
    for (int j = 0; j < robot->elements; j++) {
        int k = robot->element[j].coordinate;
        double elongation = history->elongation[j] + x[k] - history->x[k];
        stops->slipping[j] = 0;
        stops->elongation[j] = elongation;
    }
    er_stops_limit(robot, stops);
}
