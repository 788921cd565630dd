"""The FMU's outputs, and what they depend on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

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
from elastic_robot.fmi.variables import (
    POSE,
    SYMMETRIC,
    TIME,
    Block,
    Group,
    Names,
    along,
    group,
    numbered,
)


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
        *groups: Group,
        follows: Names = STEP,
        starts_from: Names = REST,
        exchanged: Names = (*HELD, TIME, "deflection"),
        elementwise: Names = (),
        tuned: Names = TUNABLE,
    ) -> Block:
        moved = (key for key, at in MOVED.items() if at in exchanged)
        return replace(
            Block.of("output", "continuous", *groups),
            follows=follows,
            starts_from=starts_from,
            exchanged=tuple(dict.fromkeys((*exchanged, *moved))),
            elementwise=elementwise,
            tuned=tuned,
        )

    def state(
        name: str, unit: str, text: str, parts: Mapping[str, str], *starts_from: str
    ) -> Block:
        """Return the block of a state."""
        states = group(name, unit, text, parts, nominal=STATES[name].nominal)
        return block(states, starts_from=starts_from, exchanged=(name,), elementwise=(name,))

    def rotor(name: str, unit: str, text: str, *starts_from: str) -> Block:
        parts = {f"{name}[{i}]": f"joint[{i}]" for i in motors}
        return state(name, unit, f"{text} of motors that move by themselves", parts, *starts_from)

    def pose(name: str, text: str, **dependencies: Names) -> Block:
        direction = f"Unit quaternion of {text}, tool axes to base axes"
        place, turn = along(f"{name}."), along(f"{name}.", POSE[3:])
        return block(
            group(f"{name}.position", "m", f"Position of {text}, base axes", place),
            group(f"{name}.orientation", "1", direction, turn, minimum=-1.0, maximum=1.0),
            **{"exchanged": ("q_cmd", TIME, "deflection"), **dependencies},
        )

    def torques(name: str, text: str, commanded: Names = ()) -> Block:
        joints = chain.elastic_joint[chain.torsions] + 1
        parts = {f"{name}[{i}]": f"joint[{i}]" for i in joints}
        return block(
            group(name, "N.m", text, parts, nominal=TORQUE),
            starts_from=tuple(dict.fromkeys((*REST, *commanded, "friction"))),
            exchanged=(*commanded, *STATES),
        )

    # Without motors that move by themselves drives follow their commands alone.
    driven: dict[str, Names] = {
        "follows": STEP if motors else COMMANDS,
        "tuned": TUNABLE if motors else (),
    }

    def drives(name: str, unit: str, text: str, command: str) -> Block:
        parts = numbered(name, (f"drive {i + 1}" for i in range(chain.joint_count)))
        return block(
            group(name, unit, f"{text} of the drive at the gear's output", parts),
            starts_from=(command, "strings", TIME),
            exchanged=(command, TIME),
            elementwise=() if motors else (command,),
            **driven,
        )

    # What motors feel of their gears' torque follows the place in a kinematic error.
    felt = ("q_cmd", TIME) if len(chain.kinematic_errors.joint) else ()
    compliance = "Static compliance of the TCP on the anchor's spring and the contact, base axes"
    names = chain.elastic_names
    elements = (f"element {number} of {names[gear]}" for gear, number in chain.elements.places)
    return {
        "tcp": pose("tcp", "the elastic robot's TCP"),
        "velocity": block(
            group("tcp.velocity", "m/s", "Velocity of the TCP, base axes", along("tcp.v")),
            group(
                "tcp.angular_velocity",
                "rad/s",
                "Angular velocity of the tool, base axes",
                along("tcp.w"),
            ),
            starts_from=(*REST, "qd_cmd"),
            exchanged=("q_cmd", "qd_cmd", TIME, *MOTION),
        ),
        "rigid": pose(
            "rigid",
            "the TCP with undeflected joints",
            starts_from=("q_cmd", "strings", TIME),
            exchanged=("q_cmd", TIME),
            **driven,
        ),
        "deviation": block(
            group(
                "deviation.position",
                "m",
                "TCP minus rigid TCP, base axes",
                along("deviation."),
                nominal=DEVIATION,
            ),
            group(
                "deviation.rotation",
                "rad",
                "Rotation vector from the rigid to the elastic tool, base axes",
                along("deviation.r"),
                nominal=ANGLE,
            ),
            exchanged=("q_cmd", TIME, "deflection"),
        ),
        "compliance": block(
            group(
                "compliance",
                "m/N",
                f"{compliance}, displacement by force",
                along("compliance.", SYMMETRIC),
                nominal=COMPLIANCE,
            )
        ),
        "deflection": state(
            "deflection", "rad", "Elastic angle", numbered("deflection", names), *REST
        ),
        "deflection_rate": state(
            "deflection_rate",
            "rad/s",
            "Rate of elastic angle",
            numbered("deflection_rate", names),
        ),
        "elongation": state(
            "elongation",
            "rad",
            "Elongation in the gears' hysteresis",
            numbered("elongation", elements),
            *REST,
        ),
        "contact_force": block(
            group(
                "contact.force",
                "N",
                "Force of the contact on the tool, base axes",
                along("contact.f"),
                nominal=FORCE,
            ),
            starts_from=(*REST, "anchor_velocity", "qd_cmd"),
            exchanged=CONTACT,
        ),
        "gear_torque": torques("gear_torque", "Torque of the gear on its link"),
        "motor_torque": torques(
            "motor_torque",
            "Torque of the motor at its gear's output",
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
