"""Robots that runs are compared with, and those that are possible about each of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.identification.next.contraction import GAIN, Responses, chosen
from coupling.identification.next.history import History
from coupling.identification.next.options import NextOptions
from coupling.identification.runs.learning import Learned
from coupling.identification.runs.parameters import factors_between, prior_of
from coupling.results.next_result import Contraction
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot

# Robots that are possible, for the contraction; pairs on opposite sides, so that their mean is
# the robot itself.
_PAIRS = 8
# Postures of the path at which the robots' responses are compared.
_POSTURES = 5
# Standard deviation of the log factor of a damping that is not learned.
_DAMPING = 0.3


@dataclass(frozen=True)
class PossibleRobot:
    """A robot that runs are compared with.

    Attributes:
        name: Name, in words.
        x: Log factors of the parameters [1], (P,).
        since: Number of runs that it was fitted to; 0 of the file's.
        robots: Log factors of robots that are possible about it [1], (s, P).
        contraction: Filter and gain of learning along the path with it.
        left_over: Variance of what its fit left, by that of noise.
    """

    name: str
    x: np.ndarray
    since: int
    robots: np.ndarray
    contraction: Contraction
    left_over: float = 1.0


def file_model(history: History, options: NextOptions) -> PossibleRobot:
    """Return the robot of the file, and robots as far from it as is usual."""
    deviation = prior_of(history.parameters)
    robots = _possible(history.start, np.diag(deviation**2), options.seed)
    return _model(history, "of the robot file", 0, history.start, robots, options)


def commanded_model(history: History, number: int, options: NextOptions) -> PossibleRobot:
    """Return the robot that a run was computed for."""
    x, source = history.factors_of(number), history.runs[number].source
    if np.allclose(x, history.start, rtol=0.0, atol=1e-9):
        return file_model(history, options)
    first = next(
        k
        for k in range(len(history.runs))
        if np.allclose(x, history.factors_of(k), rtol=0.0, atol=1e-9)
    )
    names, forecast = [own.name for own in history.parameters], source.forecast
    if (
        forecast is not None
        and forecast.robots
        and all(set(own) == set(names) for own in forecast.robots)
    ):
        robots = np.log([[own[name] for name in names] for own in forecast.robots])
    else:
        robots = _possible(x, np.diag(prior_of(history.parameters) ** 2), options.seed)
    left_over = 1.0 if forecast is None else forecast.left_over
    name = f"of {history.runs[first].source.folder.name}"
    return _model(history, name, first, x, robots, options, left_over)


def learned_model(history: History, learned: Learned, options: NextOptions) -> PossibleRobot:
    """Return the robot that was learned, and robots as far from it as what was learned is unsure."""
    x = factors_between(history.parameters, learned.robot)
    count = len(x)
    covariance = learned.fit.covariance[:count, :count]
    own = np.sqrt(np.diag(covariance))
    scale = np.minimum(learned.spread.deviation, prior_of(history.parameters)) / own
    robots = _possible(x, scale[:, None] * covariance * scale, options.seed)
    left_over = learned.fit.left_over.over
    return _model(history, "learned now", len(history.runs), x, robots, options, left_over)


def _model(
    history: History,
    name: str,
    since: int,
    x: np.ndarray,
    robots: np.ndarray,
    options: NextOptions,
    left_over: float = 1.0,
) -> PossibleRobot:
    """Return a robot with the filter of learning along the path that goes with it."""
    source = history.runs[0].source
    robot = history.robot_at(x)
    stiffness, damping = _factors(history, robot, robots - x, options.seed)
    joints = source.stored.joints.q[0]
    rows = np.linspace(0, len(joints) - 1, _POSTURES).astype(int)
    responses = Responses.of(robot, joints[rows], stiffness, damping)
    contraction = chosen(responses, GAIN, options.cutoff)
    return PossibleRobot(name, x, since, robots, contraction, left_over)


def _factors(
    history: History, robot: Robot, logs: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return factors of stiffness and damping of robots by elastic coordinate, (s, m) each."""
    count = build_chain(robot).elastic_count
    drawn = np.random.default_rng(seed).standard_normal((len(logs), count)).clip(-2.0, 2.0)
    found = {"stiffness": np.zeros((len(logs), count)), "damping": _DAMPING * drawn}
    for k, own in enumerate(history.parameters):
        if own.kind in found:
            found[own.kind][:, own.coordinate] = logs[:, k]
    return np.exp(found["stiffness"]), np.exp(found["damping"])


def _possible(x: np.ndarray, covariance: np.ndarray, seed: int) -> np.ndarray:
    """Return log factors of robots that are possible, (2 pairs, P)."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    drawn = np.random.default_rng(seed).standard_normal((_PAIRS, len(x))).clip(-2.0, 2.0)
    off = (drawn * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    return np.concatenate([x + off, x - off])
