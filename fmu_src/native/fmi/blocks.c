/* The FMU's blocks of reals, a row each: what they are, where they are set, what they are computed by. */
#include <string.h>

#include "blocks.h"
#include "indicators.h"

#include "../core/outputs/chain_motion.h"
#include "../core/outputs/drive_outputs.h"
#include "../core/outputs/free_motion.h"
#include "../core/outputs/outputs.h"
#include "../core/outputs/tangent.h"

/* What is computed from the model alone by `of_model`, and its derivatives by `of_change`: the functions of a row. */
#define OF_MODEL(find, of_model, along, of_change)                                                  \
    static bool find(er_instance *instance, double *values)                                         \
    {                                                                                               \
        of_model(instance->model, values);                                                          \
        return true;                                                                                \
    }                                                                                               \
    static bool along(er_instance *instance, const er_change *change, double *derivatives)          \
    {                                                                                               \
        of_change(instance->model, change, derivatives);                                            \
        return true;                                                                                \
    }

/* The same of what is asked of each torsion or motor. */
#define OF_EACH(find, of_model, along, of_change, count, entry)                                     \
    static bool find(er_instance *instance, double *values)                                         \
    {                                                                                               \
        for (int i = 0; i < (count); i++)                                                           \
            values[i] = of_model(instance->model, entry);                                           \
        return true;                                                                                \
    }                                                                                               \
    static bool along(er_instance *instance, const er_change *change, double *derivatives)          \
    {                                                                                               \
        for (int i = 0; i < (count); i++)                                                           \
            derivatives[i] = of_change(instance->model, change, entry);                             \
        return true;                                                                                \
    }

/* The same of event indicators: `count` values from place `first` of those that indicators.c finds. */
#define OF_INDICATORS(find, indicate, along, indicate_along, first, count)                          \
    static bool find(er_instance *instance, double *values)                                         \
    {                                                                                               \
        double ways[ER_MAX_INDICATORS];                                                             \
        indicate(instance, ways);                                                                   \
        memcpy(values, ways + (first), (size_t)(count) * sizeof *values);                           \
        return true;                                                                                \
    }                                                                                               \
    static bool along(er_instance *instance, const er_change *change, double *derivatives)          \
    {                                                                                               \
        double ways[ER_MAX_INDICATORS];                                                             \
        indicate_along(instance, change, ways);                                                     \
        memcpy(derivatives, ways + (first), (size_t)(count) * sizeof *derivatives);                 \
        return true;                                                                                \
    }

OF_MODEL(find_tcp, er_model_tcp, tcp_along, er_tcp_along)
OF_MODEL(find_velocity, er_model_velocity, velocity_along, er_velocity_along)
OF_MODEL(find_rigid, er_model_rigid, rigid_along, er_rigid_along)
OF_MODEL(find_deviation, er_model_deviation, deviation_along, er_deviation_along)
OF_MODEL(find_motor_angle, er_model_motor_angle, motor_angle_along, er_motor_angle_along)
OF_MODEL(find_motor_rate, er_model_motor_rate, motor_rate_along, er_motor_rate_along)
OF_EACH(find_gear_torque, er_model_gear_torque, gear_torque_along, er_gear_torque_along,
        instance->interface.torsions, instance->interface.torsion[i])
OF_EACH(find_motor_torque, er_model_motor_torque, motor_torque_along, er_motor_torque_along,
        instance->interface.torsions, instance->interface.torsion[i])
OF_EACH(find_motor_acceleration, er_model_motor_acceleration, motor_acceleration_along, er_motor_acceleration_along,
        instance->model->robot.motors, i)
OF_EACH(find_integral_growth, er_model_integral_growth, integral_growth_along, er_integral_growth_along,
        instance->model->robot.motors, i)
OF_INDICATORS(find_bends, er_indicate_bends, bends_along, er_indicate_bends_along,
              0, 2 * instance->interface.torsions)
