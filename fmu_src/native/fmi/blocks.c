/* The FMU's blocks of reals, a row each: what they are, where they are set, what they are computed by. */
#include <string.h>

#include "../core/tangent.h"
#include "exchange.h"

/* What is computed from the model alone, and its derivatives. */
#define OF_MODEL(name)                                                                              \
    static bool find_##name(er_instance *instance, double *values)                                  \
    {                                                                                               \
        er_model_##name(instance->model, values);                                                   \
        return true;                                                                                \
    }                                                                                               \
    static bool name##_along(er_instance *instance, const er_change *change, double *derivatives)   \
    {                                                                                               \
        er_##name##_along(instance->model, change, derivatives);                                    \
        return true;                                                                                \
    }

/* The same of one entry of x, for every torsion. */
#define OF_TORSIONS(name)                                                                           \
    static bool find_##name(er_instance *instance, double *values)                                  \
    {                                                                                               \
        for (int i = 0; i < instance->interface.torsions; i++)                                      \
            values[i] = er_model_##name(instance->model, instance->interface.torsion[i]);           \
        return true;                                                                                \
    }                                                                                               \
    static bool name##_along(er_instance *instance, const er_change *change, double *derivatives)   \
    {                                                                                               \
        for (int i = 0; i < instance->interface.torsions; i++)                                      \
            derivatives[i] = er_##name##_along(instance->model, change, instance->interface.torsion[i]); \
        return true;                                                                                \
    }

/* The same of a motor, for every one. */
#define OF_MOTORS(name, value, along)                                                               \
    static bool find_##name(er_instance *instance, double *values)                                  \
    {                                                                                               \
        const er_model *model = instance->model;                                                    \
        const er_state *state = &model->memory.state;                                               \
        (void)state;                                                                                \
        for (int d = 0; d < model->robot.motors; d++)                                               \
            values[d] = value;                                                                      \
        return true;                                                                                \
    }                                                                                               \
    static bool name##_along(er_instance *instance, const er_change *change, double *derivatives)   \
    {                                                                                               \
        const er_model *model = instance->model;                                                    \
        for (int d = 0; d < model->robot.motors; d++)                                               \
            derivatives[d] = along;                                                                 \
        return true;                                                                                \
    }

OF_MODEL(tcp)
OF_MODEL(velocity)
OF_MODEL(rigid)
OF_MODEL(deviation)
OF_MODEL(motor_angle)
OF_MODEL(motor_rate)
OF_TORSIONS(gear_torque)
OF_TORSIONS(motor_torque)

static bool find_compliance(er_instance *instance, double *values)
{
    return er_model_compliance(instance->model, values, &instance->failure);
}

static bool compliance_along(er_instance *instance, const er_change *change, double *derivatives)
{
    return er_compliance_along(instance->model, change, derivatives) ||
           er_fail(&instance->failure, "the compliance has no derivative here; the robot's stiffness is"
                                       " singular");
}

static size_t size_of_x(const er_instance *instance)
{
    return (size_t)instance->model->robot.elastics * sizeof(double);
}

static bool find_deflection(er_instance *instance, double *values)
{
    memcpy(values, instance->model->memory.state.x, size_of_x(instance));
    return true;
}

static bool deflection_along(er_instance *instance, const er_change *change, double *derivatives)
{
    memcpy(derivatives, change->x, size_of_x(instance));
    return true;
}

static bool find_rate(er_instance *instance, double *values)
{
    memcpy(values, instance->model->memory.state.v, size_of_x(instance));
    return true;
}

static bool rate_along(er_instance *instance, const er_change *change, double *derivatives)
{
    memcpy(derivatives, change->v, size_of_x(instance));
    return true;
}

static bool find_acceleration(er_instance *instance, double *values)
{
    er_model *model = instance->model;
    memset(values, 0, size_of_x(instance));
    if (model->memory.options.quasistatic)
        return true;
    if (!er_free_motion_find(model))
        return er_fail(&instance->failure, "the elastic angles have no accelerations: the mass matrix is"
                                           " singular");
    memcpy(values, model->free.acceleration, size_of_x(instance));
    return true;
}

static bool acceleration_along(er_instance *instance, const er_change *change, double *derivatives)
{
    memset(derivatives, 0, size_of_x(instance));
    if (!instance->model->memory.options.quasistatic)
        er_free_motion_along(instance->model, change, derivatives);
    return true;
}

static bool find_elongation(er_instance *instance, double *values)
{
    const er_model *model = instance->model;
    memcpy(values, model->memory.state.stops.elongation, (size_t)model->robot.elements * sizeof *values);
    return true;
}

