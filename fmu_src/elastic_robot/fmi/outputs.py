"""The FMU's outputs, and what they depend on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from elastic_robot.chain import Chain
from elastic_robot.fmi.sizes import (
    ANGLE,
    COMPLIANCE,
    DEVIATION,
    ELONGATION,
    FORCE,
    PRESLIDING,
    RATE,
    TORQUE,
)
from elastic_robot.fmi.variables import AXES, POSE, SYMMETRIC, TIME, Array, Block, Names, Variable


@dataclass(frozen=True)
class StateBlock:
    """A block of outputs that are states of model exchange.

    Attributes:
        derivative: The block of their derivatives by time.
        nominal: Usual size of one, for solvers, in its unit.
    """

    derivative: str
    nominal: float


# The states of model exchange in the order of modelDescription.xml and of the native FMU: x [rad], x'
# [rad/s] and s [rad]; of motors their angles [rad] and rates [rad/s], z [N m] and the elongation of
# their friction [rad].
STATES = {
    "deflection": StateBlock("deflection_derivative", ANGLE),
    "deflection_rate": StateBlock("rate_derivative", RATE),
    "elongation": StateBlock("elongation_derivative", ELONGATION),
    "rotor_angle": StateBlock("rotor_angle_derivative", ANGLE),
    "rotor_rate": StateBlock("rotor_rate_derivative", RATE),
    "servo_integral": StateBlock("servo_integral_derivative", TORQUE),
    "presliding": StateBlock("presliding_derivative", PRESLIDING),
}
# Those of motors that move by themselves, where the robot has any.
ROTORS = ("rotor_angle", "rotor_rate", "servo_integral", "presliding")
# Those that say where the robot is and how it moves.
MOTION = ("deflection", "deflection_rate")
# What the state at a step's end follows, what loads and posture follow, and the initial equilibrium.
STEP = (
    "wrench",
    "q_cmd",
    "qd_cmd",
    "qdd_cmd",
    "anchor",
    "anchor_velocity",
    "anchor_stiffness",
    "wrench_rate",
    "contact",
    "contact_normal",
    "torque_cmd",
)
COMMANDS = ("q_cmd", "qd_cmd", "qdd_cmd")
TUNABLE = ("gravity", "stiffness", "damping", "backlash", "hysteresis", "friction")
HELD = ("wrench", "q_cmd", "anchor", "anchor_stiffness", "contact", "contact_normal")
REST = (*HELD, "gravity", "stiffness", "backlash", "hysteresis", "strings", TIME)

# What motors that move by themselves move as their commands do otherwise.
MOVED = {"rotor_angle": "q_cmd", "rotor_rate": "qd_cmd"}

# What the contact feels in model exchange.
CONTACT = (
    "q_cmd",
    "qd_cmd",
    "anchor",
    "anchor_velocity",
    "contact",
    "contact_normal",
    TIME,
    *MOTION,
)


def outputs(chain: Chain, motors: Sequence[int] = ()) -> dict[str, Block]:
    """Return the outputs by block.

    Args:
        motors: Joints with a motor, counted from 1.
    """

    def block(
        variables: list[Variable],
        *arrays: Array,
        follows: Names = STEP,
        starts_from: Names = REST,
        exchanged: Names = (*HELD, TIME, "deflection"),
        elementwise: Names = (),
        tuned: Names = TUNABLE,
    ) -> Block:
        return Block(
            "output",
            "continuous",
            tuple(variables),
            follows,
            starts_from,
            arrays,
            tuple(
                dict.fromkeys((*exchanged, *(key for key, at in MOVED.items() if at in exchanged)))
            ),
            elementwise,
            tuned=tuned,
        )

    def state(
        name: str, unit: str, texts: Mapping[int, str], text: str, starts_from: Names = REST
    ) -> Block:
        """Return the block of a state: texts by number, and that of all of them."""
        nominal = STATES[name].nominal
        return block(
            [
                Variable(f"{name}[{k}]", unit, description, nominal=nominal)
                for k, description in texts.items()
            ],
            Array(name, text, len(texts)),
            starts_from=starts_from,
            exchanged=(name,),
            elementwise=(name,),
        )

    def rotor(name: str, unit: str, text: str, *starts_from: str) -> Block:
        return state(
            name,
            unit,
            {i: f"{text} of the motor of joint[{i}] where it moves by itself" for i in motors},
            f"{text}s of the motors, in the order of the joints that have one",
            starts_from,
        )

    def pose(
        group: str,
        text: str,
        follows: Names = STEP,
        starts_from: Names = REST,
        exchanged: Names = ("q_cmd", TIME, "deflection"),
        tuned: Names = TUNABLE,
    ) -> Block:
        position = [
            Variable(f"{group}.{c}", "m", f"Position {c} of {text}, base axes") for c in AXES
        ]
        orientation = [
            Variable(
                f"{group}.{c}",
                "1",
                f"Unit quaternion of {text}, component {c[1]}: tool axes to base axes",
                minimum=-1.0,
                maximum=1.0,
            )
            for c in POSE[3:]
        ]
        return block(
            position + orientation,
            Array(f"{group}.position", f"Position of {text}: x, y, z in base axes", 3),
            Array(
                f"{group}.orientation",
                f"Unit quaternion of {text}: x, y, z, w; tool axes to base axes",
                4,
            ),
            follows=follows,
            starts_from=starts_from,
            exchanged=exchanged,
            tuned=tuned,
        )

    def torques(name: str, text: str, commanded: Names = ()) -> Block:
        joints = chain.elastic_joint[chain.torsions] + 1
        return block(
            [
                Variable(f"{name}[{i}]", "N.m", f"Torque of {text}, joint[{i}]", nominal=TORQUE)
                for i in joints
            ],
            Array(
                name, f"Torques of {text}, in the order of the joints that have one", len(joints)
            ),
            starts_from=tuple(dict.fromkeys((*REST, *commanded, "friction"))),
            exchanged=(*commanded, *STATES),
        )

    def drives(name: str, unit: str, text: str, command: str) -> Block:
        count = chain.joint_count
        return block(
            [
                Variable(f"{name}[{i}]", unit, f"{text} at the gear's output of drive {i}")
                for i in range(1, count + 1)
            ],
            Array(name, f"{text}s of the drives at their gears' output", count),
            follows=STEP if motors else COMMANDS,
            starts_from=(command, "strings", TIME),
            exchanged=(command, TIME),
            elementwise=() if motors else (command,),
            tuned=TUNABLE if motors else (),
        )

    # What motors feel of their gears' torque follows the place in a kinematic error.
    felt = ("q_cmd", TIME) if len(chain.kinematic_errors.joint) else ()
    apart = "TCP minus rigid TCP"
    rotation_text = "Rotation vector from the rigid to the elastic tool"
    compliance = "Static compliance of the TCP on the anchor's spring and the contact"
    of_contact = "of the contact on the tool, base axes"
    names = chain.elastic_names
    return {
        "tcp": pose("tcp", "the elastic robot's TCP"),
        "velocity": block(
            [Variable(f"tcp.v{c}", "m/s", f"Velocity {c} of the TCP, base axes") for c in AXES]
            + [
                Variable(f"tcp.w{c}", "rad/s", f"Angular velocity {c} of the tool, base axes")
                for c in AXES
            ],
            Array("tcp.velocity", "Velocity of the TCP: x, y, z in base axes", 3),
            Array("tcp.angular_velocity", "Angular velocity of the tool: x, y, z in base axes", 3),
            starts_from=(*REST, "qd_cmd"),
            exchanged=("q_cmd", "qd_cmd", TIME, *MOTION),
        ),
        "rigid": pose(
            "rigid",
            "the TCP with undeflected joints",
            follows=STEP if motors else COMMANDS,
            starts_from=("q_cmd", "strings", TIME),
            exchanged=("q_cmd", TIME),
            tuned=TUNABLE if motors else (),
        ),
        "deviation": block(
            [
                Variable(f"deviation.{prefix}{c}", unit, f"{text}, {c}, base axes", nominal=nominal)
                for prefix, unit, text, nominal in (
                    ("", "m", apart, DEVIATION),
                    ("r", "rad", rotation_text, ANGLE),
                )
                for c in AXES
            ],
            Array("deviation.position", f"{apart}: x, y, z in base axes", 3),
            Array("deviation.rotation", f"{rotation_text}: x, y, z in base axes", 3),
            exchanged=("q_cmd", TIME, "deflection"),
        ),
        "compliance": block(
            [
                Variable(
                    f"compliance.{c}",
                    "m/N",
                    f"{compliance}: displacement {c[0]} by force {c[1]}, base axes",
                    nominal=COMPLIANCE,
                )
                for c in SYMMETRIC
            ],
            Array(
                "compliance",
                f"{compliance} in base axes, displacement by force: {', '.join(SYMMETRIC)}",
                6,
            ),
        ),
        "deflection": state(
            "deflection",
            "rad",
            {k: f"Elastic angle of {name}" for k, name in enumerate(names, start=1)},
            "Elastic angles, in the order of the stiffness parameters",
        ),
        "deflection_rate": state(
            "deflection_rate",
            "rad/s",
            {k: f"Rate of elastic angle of {name}" for k, name in enumerate(names, start=1)},
            "Rates of the elastic angles",
            starts_from=(),
        ),
        "elongation": state(
            "elongation",
            "rad",
            {
                k: f"Elongation of element {number} of the hysteresis of {names[gear]}"
                for k, (gear, number) in enumerate(chain.elements.places, start=1)
            },
            "Elongations of the elements of the gears' hysteresis, in the order of the gears",
        ),
        "contact_force": block(
            [
                Variable(f"contact.f{c}", "N", f"Force {c} {of_contact}", nominal=FORCE)
                for c in AXES
            ],
            Array("contact.force", f"Force {of_contact}: x, y, z", 3),
            starts_from=(*REST, "anchor_velocity", "qd_cmd"),
            exchanged=CONTACT,
        ),
        "gear_torque": torques("gear_torque", "the gear on its link"),
        "motor_torque": torques(
            "motor_torque",
            "the motor at its gear's output",
            (*COMMANDS, "torque_cmd", TIME) if motors else felt,
        ),
        "motor_angle": drives("motor_angle", "rad", "Angle", "q_cmd"),
        "motor_rate": drives("motor_rate", "rad/s", "Rate", "qd_cmd"),
        "rotor_angle": rotor("rotor_angle", "rad", "Angle", "q_cmd", "strings", TIME),
        "rotor_rate": rotor("rotor_rate", "rad/s", "Rate", "qd_cmd", "strings", TIME),
        "servo_integral": rotor(
            "servo_integral", "N.m", "Integral of the servo", *REST, "qd_cmd", "qdd_cmd"
        ),
        "presliding": rotor("presliding", "rad", "Elongation of the friction"),
    }