OF_INDICATORS(find_slips, er_indicate_slips, slips_along, er_indicate_slips_along,
              0, instance->model->robot.elements)
OF_INDICATORS(find_motor_slips, er_indicate_slips, motor_slips_along, er_indicate_slips_along,
              instance->model->robot.elements, instance->model->robot.motors)
OF_INDICATORS(find_limits, er_indicate_limits, limits_along, er_indicate_limits_along,
              0, instance->model->robot.motors)

static bool find_compliance(er_instance *instance, double *values)
{
    return er_model_compliance(instance->model, values, &instance->failure);
}

static bool compliance_along(er_instance *instance, const er_change *change, double *derivatives)
{
    return er_compliance_along(instance->model, change, derivatives) ||
           er_fail(&instance->failure, "the compliance has no derivative here; the robot's stiffness is singular");
}

static bool find_acceleration(er_instance *instance, double *values)
{
    er_model *model = instance->model;
    const size_t size = (size_t)model->robot.elastics * sizeof *values;
    memset(values, 0, size);
    if (model->memory.options.quasistatic)
        return true;
    if (!er_free_motion_solve(model))
        return er_fail(&instance->failure, "the elastic angles have no accelerations: the mass matrix is singular");
    memcpy(values, model->free.acceleration, size);
    return true;
}

static bool acceleration_along(er_instance *instance, const er_change *change, double *derivatives)
{
    const er_model *model = instance->model;
    memset(derivatives, 0, (size_t)model->robot.elastics * sizeof *derivatives);
    if (!model->memory.options.quasistatic)
        er_free_motion_along(instance->model, change, derivatives);
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

/* Rates of the elongations of motors' friction where the motors have rates. */
static void follow_motors(const er_model *model, const double *motors, double *rates)
{
    for (int d = 0; d < model->robot.motors; d++)
        rates[d] = model->memory.state.stops.slipping[model->robot.elements + d] == 0 ? motors[d] : 0.0;
}

static bool find_presliding_rate(er_instance *instance, double *values)
{
    follow_motors(instance->model, instance->model->memory.state.motors.rate, values);
    return true;
}

static bool presliding_rate_along(er_instance *instance, const er_change *change, double *derivatives)
{
    follow_motors(instance->model, change->motors.rate, derivatives);
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
        instance->over_limit &= ~bit;
    } else if ((instance->over_limit & bit) == 0) {
        instance->over_limit |= bit;
        instance->warned = true;
        er_fail(&instance->failure, "%s: expected an angle within the drive's limits, %s to %s rad, got %s rad",
                interface->name[reference], er_shown(limit[0], low), er_shown(limit[1], high), er_shown(q, number));
    }
}