static bool elongation_along(er_instance *instance, const er_change *change, double *derivatives)
{
    memcpy(derivatives, change->elongation, (size_t)instance->model->robot.elements * sizeof *derivatives);
    return true;
}

/* Rates of elongations where the coordinates have rates. */
static void follow_rates(const er_instance *instance, const double *v, double *rates)
{
    static const double still[ER_MAX_ANGLES];
    const er_model *model = instance->model;
    memset(rates, 0, (size_t)model->robot.elements * sizeof *rates);
    er_stops_follow(&model->robot, &model->memory.state.stops, still, v, rates);
}

static bool find_elongation_rate(er_instance *instance, double *values)
{
    follow_rates(instance, instance->model->memory.state.v, values);
    return true;
}

static bool elongation_rate_along(er_instance *instance, const er_change *change, double *derivatives)
{
    follow_rates(instance, change->v, derivatives);
    return true;
}

/* Elongation of a motor's friction, and its rate where the motor has one. */
static int of_friction(const er_model *model, int d)
{
    return model->robot.elements + d;
}

static double follow(const er_model *model, int d, double rate)
{
    return model->memory.state.stops.slipping[of_friction(model, d)] == 0 ? rate : 0.0;
}

OF_MOTORS(rotor_angle, state->motors.angle[d], change->motors.angle[d])
OF_MOTORS(rotor_rate, state->motors.rate[d], change->motors.rate[d])
OF_MOTORS(servo_integral, state->motors.integral[d], change->motors.integral[d])
OF_MOTORS(presliding, state->stops.elongation[of_friction(model, d)], change->elongation[of_friction(model, d)])
OF_MOTORS(rotor_acceleration, er_model_motor_acceleration(model, d), er_motor_acceleration_along(model, change, d))
OF_MOTORS(integral_growth, er_model_integral_growth(model, d), er_integral_growth_along(model, change, d))
OF_MOTORS(presliding_rate, follow(model, d, state->motors.rate[d]), follow(model, d, change->motors.rate[d]))

static bool find_slips(er_instance *instance, double *values)
{
    double ways[ER_MAX_ELEMENTS];
    er_exchange_slips(instance, ways);
    memcpy(values, ways, (size_t)instance->model->robot.elements * sizeof *values);
    return true;
}

static bool slips_along(er_instance *instance, const er_change *change, double *derivatives)
{
    double ways[ER_MAX_ELEMENTS];
    er_exchange_slips_along(instance, change, ways);
    memcpy(derivatives, ways, (size_t)instance->model->robot.elements * sizeof *derivatives);
    return true;
}

/* The same of motors' friction; 1 where they do not move by themselves. */
static bool find_motor_slips(er_instance *instance, double *values)
{
    double ways[ER_MAX_ELEMENTS];
    const er_model *model = instance->model;
    er_exchange_slips(instance, ways);
    for (int d = 0; d < model->robot.motors; d++)
        values[d] = er_model_motors(model) > 0 ? ways[of_friction(model, d)] : 1.0;
    return true;
}

static bool motor_slips_along(er_instance *instance, const er_change *change, double *derivatives)
{
    double ways[ER_MAX_ELEMENTS];
    const er_model *model = instance->model;
    er_exchange_slips_along(instance, change, ways);
    for (int d = 0; d < model->robot.motors; d++)
        derivatives[d] = er_model_motors(model) > 0 ? ways[of_friction(model, d)] : 0.0;
    return true;
}

static bool find_limits(er_instance *instance, double *values)
{
    er_exchange_limits(instance, values);
    return true;
}

static bool limits_along(er_instance *instance, const er_change *change, double *derivatives)
{
    er_exchange_limits_along(instance, change, derivatives);
    return true;
}

static bool find_bends(er_instance *instance, double *values)
{
    er_exchange_bends(instance, values);
    return true;
}

static bool bends_along(er_instance *instance, const er_change *change, double *derivatives)
{
    er_exchange_bends_along(instance, change, derivatives);
    return true;
}

static bool find_contact_force(er_instance *instance, double *values)
{
    er_contact_motion motion;
    double wrench[6];
    er_model_contact(instance->model, &motion, wrench);
    memcpy(values, wrench, 3 * sizeof *values);
    return true;
}

/* The way from the sphere to the plane of the contact; 1 without one. */
static bool find_contact_gap(er_instance *instance, double *gap)
{
    er_contact_motion motion;
    double wrench[6];
    *gap = 1.0;
    if (er_contact_holds(&instance->model->memory.held.load.contact)) {
        er_model_contact(instance->model, &motion, wrench);
        *gap = -motion.touch.depth;
    }
    return true;
}

