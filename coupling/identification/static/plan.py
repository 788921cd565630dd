"""Which poses and loads to measure next: those that make the intervals' volume smallest.

Greedy choice, then exchanges, that raise det(M), M = sum_i A_i^T S_i^-1 A_i (D-optimal, Fedorov 1972,
docs/references.md), with parameters over their start values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.intervals import quantile
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.identification import require_no_hysteresis
from coupling.identification.static.measurements import MeasurementNoise, Measurements, whitening
from coupling.identification.static.prediction import rigid_prediction
from coupling.run.sobol import sobol
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.kinematics import base_from_tool

# What is known of a parameter before anything is measured: a factor of a million either way.
_NOTHING_KNOWN = 1e-12
_MOST_EXCHANGES = 20
# A gain of log det(M) below this is none.
_GAIN = 1e-9


@dataclass(frozen=True)
class PlanRequest:
    """What to plan.

    Attributes:
        count: Number of measurements.
        force: Size of the load [N].
        down: Whether loads are weights, along gravity; else along the base axes and between them.
        lowest: Least height of the TCP over the base frame's origin [m], or None.
        position, force_deviation: Standard deviations of deflection [m] and load [N].
        poses: Number of candidate poses.
        seed: Seed of the candidate poses.
    """

    count: int = 20
    force: float = 500.0
    down: bool = False
    lowest: float | None = None
    position: float = 2e-5
    force_deviation: float = 5.0
    poses: int = 256
    seed: int = 1


@dataclass(frozen=True)
class ExpectedInterval:
    """A parameter and the 95 % interval to expect, if its start value is right.

    Attributes:
        name: Name in the FMU.
        start: Start value [N m/rad or rad].
        before, after: Half width of the interval of its compliance or backlash over the value, without
            and with the planned measurements; infinite where nothing identifies it.
    """

    name: str
    start: float
    before: float
    after: float


@dataclass(frozen=True)
class MeasurementPlan:
    """Planned measurements.

    Attributes:
        measurements: Poses and loads; deflections are those that the start file predicts.
        expected: Intervals to expect.
    """

    measurements: Measurements
    expected: tuple[ExpectedInterval, ...]


def planned(
    robot: Robot,
    torque_curve: str,
    wish: PlanRequest,
    earlier: tuple[Measurements, MeasurementNoise] | None = None,
) -> MeasurementPlan:
    """Choose poses and loads.

    Args:
        robot: The start, with limits of its joints; +-180 degrees where it has none.
        torque_curve: A name of `TORQUE_CURVES`.
        wish: Number and kind of the measurements.
        earlier: Measurements that there are, and their noise.

    Raises:
        IdentifyError: If no candidate is high enough, or the robot is rigid.
    """
    require_no_hysteresis(robot)
    elasticity = ElasticParameters.of(robot, torque_curve)
    if not elasticity.names:
        raise IdentifyError(f"{robot.name}: expected an elastic joint or tilt, got a rigid robot")
    candidates = _candidates(robot, wish)
    noise = _noise(candidates.count, wish)
    rows = _information_rows(elasticity, candidates, noise)
    prior = _NOTHING_KNOWN * np.eye(len(elasticity.names))
    old = np.zeros_like(prior)
    if earlier is not None:
        earlier_rows = _information_rows(elasticity, *earlier).reshape(-1, len(elasticity.names))
        old = earlier_rows.T @ earlier_rows
    chosen = _exchanged(rows, _greedy(rows, prior + old, wish.count), prior + old)
    new = np.einsum("krp,krq->pq", rows[chosen], rows[chosen])
    numbers = 0 if earlier is None else earlier[0].deflection.size
    before = _halves(prior + old, numbers)
    after = _halves(prior + old + new, numbers + 3 * wish.count)
    start = elasticity.in_units(elasticity.start)
    expected = [
        ExpectedInterval(name, float(value), float(first), float(last))
        for name, value, first, last in zip(elasticity.names, start, before, after, strict=True)
    ]
    best = Measurements.of(
        candidates.q[chosen],
        candidates.wrench[chosen],
        rigid_prediction(elasticity, candidates, elasticity.start).deflection[chosen],
    )
    return MeasurementPlan(best, tuple(expected))


def _candidates(robot: Robot, wish: PlanRequest) -> Measurements:
    """Return every direction of the load at every candidate pose."""
    limits = np.array([joint.limits or (-np.pi, np.pi) for joint in robot.joints])
    power = max(int(np.ceil(np.log2(max(wish.poses, 2)))), 1)
    shares = sobol(2**power, len(limits), wish.seed)
    poses = limits[:, 0] + shares * (limits[:, 1] - limits[:, 0])
    if wish.lowest is not None:
        chain = build_chain(robot)
        data = chain.model.createData()
        height = [base_from_tool(chain, data, chain.theta(q)).translation[2] for q in poses]
        poses = poses[np.array(height) >= wish.lowest]
        if len(poses) == 0:
            raise IdentifyError(
                f"lowest point: expected poses above {wish.lowest:g} m within the joints' limits, got"
                " none"
            )
    ways = _directions(robot, wish.down)
    q = np.repeat(poses, len(ways), axis=0)
    wrench = np.zeros((len(q), 6))
    wrench[:, :3] = wish.force * np.tile(ways, (len(poses), 1))
    return Measurements.of(q, wrench, np.zeros((len(q), 3)))


def _directions(robot: Robot, down: bool) -> np.ndarray:
    if down:
        gravity = np.array(robot.gravity)
        length = np.linalg.norm(gravity)
        return (gravity / length if length > 0.0 else np.array([0.0, 0.0, -1.0]))[None]
    axes = np.vstack([np.eye(3), -np.eye(3)])
    corners = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T / np.sqrt(3.0)
    return np.vstack([axes, corners])


def _noise(count: int, wish: PlanRequest) -> MeasurementNoise:
    wrench = np.repeat([wish.force_deviation, 0.0], 3)
    return MeasurementNoise(
        np.full((count, 3), wish.position), np.tile(wrench, (count, 1)), is_known=True
    )


def _information_rows(
    elasticity: ElasticParameters, measured: Measurements, noise: MeasurementNoise
) -> np.ndarray:
    """Return whitened columns over the start values, (k, r, P)."""
    prediction = rigid_prediction(elasticity, measured, elasticity.start)
    rows: np.ndarray = whitening(noise, prediction.by_wrench) @ prediction.by_parameter
    return rows * elasticity.start


def _gains(rows: np.ndarray, information: np.ndarray) -> np.ndarray:
    """Return by how much each candidate raises log det(M), (k,)."""
    inside = rows @ np.linalg.inv(information) @ rows.swapaxes(1, 2)
    return np.linalg.slogdet(np.eye(rows.shape[1]) + inside)[1]


def _greedy(rows: np.ndarray, information: np.ndarray, count: int) -> list[int]:
    chosen: list[int] = []
    for _ in range(count):
        best = int(np.argmax(_gains(rows, information)))
        chosen.append(best)
        information = information + rows[best].T @ rows[best]
    return chosen


def _exchanged(rows: np.ndarray, chosen: Sequence[int], prior: np.ndarray) -> list[int]:
    """Return the choice after exchanging single rows as long as one is better."""
    chosen = list(chosen)
    information = prior + np.einsum("krp,krq->pq", rows[chosen], rows[chosen])
    for _ in range(_MOST_EXCHANGES):
        better = False
        for place, old in enumerate(chosen):
            without = information - rows[old].T @ rows[old]
            gains = _gains(rows, without)
            best = int(np.argmax(gains))
            if gains[best] > gains[old] + _GAIN:
                chosen[place], better = best, True
                information = without + rows[best].T @ rows[best]
        if not better:
            break
    return chosen


def _halves(information: np.ndarray, numbers: int) -> np.ndarray:
    """Return half widths of 95 % intervals over the values; infinite where nothing is known, (P,)."""
    deviation = np.sqrt(np.diag(np.linalg.inv(information)))
    freedom = numbers - len(information)
    if freedom <= 0:
        return np.full(len(information), np.inf)
    half: np.ndarray = quantile(freedom) * deviation
    return np.where(half > 1e-2 / np.sqrt(_NOTHING_KNOWN), np.inf, half)
