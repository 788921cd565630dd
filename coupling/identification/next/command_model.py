"""Robot models that commands are computed for, and how fast the path may be learned with each of them.

A correction d of the tool's path goes through the inverse of the model, G_model^-1, and the robot makes
R d = G_true G_model^-1 d of it, so that (I - Q R) e is left of a deviation e after the next run
[Bristow2006].  Between the modes of model and robot R is large and against the correction.  A filter Q
that ends at a third of the lowest mode leaves next to nothing of it there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from coupling.errors import LearnError
from coupling.identification.next.history import History
from coupling.identification.next.options import NextOptions
from coupling.identification.runs.parameters import factors_between
from coupling.inverse.link_model import LinkModel
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Postures of the path at which modes are computed.
_POSTURES = 5
# Part of the lowest mode at which learning along the path ends at the latest.
_PART_OF_MODE = 1.0 / 3.0


@dataclass(frozen=True)
class CommandModel:
    """A robot model that a command is computed for.

    Attributes:
        name: Name, in words.
        x: Log factors of the parameters [1], (P,).
        run_count: Number of runs before its first command; 0 of the file's.
        lowest_mode: Lowest eigenfrequency on the path, gears on their flanks [Hz].
        has_parameters: Whether its parameters were learned.
    """

    name: str
    x: np.ndarray
    run_count: int
    lowest_mode: float
    has_parameters: bool

    @property
    def highest_cutoff(self) -> float:
        """Highest cutoff of learning along the path [Hz]."""
        return _PART_OF_MODE * self.lowest_mode


def file_model(history: History, options: NextOptions) -> CommandModel:
    """Return the robot of the file.

    Raises:
        LearnError: If a higher cutoff is asked for than one at which learning converges.
    """
    return _model(history, "of the robot file", 0, history.start, options)


def model_of_run(history: History, number: int, options: NextOptions) -> CommandModel:
    """Return the robot that a run was computed for; errors as of `file_model`."""
    x = history.factors_of(number)
    first = next(k for k in range(len(history.runs)) if _is_same(x, history.factors_of(k)))
    if _is_same(x, history.start):
        return file_model(history, options)
    return _model(history, f"of {history.runs[first].source.folder.name}", first, x, options)


def learned_model(history: History, robot: Robot, options: NextOptions) -> CommandModel:
    """Return the robot that was learned; errors as of `file_model`."""
    x = factors_between(history.parameters, robot)
    return _model(history, "learned now", len(history.runs), x, options)


def lowest_mode(robot: Robot, postures: np.ndarray) -> float:
    """Return the lowest eigenfrequency of a robot without damping [Hz]; infinite of a rigid one.

    Args:
        robot: The robot; its gears are on their flanks.
        postures: Joint angles [rad], (p, joints).
    """
    model, stiffness = LinkModel(robot), np.diag(Parameters.of(robot).stiffness)
    if not len(stiffness):
        return np.inf
    chain = model.chain
    theta = np.array([chain.theta(angles) for angles in postures])
    at_rest = np.zeros_like(theta)
    linear = model.desk.linearised(theta, at_rest, at_rest, np.zeros((len(theta), 6)))
    masses = linear.by_motion[:, 2][:, chain.elastic][:, :, chain.elastic]
    squares = [
        eigh(stiffness, mass, eigvals_only=True, subset_by_index=(0, 0))[0] for mass in masses
    ]
    return float(np.sqrt(min(squares)) / (2.0 * np.pi))


def _model(
    history: History, name: str, run_count: int, x: np.ndarray, options: NextOptions
) -> CommandModel:
    joints = history.runs[0].source.stored.joints.q[0]
    rows = np.linspace(0, len(joints) - 1, _POSTURES).astype(int)
    mode = lowest_mode(history.robot_at(x), joints[rows])
    model = CommandModel(name, x, run_count, mode, not _is_same(x, history.start))
    if options.cutoff is not None and options.cutoff > model.highest_cutoff:
        raise LearnError(
            f"--cutoff-Hz: expected at most {model.highest_cutoff:.2g} Hz, a third of the lowest"
            f" eigenfrequency of the robot on this path, got {options.cutoff:g} Hz: a deviation would"
            " grow from run to run at the robot's modes"
        )
    return model


def _is_same(x: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.allclose(x, other, rtol=0.0, atol=1e-9))