static bool contact_force_along(er_instance *instance, const er_change *change, double *derivatives)
{
    double gap;
    er_contact_of_model_along(instance->model, change, derivatives, &gap);
    return true;
}

static bool contact_gap_along(er_instance *instance, const er_change *change, double *gap)
{
    double force[3];
    er_contact_of_model_along(instance->model, change, force, gap);
    return true;
}

/* A drive that is told to go beyond its limits goes there: said once, until it is back. */
static void watch_limits(er_instance *instance, int reference)
{
    const er_interface *interface = &instance->interface;
    int i = er_entry(interface, (unsigned)reference);
    const double *limit = interface->limit[i];
    double q = instance->inputs.command.q[i];
    unsigned bit = 1u << i;
    char low[ER_NUMBER_TEXT], high[ER_NUMBER_TEXT], number[ER_NUMBER_TEXT];
    if (q >= limit[0] && q <= limit[1]) {
        instance->beyond &= ~bit;
    } else if ((instance->beyond & bit) == 0) {
        instance->beyond |= bit;
        instance->warned = true;
        er_fail(&instance->failure, "%s: expected an angle within the drive's limits, %s to %s rad, got %s rad",
                interface->name[reference], er_shown(limit[0], low), er_shown(limit[1], high),
                er_shown(q, number));
    }
}

/* Place of what is set, and of how it changes. */
#define AT(input, change) .place = offsetof(er_inputs, input), .along = offsetof(er_change, change)
#define STATE(entry, change) .place = offsetof(er_state, entry), .along = offsetof(er_change, change)
#define RATE(input) .rate = offsetof(er_inputs, input)

