"""elastic-robot modes: the modes of a case's robot along its path, or of a robot in a posture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import elastic_robot
from coupling.case.case import Case, PlacedRobot
from coupling.errors import StabilityError
from coupling.modes.case_places import CasePlaces, places_of
from coupling.modes.locked_robot import LockedRobot
from coupling.modes.measured_response import MeasuredResponse, within
from coupling.modes.part_grid import PartGrid
from coupling.modes.posture_modes import PostureModes
from coupling.results.base import finite
from coupling.results.modes_result import (
    Matrix,
    ModeResult,
    ModesResult,
    PartModesResult,
    PlaceModesResult,
)
from coupling.results.run_result import three
from elastic_robot.description import Robot

# Places along a path that are looked at.
_PLACES = 40
# Places along each side of the part's map.
_GRID = 9
_AXES = "xyz"


@dataclass(frozen=True)
class ModesAnalysis:
    """What was looked at."""

    softest: PostureModes
    result: ModesResult


def modes_in_posture(
    robot: Robot,
    torque_curve: str,
    q: np.ndarray,
    wrench: np.ndarray,
    measured: Sequence[MeasuredResponse] = (),
) -> ModesAnalysis:
    """Return the modes of a robot in a posture.

    Args:
        q: Angles of its drives [rad], (joints,).
        wrench: Wrench on the tool, base axes [N, N m], (6,).

    Raises:
        StabilityError: If it has no equilibrium there, or another number of joints.
    """
    if len(q) != len(robot.joints):
        raise StabilityError(
            f"posture: expected {len(robot.joints)} angles, one for each joint of {robot.name}, got"
            f" {len(q)}"
        )
    modes = PostureModes.of(LockedRobot(robot, torque_curve), q, wrench)
    loads = "its own weight" + (" and the force given" if np.any(wrench) else "")
    place = _place(modes, None)
    return ModesAnalysis(
        modes, _result(robot, robot.name, torque_curve, loads, modes, [place], measured)
    )


def places_in_brief(case: Case) -> list[PlaceModesResult]:
    """Return the modes along a case's path, where the TCP is softest first."""
    return _softest_first(*_along(case.robots[0], places_of(case)))


def modes_of_case(
    case: Case, measured: Sequence[MeasuredResponse] = (), number: int = 0
) -> ModesAnalysis:
    """Return the modes of a case's robot along its path, where it is softest first, and over the part.

    Args:
        number: Number of the robot, from 0; the other one of a cell is as if it were rigid.
    """
    placed, places = case.robots[number], places_of(case, number)
    time, modes = _along(placed, places)
    softest = _softest(modes)
    entries = _softest_first(time, modes)
    result = _result(
        placed.description,
        case.title,
        placed.torque_curve,
        places.loads,
        modes[softest],
        entries,
        measured,
    )
    in_base = placed.world_from_base.inverse() @ case.task.part
    grid = PartGrid.around(placed.description, in_base, places.path, places.q, _GRID)
    over_part = _over_part(
        LockedRobot(placed.description, placed.torque_curve), grid, modes[softest]
    )
    return ModesAnalysis(modes[softest], result.model_copy(update={"part": over_part}))


def _along(placed: PlacedRobot, places: CasePlaces) -> tuple[np.ndarray, list[PostureModes]]:
    """Return times along a path [s], (n,), and the modes there."""
    rows = places.spread(_PLACES)
    locked = LockedRobot(placed.description, placed.torque_curve)
    return places.time[rows], list(places.modes(locked, rows))


def _softest(modes: Sequence[PostureModes]) -> int:
    return int(np.argmax([_softness(posture) for posture in modes]))


def _softest_first(time: np.ndarray, modes: Sequence[PostureModes]) -> list[PlaceModesResult]:
    """Return the figures of places along a path, where the TCP is softest before the others."""
    softest = _softest(modes)
    order = [softest, *(k for k in range(len(modes)) if k != softest)]
    return [_place(modes[k], float(time[k])) for k in order]


