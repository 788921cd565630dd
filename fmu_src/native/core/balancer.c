#include "balancer.h"

#include <stddef.h>

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
