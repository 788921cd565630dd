#include "contact.h"

#include <math.h>
#include <string.h>

/* Slip speed to begin with [m/s]: well below the speed of tools that slide. */
#define SLIP_SPEED 1e-3

er_contact er_contact_none(void)
{
    er_contact none = {0.0, 0.0, 0.0, 0.0, SLIP_SPEED, {0.0, 0.0, 1.0}};
    return none;
}

static double vector_length(const double v[3])
{
    return hypot(hypot(v[0], v[1]), v[2]);
}

bool er_contact_require(const er_contact *contact, er_failure *failure)
{
    const double *n = contact->normal;
    double length;
    if (!er_contact_holds(contact))
        return true;
    length = vector_length(n);
    if (contact->friction > 0.0 && contact->slip_speed == 0.0)
        return er_fail(failure, "contact.slip_speed: expected a number > 0 m/s where there is friction, got 0");
    return (length > 0.0 && length < INFINITY) ||
           er_fail(failure, "normal of the contact (contact.nx to contact.nz): expected a vector that is"
                   " not zero, out of the plane to the robot's side, got %.6g, %.6g, %.6g", n[0], n[1], n[2]);
}

/* n of length 1. */
static void find_normal(const er_contact *contact, double normal[3])
{
    double length = vector_length(contact->normal);
    for (int c = 0; c < 3; c++)
        normal[c] = contact->normal[c] / length;
}

er_touch er_contact_touch(const er_contact *contact, const double gap[3])
{
    er_touch touch;
    find_normal(contact, touch.normal);
    touch.depth = contact->radius + er_dot(touch.normal, gap);
    memset(touch.velocity, 0, sizeof touch.velocity);
    return touch;
}

double er_contact_approach(const er_touch *touch)
{
    return -er_dot(touch->normal, touch->velocity);
}

/* 1 + c d', not below 0: faster than that the body springs back more slowly than the tool leaves. */
static double hunt_crossley_factor(const er_contact *contact, const er_touch *touch)
{
    return fmax(0.0, 1.0 + contact->dissipation * er_contact_approach(touch));
}

/* s and sqrt(s . s + v^2); without either, and so without friction, any length will do */
static double find_slip(const er_contact *contact, const er_touch *touch, double slip[3])
{
    double rate = er_contact_approach(touch);
    for (int c = 0; c < 3; c++)
        slip[c] = touch->velocity[c] + rate * touch->normal[c];
    double size = hypot(vector_length(slip), contact->slip_speed);
    return size > 0.0 ? size : 1.0;
}

void er_contact_force(const er_contact *contact, const er_touch *touch, double force[3])
{
    double slip[3], size = find_slip(contact, touch, slip);
    double pressure = contact->stiffness * touch->depth * hunt_crossley_factor(contact, touch);
    for (int c = 0; c < 3; c++)
        force[c] = pressure * (touch->normal[c] - contact->friction * slip[c] / size);
}

void er_contact_along(const er_contact *contact, const er_touch *touch, const er_contact *change,
                      const er_touch *along, double force[3])
{
    const double *n = touch->normal;
    double slip[3], slip_change[3], size = find_slip(contact, touch, slip), size_change;
    double rate = er_contact_approach(touch), resisting = hunt_crossley_factor(contact, touch);
    double rate_change = -er_dot(n, along->velocity) - er_dot(along->normal, touch->velocity);
    double k = contact->stiffness, d = touch->depth, pressure = k * d * resisting;
    double pressure_change = (change->stiffness * d + k * along->depth) * resisting;
    if (resisting > 0.0)
        pressure_change += k * d * (change->dissipation * rate + contact->dissipation * rate_change);
    for (int c = 0; c < 3; c++)
        slip_change[c] = along->velocity[c] + rate_change * n[c] + rate * along->normal[c];
    size_change = (er_dot(slip, slip_change) + contact->slip_speed * change->slip_speed) / size;
    for (int c = 0; c < 3; c++) {
        double part = slip[c] / size, part_change = (slip_change[c] - part * size_change) / size;
        force[c] = pressure_change * (n[c] - contact->friction * part) +
                   pressure * (along->normal[c] - change->friction * part - contact->friction * part_change);
    }
}

void er_contact_touch_along(const er_contact *contact, const er_touch *touch, const double gap[3],
                            const er_contact *change, const double gap_change[3], er_touch *along)
{
    const double *n = touch->normal;
    double length = vector_length(contact->normal), stretch = er_dot(n, change->normal);
    for (int c = 0; c < 3; c++)
        along->normal[c] = (change->normal[c] - stretch * n[c]) / length;
    along->depth = change->radius + er_dot(n, gap_change) + er_dot(along->normal, gap);
}

void er_contact_matrices(const er_contact *contact, const er_touch *touch,
                         double stiffness[ER_SYMMETRIC], double damping[ER_SYMMETRIC])
{
    const double *n = touch->normal;
    double slip[3], size = find_slip(contact, touch, slip), d = fmax(0.0, touch->depth);
    double resisting = hunt_crossley_factor(contact, touch), pressure = contact->stiffness * d * resisting;
    double along = resisting > 0.0 ? contact->stiffness * d * contact->dissipation : 0.0;
    double across = contact->friction * pressure / size;
    for (int k = 0; k < ER_SYMMETRIC; k++) {
        int i = er_row[k], j = er_column[k];
        double nn = n[i] * n[j];
        stiffness[k] = contact->stiffness * resisting * nn;
        damping[k] = along * nn + across * ((i == j ? 1.0 : 0.0) - nn - slip[i] * slip[j] / (size * size));
    }
}
