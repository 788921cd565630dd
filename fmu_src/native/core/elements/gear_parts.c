#include "gear_parts.h"

#include <math.h>
#include <stddef.h>

double er_elements_torque(const er_robot *robot, int k, double slip_torque, const double *elongation)
{
    double sum = 0.0;
    for (int j = robot->first_element[k]; j < robot->first_element[k + 1]; j++)
        sum += robot->element[j].share / robot->element[j].angle * elongation[j];
    return slip_torque * sum;
}

void er_stops_stiffness(const er_robot *robot, const double *slip_torque, const er_stops *stops, double *stiffness)
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

er_gear_error er_gear_error_sum(const er_robot *robot, int joint, double angle)
{
    er_gear_error sum = {0.0, 0.0, 0.0, 0.0};
    for (int j = robot->first_error[joint]; j < robot->first_error[joint + 1]; j++) {
        const er_error_sine *sine = &robot->error[j];
        double n = sine->order, turned = n * angle + sine->phase;
        double s = sine->amplitude * sin(turned), c = sine->amplitude * n * cos(turned);
        sum.value += s;
        sum.slope += c;
        sum.bend -= n * n * s;
        sum.third -= n * n * c;
    }
    return sum;
}

er_transmission er_transmission_at(const er_robot *robot, int joint, double q, double qd, double qdd)
{
    return (er_transmission){er_gear_error_at(robot, joint, q), qd, qdd};
}

void er_transmit(const er_robot *robot, int joint, double *q, double *qd, double *qdd)
{
    er_gear_error error = er_gear_error_at(robot, joint, *q);
    *q += error.value;
    *qdd += error.slope * *qdd + error.bend * *qd * *qd;
    *qd += error.slope * *qd;
}

void er_transmit_along(const er_transmission *at, double *q, double *qd, double *qdd)
{
    const er_gear_error *e = &at->error;
    *qdd += e->slope * *qdd + 2.0 * e->bend * at->rate * *qd +
            (e->bend * at->acceleration + e->third * at->rate * at->rate) * *q;
    *qd += e->slope * *qd + e->bend * at->rate * *q;
    *q += e->slope * *q;
}

/* The cubic with these values and slopes at both ends of an interval. */
static er_balance on_cubic(const er_balancer *b, int k, double angle)
{
    double h = b->angle[k + 1] - b->angle[k], t = (angle - b->angle[k]) / h;
    double rise = b->torque[k + 1] - b->torque[k], first = h * b->slope[k], last = h * b->slope[k + 1];
    double c2 = 3.0 * rise - 2.0 * first - last, c3 = first + last - 2.0 * rise;
    er_balance at;
    at.torque = b->torque[k] + t * (first + t * (c2 + t * c3));
    at.slope = (first + t * (2.0 * c2 + 3.0 * t * c3)) / h;
    at.bend = (2.0 * c2 + 6.0 * t * c3) / (h * h);
    return at;
}

er_balance er_balance_at(const er_balancer *balancer, double angle)
{
    int low = 0, high = balancer->points - 1;
    if (angle <= balancer->angle[low] || angle >= balancer->angle[high]) {
        int end = angle <= balancer->angle[low] ? low : high;
        double slope = balancer->slope[end];
        return (er_balance){balancer->torque[end] + slope * (angle - balancer->angle[end]), slope, 0.0};
    }
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (angle < balancer->angle[middle])
            high = middle;
        else
            low = middle;
    }
    return on_cubic(balancer, low, angle);
}

static er_balance at_rest(const er_robot *robot, const er_balancer *balancer, const double *q, const double *x)
{
    int k = balancer->coordinate;
    return er_balance_at(balancer, q[robot->elastic_joint[k]] + (x == NULL ? 0.0 : x[k]));
}

void er_balance_torque(const er_robot *robot, const double *q, const double *x, double *torque)
{
    for (int b = 0; b < robot->balancers; b++)
        torque[robot->balancer[b].coordinate] += at_rest(robot, &robot->balancer[b], q, x).torque;
}

void er_balance_gradient(const er_robot *robot, const double *q, const double *x, double *gradient)
{
    for (int b = 0; b < robot->balancers; b++) {
        int k = robot->balancer[b].coordinate;
        gradient[k * robot->elastics + k] += at_rest(robot, &robot->balancer[b], q, x).slope;
    }
}
