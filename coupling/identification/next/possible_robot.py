"""Robots that runs are compared with, and those that are possible about each of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.identification.next.contraction import GAIN, Responses, chosen
from coupling.identification.next.history import History
from coupling.identification.next.options import NextOptions
from coupling.identification.runs.learning import Learned
from coupling.identification.runs.parameters import factors_between, prior_of
from coupling.identification.runs.residual import UnexplainedPart
from coupling.results.next_result import Contraction
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot

# Robots that are possible, for contraction and forecast; pairs on opposite sides, so that their mean is
# the robot itself.
_PAIRS = 8
# Postures of the path at which the robots' responses are compared.
_POSTURES = 5
# Standard deviation of the log factor of a damping that is not learned.
_DAMPING = 0.3
# How far towards a robot that is possible another one is looked for; how much less likely it may be,
# by what the parameters of a fit are off in the mean.
_SCALES, _LIKELY = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.06), 2.0


@dataclass(frozen=True)
class PossibleRobot:
    """A robot that runs are compared with.

    Attributes:
        name: Name, in words.
        x: Log factors of the parameters [1], (P,).
        since: Number of runs that it was fitted to; 0 of the file's.
        robots: Log factors of robots that are possible about it [1], (s, P).
        scales: Shares of the way towards each of them of robots that do in the runs what this one
            does, (s,).
        contraction: Filter and gain of learning along the path with it.
        left_over: Variance of what its fit left, by that of noise.
    """

    name: str
    x: np.ndarray
    since: int
    robots: np.ndarray
    scales: np.ndarray
    contraction: Contraction
    left_over: float = 1.0

    @property
    def close(self) -> np.ndarray:
        """Log factors of possible robots that do in the runs what this one does [1], (s, P)."""
        near: np.ndarray = self.x + self.scales[:, None] * (self.robots - self.x)
        return near


def file_model(history: History, options: NextOptions) -> PossibleRobot:
    """Return the robot of the file, and robots as far from it as is usual."""
    deviation = prior_of(history.parameters)
    robots = _possible(history.start, np.diag(deviation**2), options.seed)
    return _model(history, "of the robot file", 0, history.start, robots, (), options)


def earlier_models(history: History, options: NextOptions) -> list[PossibleRobot]:
    """Return the robots of the runs that were computed for another one than the file's."""
    found: list[PossibleRobot] = []
    for number, run in enumerate(history.runs):
        x = history.factors_of(number)
        known = [history.start, *(own.x for own in found)]
        if any(np.allclose(x, own, rtol=0.0, atol=1e-9) for own in known):
            continue
        names = [own.name for own in history.parameters]
        forecast, scales = run.source.forecast, tuple[float, ...]()
        if forecast is not None and all(set(own) == set(names) for own in forecast.robots):
            robots = np.log([[own[name] for name in names] for own in forecast.robots])
            scales = forecast.scales
        else:
            robots = _possible(x, np.diag(prior_of(history.parameters) ** 2), options.seed)
        name = f"of {run.source.folder.name}"
        own = _model(history, name, number, x, robots, scales, options)
        found.append(own if forecast is None else replace(own, left_over=forecast.left_over))
    return found


def learned_model(history: History, learned: Learned, options: NextOptions) -> PossibleRobot:
    """Return the robot that was learned, and robots as far from it as what was learned is unsure."""
    x = factors_between(history.parameters, learned.robot)
    count = len(x)
    covariance = learned.fit.covariance[:count, :count]
    own = np.sqrt(np.diag(covariance))
    scale = np.minimum(learned.spread.deviation, prior_of(history.parameters)) / own
    robots = _possible(x, scale[:, None] * covariance * scale, options.seed)
    scales = _scales(history, x, robots, learned.fit.left_over)
    found = _model(history, "learned now", len(history.runs), x, robots, scales, options)
    return replace(found, left_over=learned.fit.left_over.over)


def _scales(
    history: History, x: np.ndarray, robots: np.ndarray, left: UnexplainedPart
) -> tuple[float, ...]:
    """Return how far towards each robot what it does in the runs stays as likely as its parameters.

    Parameters that are as far off as their covariance says change the runs by as much as noise moves a
    fit, which is P / n of its variance in each of n samples.  Where a gear crosses its backlash at
    another time they change them by more: the covariance, a matter of small changes, does not know that.
    """
    every = range(len(history.runs))
    samples = sum(len(history.runs[number].measured.time) for number in every)
    squares = sum(history.runs[number].noise ** 2 for number in every) / len(every)
    most = _LIKELY * left.effective * left.over * squares / samples
    found = []
    for own in robots:
        scale = next((c for c in _SCALES if _change(history, x, x + c * (own - x)) <= most), 0.0)
        found.append(scale)
    return tuple(found)


def _change(history: History, x: np.ndarray, other: np.ndarray) -> float:
    """Return the mean square of what another robot does else in the runs, by coordinate [m^2].

    A shift and a turn of the whole is the measuring frame's.
    """
    squares, count = 0.0, 0
    for number, run in enumerate(history.runs):
        place, moved = (
            history.simulated(number, own).position(run.measured.time) for own in (x, other)
        )
        arm = place - place.mean(axis=0)
        turned = np.cross(np.eye(3)[:, None], arm[None]).transpose(1, 2, 0).reshape(-1, 3)
        shifted = np.tile(np.eye(3), (len(arm), 1))
        columns, off = np.hstack([shifted, turned]), (moved - place).reshape(-1)
        rest = off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0]
        squares, count = squares + float(rest @ rest), count + len(rest)
    return squares / count


def _model(
    history: History,
    name: str,
    since: int,
    x: np.ndarray,
    robots: np.ndarray,
    scales: tuple[float, ...],
    options: NextOptions,
) -> PossibleRobot:
    """Return a robot with the filter of learning along the path that goes with it."""
    source = history.runs[0].source
    robot = history.robot_at(x)
    stiffness, damping = _factors(history, robot, robots - x, options.seed)
    joints = source.stored.joints.q[0]
    rows = np.linspace(0, len(joints) - 1, _POSTURES).astype(int)
    responses = Responses.of(robot, joints[rows], stiffness, damping)
    near = np.array(scales) if scales else np.ones(len(robots))
    return PossibleRobot(name, x, since, robots, near, chosen(responses, GAIN, options.cutoff))


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
