"""The command as written, replayed on robots that are not quite the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.path.deviation import Deviation, measure
from coupling.path.histories import WrenchHistory
from coupling.robot.cell import Cell
from coupling.robot.robot_fmu import ChangedRobot, RobotFmu
from coupling.solve.correction import Correction
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters


@dataclass(frozen=True)
class Variation:
    """Robots and a load that differ from the model, all robots and coordinates by the same factors.

    Attributes:
        name: What is other, in words.
        stiffness, damping, backlash: Factors of the parameters of all gears and tilts.
        force: Factor of the wrench.

    Example:
        >>> Variation("force +5 %", force=1.05).force
        1.05
    """

    name: str
    stiffness: float = 1.0
    damping: float = 1.0
    backlash: float = 1.0
    force: float = 1.0

    def parameters(self, robot: Robot, torque_curve: str) -> dict[str, float]:
        """Return the parameters of a robot's FMU that change, by name.

        What does not show is left out: the backlash of a linear gear, stiffness and backlash of a gear
        with a torque table of its own, and whatever is zero.
        """
        nominal, chain = Parameters.of(robot), build_chain(robot)
        tabled = np.array([table is not None for table in nominal.tables], dtype=bool)
        tabled &= torque_curve == "spline"
        shows = {
            "stiffness": ~tabled,
            "damping": np.ones(len(tabled), dtype=bool),
            "backlash": ~tabled & (torque_curve != "linear"),
        }
        changed: dict[str, float] = {}
        for key, rows in shows.items():
            values = getattr(self, key) * getattr(nominal, key)
            rows = rows & (values != getattr(nominal, key))
            changed |= {
                f"{chain.elastic_names[k]}.{key}": float(values[k]) for k in np.nonzero(rows)[0]
            }
        return changed


VARIATIONS = (
    Variation("stiffness +2 %", stiffness=1.02),
    Variation("stiffness -2 %", stiffness=0.98),
    Variation("damping -20 %", damping=0.8),
    Variation("backlash +20 %", backlash=1.2),
    Variation("backlash -20 %", backlash=0.8),
    Variation("force +5 %", force=1.05),
)


@dataclass(frozen=True)
class Replay:
    """What a command leaves on robots that differ from the model.

    Attributes:
        name: What is other, in words.
        deviation: Deviation from the desired paths, the worst figures of all tools.
        tools: Deviation of every tool.
    """

    name: str
    deviation: Deviation
    tools: tuple[Deviation, ...]


@dataclass(frozen=True)
class SimulatedModel:
    """A robot with the FMU that simulates it.

    Attributes:
        robot: Its description.
        torque_curve: Name of its gears' torque curve.
        fmu: Its FMU.
    """

    robot: Robot
    torque_curve: str
    fmu: RobotFmu


def replayed(cell: Cell, models: Sequence[SimulatedModel], found: Correction) -> tuple[Replay, ...]:
    """Replay a command as written, under the validation's wrench, on moving robots that differ.

    Args:
        cell: The robots.
        models: What simulates each of them, in their order.
        found: The command.

    Returns:
        A replay for each of `VARIATIONS`, but for those that change nothing.

    Raises:
        SimulationError: If a robot cannot be simulated.
    """
    replays = []
    loaded = found.answer.wrench
    for variation in VARIATIONS:
        changes = [variation.parameters(model.robot, model.torque_curve) for model in models]
        pushes = variation.force != 1.0 and bool(np.any(loaded.wrench))
        if not (any(changes) or pushes):
            continue
        wrench = WrenchHistory(loaded.time, variation.force * loaded.wrench)
        differing = _differing(cell, models, changes, variation.name)
        path = differing.simulate(found.joints, wrench, "dynamic")
        pairs = zip(path.tools, found.desired.tools, strict=True)
        tools = tuple(measure(own, desired) for own, desired in pairs)
        replays.append(Replay(variation.name, measure(path, found.desired), tools))
    return tuple(replays)


def _differing(
    cell: Cell,
    models: Sequence[SimulatedModel],
    changes: Sequence[Mapping[str, float]],
    what: str,
) -> Cell:
    """Return the cell with robots whose parameters are changed."""
    robots = zip(cell.members, models, changes, strict=True)
    return Cell(
        tuple(
            replace(member, robot=ChangedRobot(model.fmu, changed, what))
            for member, model, changed in robots
        )
    )
