"""What a communication step costs: robot and process advanced side by side, against their coupling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.fmu.stepped import SteppedFmu
from coupling.fmu_export.system_structure import POSE_UNITS, SPRING_UNITS, WRENCH_UNITS
from coupling.path.histories import ToolPath
from coupling.path.length_text import format_um
from coupling.process.force_laws import ForceLaw

_UPPER = np.triu_indices(3)  # xx, xy, xz, yy, yz, zz


@dataclass(frozen=True)
class StepError:
    """Distance of a stepwise co-simulation from the converged coupling, along the path.

    Attributes:
        step: Communication step [s].
        largest, rms: Distance of the TCPs at the path's samples [m].
    """

    step: float
    largest: float
    rms: float

    def __str__(self) -> str:
        """Return it in words."""
        cost = f"up to {format_um(self.largest)} um, rms {format_um(self.rms)} um"
        return f"{1e3 * self.step:g} ms: {cost}"


def step_errors(
    robot: Path, law: ForceLaw, with_spring: bool, coupled: ToolPath, steps: Sequence[float]
) -> list[StepError]:
    """Return what communication steps cost [s].

    Args:
        robot: A native FMU of the robot, with its command and settings as start values.
        law: Force law of the process, base frame.
        with_spring: Whether the robot takes the process's contact spring as well.
        coupled: Path of the tool that is nearest to the truth, base frame.

    Raises:
        FmuError: If the FMU refuses a step.
    """
    return [_error(robot, law, with_spring, coupled, step) for step in steps]


def _error(
    robot: Path, law: ForceLaw, with_spring: bool, coupled: ToolPath, step: float
) -> StepError:
    time, (position,) = coupled.time, coupled.position
    instants, stepped = _step_path(robot, law, with_spring, time[0], time[-1], step)
    at_samples = [np.interp(time, instants, axis) for axis in stepped.T]
    distance = np.linalg.norm(np.transpose(at_samples) - position, axis=1)
    return StepError(step, float(distance.max()), float(np.sqrt(np.mean(distance**2))))


def _step_path(
    robot: Path, law: ForceLaw, with_spring: bool, start: float, stop: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the communication points [s], (n,), and the TCP's positions there [m], (n, 3).

    Both are advanced in parallel, as `process_slave` does the process.
    """
    instants = np.append(np.arange(start, stop - 1e-6 * step, step), stop)
    lengths = np.diff(instants)
    # Origin of the law at a step's start, at its end, and at the end of one more of its length.
    places = [law.place(instants[:-1] + ahead * lengths) for ahead in (0, 1, 2)]
    inputs = (*WRENCH_UNITS, *(SPRING_UNITS if with_spring else ()))
    with SteppedFmu(robot, inputs, tuple(POSE_UNITS), start=start) as fmu:
        position = fmu.read()[:3]
        first_answer = _answer(law, np.tile(places[0][0], (3, 1)), step, position)
        positions = [position]
        for length, *ahead in zip(lengths.tolist(), *places, strict=True):
            answer = _answer(law, np.array(ahead), length, position)
            position = fmu.step(first_answer[: len(inputs)], length)[:3]
            positions.append(position)
            first_answer = answer
    return instants, np.array(positions)


def _answer(law: ForceLaw, places: np.ndarray, step: float, position: np.ndarray) -> np.ndarray:
    """Return wrench and contact spring in the order of their variables, (18,)."""
    now, felt, after = places
    reaction = law.reaction_around(now[None], position[None])
    stiffness = reaction.stiffness[0][_UPPER]
    velocity = (after - felt) / step
    return np.concatenate(
        [reaction.force[0], np.zeros(3), position + felt - now, velocity, stiffness]
    )