def _softness(modes: PostureModes) -> float:
    compliance = modes.compliance
    return 0.0 if compliance is None else modes.softest(compliance)[0]


def _result(
    robot: Robot,
    name: str,
    torque_curve: str,
    loads: str,
    modes: PostureModes,
    places: Sequence[PlaceModesResult],
    measured: Sequence[MeasuredResponse],
) -> ModesResult:
    frequency = modes.response_frequencies
    if measured:
        low, high = within(measured)
        inside = (frequency > 0.5 * low) & (frequency < 2.0 * high)
        frequency = np.unique(np.append(frequency[inside], np.geomspace(low, high, 400)))
    response = modes.response(frequency)
    pairs = dict.fromkeys([*(2 * axis for axis in _AXES), *(m.name for m in measured)])
    computed = [
        MeasuredResponse(pair, frequency, response[:, i, j]).stored
        for pair in pairs
        for i, j in [(_AXES.index(pair[0]), _AXES.index(pair[1]))]
    ]
    return ModesResult(
        name=name,
        robot=robot.name,
        torque_curve=torque_curve,
        loads=loads,
        places=tuple(places),
        computed=tuple(computed),
        measured=tuple(each.stored for each in measured),
        version=elastic_robot.__version__,
    )


def _matrix(values: np.ndarray) -> Matrix:
    first, second, third = map(three, values)
    return first, second, third


def _place(modes: PostureModes, time: float | None) -> PlaceModesResult:
    compliance, in_contact = modes.compliance, modes.compliance_in_contact
    softest = None if compliance is None else modes.softest(compliance)
    size, frequency = modes.peak
    energy = modes.energy
    return PlaceModesResult(
        time_s=time,
        posture_deg=tuple(np.rad2deg(modes.q).round(6).tolist()),
        unloaded_joints=modes.unloaded,
        force_N=tuple(modes.wrench[:3].tolist()),
        compliance_m_N=None if compliance is None else _matrix(compliance),
        softest_m_N=None if softest is None else softest[0],
        softest_direction=None if softest is None else tuple(softest[1].tolist()),
        in_contact_m_N=None if in_contact is None else modes.softest(in_contact)[0],
        dynamic_m_N=finite(size),
        dynamic_Hz=frequency,
        modes=tuple(
            ModeResult(
                frequency_Hz=float(f),
                damping_ratio=float(zeta),
                tcp_direction=tuple(direction.tolist()),
                energy_by_joint=tuple(shares.tolist()),
            )
            for f, zeta, direction, shares in zip(
                modes.frequency, modes.damping_ratio, modes.tcp, energy, strict=True
            )
        ),
    )


def _over_part(locked: LockedRobot, grid: PartGrid, softest: PostureModes) -> PartModesResult:
    """Return softness and lowest mode over the part, under the wrench of the softest place."""
    rows: dict[str, list[tuple[float | None, ...]]] = {"softest": [], "lowest": []}
    for line in grid.q:
        pairs = [_at(locked, q, softest.wrench) for q in line]
        rows["softest"].append(tuple(pair[0] for pair in pairs))
        rows["lowest"].append(tuple(pair[1] for pair in pairs))
    return PartModesResult(
        x_m=tuple(grid.x.tolist()),
        y_m=tuple(grid.y.tolist()),
        softest_m_N=tuple(rows["softest"]),
        lowest_Hz=tuple(rows["lowest"]),
    )


def _at(
    locked: LockedRobot, q: np.ndarray, wrench: np.ndarray
) -> tuple[float | None, float | None]:
    if not np.isfinite(q).all():
        return None, None
    try:
        modes = PostureModes.of(locked, q, wrench)
    except StabilityError:
        return None, None
    lowest = float(modes.frequency[0]) if len(modes.frequency) else None
    return (None if modes.unloaded else _softness(modes)), lowest
