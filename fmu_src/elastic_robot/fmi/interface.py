"""The FMI contract as data: the variables of co-simulation, in the order of their value references.

The variables come in blocks.  The native FMU has those of model exchange beside them
(`coupling/fmu_export/exchange_blocks.py`), and reads the whole table from its robot.txt; what a block
means there is a row of fmi/blocks.c, what a choice means an enum of fmi/interface.h.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np

from elastic_robot.chain import Chain, build_chain
from elastic_robot.description import Robot
from elastic_robot.errors import ParameterError
from elastic_robot.fmi.inputs import inputs
from elastic_robot.fmi.outputs import outputs
from elastic_robot.fmi.tolerance import TOLERANCE
from elastic_robot.fmi.variables import Block, Names, Variable, along, group
from elastic_robot.motors import DRIVES
from elastic_robot.motors import IDEAL as IDEAL
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TORQUE_CURVES

MODEL_NAME = "ElasticRobot"
# Communication step to begin with [s].
STEP_SIZE = 0.01
# Among the resources of an FMU in Python: start values of strings that are not the usual ones.
STARTS = "starts.json"
TORQUE_CURVE_DEFAULT = "backlash"
Mode = Literal["dynamic", "quasistatic"]
MODES: tuple[Mode, ...] = get_args(Mode)
INITIAL_STATES = (
    "equilibrium",
    "undeflected",
    "equilibrium_from_below",
    "equilibrium_from_above",
)
# Of those after which all elements of hysteresis slip: upwards, downwards.
SLIPPED = {"equilibrium_from_below": 1, "equilibrium_from_above": -1}
# A joint by its number in a description; of an elastic coordinate, what is behind it as well.
_OF_JOINT = re.compile(r"(?:joint\[|drive )(\d+)\]?(?:\.tilt\[\d+\])?")


def blocks(robot: Robot, strings: Mapping[str, str] = MappingProxyType({})) -> dict[str, Block]:
    """Return the variables of co-simulation by block; the last block holds the strings.

    Args:
        robot: The robot.
        strings: Start values of strings by name, where they are not the usual ones.

    Raises:
        ParameterError: If there is no such string, or it cannot have the value.
    """
    chain = build_chain(robot)
    parameters = _parameters(chain, robot)
    texts = _with_starts(parameters.pop("strings"), strings)
    motors = joints_with_motor(robot)
    table = {
        **inputs(robot.joints),
        **outputs(chain, motors),
        **parameters,
        "strings": texts,
    }
    return {key: with_joint_names(block, robot) for key, block in table.items()}


def joints_with_motor(robot: Robot) -> list[int]:
    """Return the numbers of the joints that have a motor, from 1."""
    return [i for i, joint in enumerate(robot.joints, start=1) if joint.drive is not None]


def _with_starts(block: Block, strings: Mapping[str, str]) -> Block:
    """Return the strings with start values."""
    unknown = [name for name in strings if name not in {v.name for v in block.variables}]
    if unknown:
        raise ParameterError(f"start value: expected a string variable, got {unknown[0]!r}")
    started = tuple(replace(v, start=strings.get(v.name, v.start)) for v in block.variables)
    for v in started:
        if v.choices and v.start not in v.choices:
            raise ParameterError(
                f"{v.name}: expected one of {', '.join(v.choices)}, got {str(v.start)[:200]!r}"
            )
    return replace(block, variables=started)


def with_joint_names(block: Block, robot: Robot) -> Block:
    """Return a block whose variables have the names of the joints beside their numbers."""

    def name_of(match: re.Match[str]) -> str:
        # Files may name a joint by anything; what XML and a line of a log cannot hold is left out.
        words = " ".join(robot.joints[int(match[1]) - 1].name.split())
        return "".join(filter(str.isprintable, words))

    def with_name(match: re.Match[str]) -> str:
        name = name_of(match)
        return f"{match[0]} ({name})" if name else match[0]

    def described(variable: Variable) -> Variable:
        match = _OF_JOINT.search(variable.text)
        joint = "" if match is None else name_of(match)
        return replace(variable, text=_OF_JOINT.sub(with_name, variable.text), joint=joint)

    return replace(block, variables=tuple(map(described, block.variables)))


def _parameters(chain: Chain, robot: Robot) -> dict[str, Block]:
    parameters, names = Parameters.of(robot), chain.elastic_names
    motors = {i: joint.drive for i, joint in enumerate(robot.joints, start=1) if joint.drive}

    def tunable(*variables: Variable) -> Block:
        return Block("parameter", "tunable", variables)

    def elastic(key: str, unit: str, text: str, values: np.ndarray) -> list[Variable]:
        return [
            _positive(f"{name}.{key}", unit, f"{text} of {name}", float(value))
            for name, value in zip(names, values, strict=True)
        ]

    def choice(name: str, choices: Names, start: str) -> Variable:
        text = f"{', '.join(choices[:-1])} or {choices[-1]}"
        return Variable(name, "", text, start, choices=choices)

    backlash = elastic("backlash", "rad", "Half width of the backlash", parameters.backlash)
    slip = elastic("hysteresis", "N.m", "Slip torque of the hysteresis", parameters.hysteresis)
    friction = "Friction at rest of the motor of"
    trajectory = "CSV or NPZ file of the joint motion (time, q1.., qd1.., qdd1..); empty: q_cmd"
    tolerance = "Error allowed at the TCP over a path; 0: by the experiment's tolerance"
    return {
        "gravity": Block.of(
            "parameter",
            "tunable",
            group("gravity", "m/s2", "Gravity, base axes", along("gravity."), robot.gravity, 10.0),
        ),
        "stiffness": tunable(
            *elastic("stiffness", "N.m/rad", "Stiffness, above zero,", parameters.stiffness)
        ),
        "damping": tunable(*elastic("damping", "N.m.s/rad", "Damping", parameters.damping)),
        "backlash": tunable(*(backlash[k] for k in chain.torsions)),
        "hysteresis": tunable(*(slip[k] for k in chain.elements.gears)),
        "friction": tunable(
            *(
                _positive(
                    f"joint[{i}].friction",
                    "N.m",
                    f"{friction} joint[{i}], at the gear's output",
                    float(drive.friction),
                )
                for i, drive in motors.items()
            )
        ),
        "tolerance": Block(
            "parameter",
            "fixed",
            (Variable("tcp_tolerance", "m", tolerance, 0.0, minimum=0.0, nominal=TOLERANCE),),
        ),
        "strings": Block(
            "parameter",
            "fixed",
            (
                Variable("trajectory", "", trajectory, ""),
                choice("torque_curve", tuple(TORQUE_CURVES), TORQUE_CURVE_DEFAULT),
                choice("mode", MODES, MODES[0]),
                choice("initial_state", INITIAL_STATES, INITIAL_STATES[0]),
                choice("drive", DRIVES, DRIVES[0]),
            ),
        ),
    }


def _positive(name: str, unit: str, text: str, value: float) -> Variable:
    """Return a parameter that is not negative, and usually as large as at the start."""
    return Variable(name, unit, text, value, minimum=0.0, nominal=value or None)