const er_block er_blocks[] = {
    {"wrench", ER_INPUT, .fixed = 6, AT(load.wrench, held.load.wrench), RATE(load.rate),
     .cause = ER_BY_WRENCH},
    {"q_cmd", ER_INPUT, .joint = 1, AT(command.q, held.q), .cause = ER_BY_Q, .watch = watch_limits},
    {"qd_cmd", ER_INPUT, .joint = 1, AT(command.qd, held.qd), .cause = ER_BY_QD},
    {"qdd_cmd", ER_INPUT, .joint = 1, AT(command.qdd, held.qdd), RATE(command.jerk), .cause = ER_BY_QDD},
    {"anchor", ER_INPUT, .fixed = 3, AT(load.anchor.position, held.load.anchor.position),
     RATE(load.anchor.velocity), .cause = ER_BY_ANCHOR},
    {"anchor_velocity", ER_INPUT, .fixed = 3, AT(load.anchor.velocity, held.load.anchor.velocity),
     .cause = ER_BY_ANCHOR_VELOCITY},
    {"anchor_stiffness", ER_INPUT, .fixed = ER_SYMMETRIC,
     AT(load.anchor.stiffness, held.load.anchor.stiffness), .cause = ER_BY_SPRING},
    /* In model exchange the master moves the wrench. */
    {"wrench_rate", ER_INPUT, .fixed = 6, AT(load.rate, held.load.rate), .cause = ER_BY_RATE},
    {"contact", ER_INPUT, .fixed = 5, .range = ER_NOT_NEGATIVE, AT(load.contact, held.load.contact),
     .cause = ER_BY_CONTACT},
    {"contact_normal", ER_INPUT, .fixed = 3, AT(load.contact.normal, held.load.contact.normal),
     .cause = ER_BY_NORMAL},
    {"torque_cmd", ER_INPUT, .motor = 1, AT(command.torque, held.torque), .cause = ER_BY_TORQUE},

    {"tcp", ER_OUTPUT, .fixed = 7, .find = find_tcp, .differentiate = tcp_along},
    {"velocity", ER_OUTPUT, .fixed = 6, .find = find_velocity, .differentiate = velocity_along},
    {"rigid", ER_OUTPUT, .fixed = 7, .find = find_rigid, .differentiate = rigid_along},
    {"deviation", ER_OUTPUT, .fixed = 6, .find = find_deviation, .differentiate = deviation_along},
    {"compliance", ER_OUTPUT, .fixed = 6, .find = find_compliance, .differentiate = compliance_along},
    {"deflection", ER_OUTPUT, .elastic = 1, STATE(x, x), .find = find_deflection,
     .differentiate = deflection_along},
    {"deflection_rate", ER_OUTPUT, .elastic = 1, STATE(v, v), .find = find_rate,
     .differentiate = rate_along},
    {"elongation", ER_OUTPUT, .element = 1, STATE(stops.elongation, elongation), .find = find_elongation,
     .differentiate = elongation_along},
    {"contact_force", ER_OUTPUT, .fixed = 3, .find = find_contact_force,
     .differentiate = contact_force_along},
    {"gear_torque", ER_OUTPUT, .torsion = 1, .find = find_gear_torque,
     .differentiate = gear_torque_along},
    {"motor_torque", ER_OUTPUT, .torsion = 1, .find = find_motor_torque,
     .differentiate = motor_torque_along},
    {"motor_angle", ER_OUTPUT, .joint = 1, .find = find_motor_angle,
     .differentiate = motor_angle_along},
    {"motor_rate", ER_OUTPUT, .joint = 1, .find = find_motor_rate, .differentiate = motor_rate_along},

    {"rotor_angle", ER_OUTPUT, .motor = 1, STATE(motors.angle, motors.angle), .find = find_rotor_angle,
     .differentiate = rotor_angle_along},
    {"rotor_rate", ER_OUTPUT, .motor = 1, STATE(motors.rate, motors.rate), .find = find_rotor_rate,
     .differentiate = rotor_rate_along},
    {"servo_integral", ER_OUTPUT, .motor = 1, STATE(motors.integral, motors.integral), .find = find_servo_integral,
     .differentiate = servo_integral_along},
    {"presliding", ER_OUTPUT, .motor = 1, .behind_elements = true, STATE(stops.elongation, elongation),
     .find = find_presliding, .differentiate = presliding_along},

    {"gravity", ER_TUNABLE, .fixed = 3, AT(parameters.gravity, parameters.gravity),
     .cause = ER_BY_GRAVITY},
    {"stiffness", ER_TUNABLE, .elastic = 1, .range = ER_POSITIVE,
     AT(parameters.stiffness, parameters.stiffness), .cause = ER_BY_STIFFNESS},
    {"damping", ER_TUNABLE, .elastic = 1, .range = ER_NOT_NEGATIVE,
     AT(parameters.damping, parameters.damping), .cause = ER_BY_DAMPING},
    {"backlash", ER_TUNABLE, .torsion = 1, .range = ER_NOT_NEGATIVE,
     AT(parameters.backlash, parameters.backlash), .cause = ER_BY_BACKLASH},
    {"hysteresis", ER_TUNABLE, .hysteretic = 1, .range = ER_NOT_NEGATIVE,
     AT(parameters.hysteresis, parameters.hysteresis), .cause = ER_BY_HYSTERESIS},
    {"friction", ER_TUNABLE, .motor = 1, .range = ER_NOT_NEGATIVE, AT(parameters.friction, parameters.friction),
     .cause = ER_BY_FRICTION},
    {"tolerance", ER_FIXED, .fixed = 1, .range = ER_NOT_NEGATIVE,
     .place = offsetof(er_inputs, tcp_tolerance)},

    {"deflection_derivative", ER_LOCAL, .elastic = 1, .find = find_rate, .differentiate = rate_along},
    {"rate_derivative", ER_LOCAL, .elastic = 1, .find = find_acceleration,
     .differentiate = acceleration_along, .from_value = true},
    {"elongation_derivative", ER_LOCAL, .element = 1, .find = find_elongation_rate,
     .differentiate = elongation_rate_along},
    {"rotor_angle_derivative", ER_LOCAL, .motor = 1, .find = find_rotor_rate, .differentiate = rotor_rate_along},
    {"rotor_rate_derivative", ER_LOCAL, .motor = 1, .find = find_rotor_acceleration,
     .differentiate = rotor_acceleration_along},
    {"servo_integral_derivative", ER_LOCAL, .motor = 1, .find = find_integral_growth,
     .differentiate = integral_growth_along},
    {"presliding_derivative", ER_LOCAL, .motor = 1, .find = find_presliding_rate,
     .differentiate = presliding_rate_along},
    {"bend", ER_LOCAL, .torsion = 2, .find = find_bends, .differentiate = bends_along,
     .is_indicator = true},
    {"slip", ER_LOCAL, .element = 1, .find = find_slips, .differentiate = slips_along, .is_indicator = true},
    {"motor_slip", ER_LOCAL, .motor = 1, .find = find_motor_slips, .differentiate = motor_slips_along,
     .is_indicator = true},
    {"torque_room", ER_LOCAL, .motor = 1, .find = find_limits, .differentiate = limits_along, .is_indicator = true},
    {"contact_gap", ER_LOCAL, .fixed = 1, .find = find_contact_gap, .differentiate = contact_gap_along,
     .is_indicator = true},
};
const int er_block_count = sizeof er_blocks / sizeof *er_blocks;
typedef char blocks_fit[sizeof er_blocks / sizeof *er_blocks <= ER_MAX_BLOCKS ? 1 : -1];