/* Where an input or a parameter has its value, where what lies in the state does, and where changes of these stand. */
#define AT(input, change) .place = offsetof(er_inputs, input), .along = offsetof(er_change, change)
#define IN_STATE(entry, change) .place = offsetof(er_state, entry), .along = offsetof(er_change, change)
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
    /* Outputs that lie in the state are the states of model exchange. */
    {"deflection", ER_OUTPUT, .elastic = 1, IN_STATE(x, x)},
    {"deflection_rate", ER_OUTPUT, .elastic = 1, IN_STATE(v, v)},
    {"elongation", ER_OUTPUT, .element = 1, IN_STATE(stops.elongation, elongation)},
    {"contact_force", ER_OUTPUT, .fixed = 3, .find = find_contact_force,
     .differentiate = contact_force_along},
    {"gear_torque", ER_OUTPUT, .torsion = 1, .find = find_gear_torque,
     .differentiate = gear_torque_along},
    {"motor_torque", ER_OUTPUT, .torsion = 1, .find = find_motor_torque,
     .differentiate = motor_torque_along},
    {"motor_angle", ER_OUTPUT, .joint = 1, .find = find_motor_angle,
     .differentiate = motor_angle_along},
    {"motor_rate", ER_OUTPUT, .joint = 1, .find = find_motor_rate, .differentiate = motor_rate_along},

    {"rotor_angle", ER_OUTPUT, .motor = 1, IN_STATE(motors.angle, motors.angle)},
    {"rotor_rate", ER_OUTPUT, .motor = 1, IN_STATE(motors.rate, motors.rate)},
    {"servo_integral", ER_OUTPUT, .motor = 1, IN_STATE(motors.integral, motors.integral)},
    {"presliding", ER_OUTPUT, .motor = 1, .behind_elements = true, IN_STATE(stops.elongation, elongation)},

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

    {"deflection_derivative", ER_LOCAL, .elastic = 1, IN_STATE(v, v)},
    {"rate_derivative", ER_LOCAL, .elastic = 1, .find = find_acceleration,
     .differentiate = acceleration_along, .from_value = true},
    {"elongation_derivative", ER_LOCAL, .element = 1, .find = find_elongation_rate,
     .differentiate = elongation_rate_along},
    {"rotor_angle_derivative", ER_LOCAL, .motor = 1, IN_STATE(motors.rate, motors.rate)},
    {"rotor_rate_derivative", ER_LOCAL, .motor = 1, .find = find_motor_acceleration,
     .differentiate = motor_acceleration_along},
    {"servo_integral_derivative", ER_LOCAL, .motor = 1, .find = find_integral_growth,
     .differentiate = integral_growth_along},
    {"presliding_derivative", ER_LOCAL, .motor = 1, .find = find_presliding_rate,
     .differentiate = presliding_rate_along},
    {"bend", ER_LOCAL, .torsion = 2, .find = find_bends, .differentiate = bends_along},
    {"slip", ER_LOCAL, .element = 1, .find = find_slips, .differentiate = slips_along},
    {"motor_slip", ER_LOCAL, .motor = 1, .find = find_motor_slips, .differentiate = motor_slips_along},
    {"torque_room", ER_LOCAL, .motor = 1, .find = find_limits, .differentiate = limits_along},
    {"contact_gap", ER_LOCAL, .fixed = 1, .find = find_contact_gap, .differentiate = contact_gap_along},
};
const int er_block_count = sizeof er_blocks / sizeof *er_blocks;
typedef char blocks_fit[sizeof er_blocks / sizeof *er_blocks <= ER_MAX_BLOCKS ? 1 : -1];

/* Where a block's first variable stands in a state, or in a change of it. */
static const double *first_in(const er_instance *instance, int block, const void *whole, size_t place)
{
    unsigned first = (unsigned)instance->interface.first[block];
    return (const double *)((const char *)whole + place) + er_entry(&instance->interface, first);
}

bool er_block_find(er_instance *instance, int block, double *values)
{
    const er_block *row = &er_blocks[block];
    const er_state *state = &instance->model->memory.state;
    if (row->find != NULL)
        return row->find(instance, values);
    memcpy(values, first_in(instance, block, state, row->place),
           (size_t)instance->interface.size[block] * sizeof *values);
    return true;
}

bool er_block_along(er_instance *instance, int block, const er_change *change, double *derivatives)
{
    const er_block *row = &er_blocks[block];
    if (row->differentiate != NULL)
        return row->differentiate(instance, change, derivatives);
    if (row->place == 0)
        return er_fail(&instance->failure, "%s has no derivative; expected another output",
                       instance->interface.name[instance->interface.first[block]]);
    memcpy(derivatives, first_in(instance, block, change, row->along),
           (size_t)instance->interface.size[block] * sizeof *derivatives);
    return true;
}

double *er_block_value(er_instance *instance, unsigned reference)
{
    const er_block *block = er_block_of(&instance->interface, reference);
    int entry = er_entry(&instance->interface, reference);
    return er_is_computed(block)
               ? (double *)((char *)&instance->model->memory.state + block->place) + entry
               : er_input_at(instance, block->place, entry);
}
