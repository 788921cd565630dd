"""Values that are legal in a case or an answer but out of what is usual: a remark, not an error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.case.case import Case, PlacedRobot
from coupling.files.sources import Number
from coupling.path.histories import WrenchHistory
from coupling.process import NoisySchema
from coupling.run.cut_figures import cut_result, cut_warnings, material_remark
from coupling.run.quantities import quantities_of_case, quantities_of_file, quantities_of_robot
from coupling.toolpaths.tilt import APPROACH
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL

# Share of a mean force along the tool's approach from which on it is remarked: within 60 degrees of it.
_PULL = 0.5


def remarks(case: Case, wrench: WrenchHistory | None = None) -> tuple[str, ...]:
    """Return a sentence for each value that is out of what is usual.

    Args:
        wrench: Response of the process; None where it was not evaluated.
    """
    cut = cut_result(case)
    texts = [
        text for quantity in quantities_of_case(case, cut, wrench) if (text := quantity.remark)
    ]
    texts += [] if cut is None else cut_warnings(case, cut)
    texts += material_remark(case)
    stated = case.resolved["process"].get("stiffness_N_m") == 0.0
    if wrench is not None and wrench.peak_force == 0.0 and not stated:
        texts.append(
            "process: expected a force along the path, got 0 N everywhere: check that the path is in"
            " contact with the part, and its frame and units"
        )
    if wrench is not None:
        texts += _of_pulling_forces(case, wrench)
    for placed in case.robots:
        texts += [f"robot {placed.description.name}: {text}" for text in placed.provenance.remarks]
        texts += unsure_stiffness(placed)
        texts += _upward_gravity(placed.description, placed.world_from_base.rotation)
        texts += _home_beyond_limits(placed)
    # Drives first: whether they follow exactly decides every figure.
    return tuple(dict.fromkeys((*_of_ideal_drives(case), *texts, *_of_rigid_robots(case))))


def _of_pulling_forces(case: Case, wrench: WrenchHistory) -> Iterator[str]:
    """Yield a sentence for each tool that a user's own process or record pulls into the part.

    A part pushes a forming tool off.  Helical mills are pulled along their axis as well, but by less
    than what pushes them sideways.
    """
    if not isinstance(case.process_table, NoisySchema):
        return
    forces = wrench.at(case.desired.time)[..., :3]
    for placed, path, force in zip(case.robots, case.desired.tools, forces, strict=True):
        force = _without_peaks(force)
        size = float(np.linalg.norm(force, axis=1).mean())
        pull = float(np.sum(force * path.rotations[0].apply(APPROACH), axis=1).mean())
        if size > 0.0 and pull > _PULL * size:
            yield (
                f"robot {placed.description.name}: expected a force that pushes the tool off the part,"
                f" got one that pulls it into the part (mean along its approach {pull:.3g} N, mean"
                f" magnitude {size:.3g} N): check the frame, and the sign, which is that of the force on"
                " the tool, not on the part or the sensor"
            )


def _without_peaks(force: np.ndarray) -> np.ndarray:
    """Return forces [N], (n, 3), none longer than twice the median of those that are there.

    A wrong sign lets many an iteration diverge, to a few forces of any direction that outweigh others.
    """
    size = np.linalg.norm(force, axis=1, keepdims=True)
    longest = 2.0 * np.median(size[size > 0.0]) if np.any(size) else 1.0
    shortened: np.ndarray = force * longest / np.maximum(size, longest)
    return shortened


def _of_rigid_robots(case: Case) -> Iterator[str]:
    for robot in case.robots:
        if robot.description.is_rigid:
            yield (
                f"robot {robot.description.name}: no joint is elastic, so that its deviation is zero"
                " under any force: add stiffness and damping under [[joint]] of its file"
            )


def _home_beyond_limits(placed: PlacedRobot) -> Iterator[str]:
    """Yield a sentence for each joint whose angle at home is one that it cannot take."""
    for number, (joint, angle) in enumerate(
        zip(placed.description.joints, np.rad2deg(placed.home).tolist(), strict=True), start=1
    ):
        low, high = (-np.inf, np.inf) if joint.limits is None else np.rad2deg(joint.limits).tolist()
        if not low <= angle <= high:
            yield (
                f"robot {placed.description.name}: home_deg of joint {number}: expected {low:.4g} to"
                f" {high:.4g} deg, its limits, got {angle:.4g}: give [{placed.table}] another"
                " home posture"
            )


def unsure_stiffness(placed: PlacedRobot) -> list[str]:
    """Return a sentence where the stiffness of a robot's gears is known as a range, or none."""
    whole = placed.provenance.stiffness_range
    if whole is None:
        return []
    return [
        f"robot {placed.description.name}: the stiffness of {len(placed.provenance.stiffness_ranges)}"
        f" gears is known as a range ({whole[0]:.0f} to {whole[1]:.0f} N m/rad): more measurements of"
        " this robot narrow it (elastic-robot identify)"
    ]


def remarks_on_robot(robot: Robot, numbers: Sequence[Number] = ()) -> list[str]:
    """Return a sentence for each value of a robot that is out of what is usual."""
    quantities = (*quantities_of_robot(robot), *quantities_of_file(robot.name, numbers))
    said = [text for quantity in quantities if (text := quantity.remark)]
    return [*said, *_upward_gravity(robot, Rotation.identity())]


def _upward_gravity(robot: Robot, world_from_base: Rotation) -> list[str]:
    """Return a sentence where gravity pulls a robot upward in the world, or none."""
    gravity = world_from_base.apply(robot.gravity)
    if gravity[2] <= 0.5 * np.linalg.norm(gravity):
        return []
    return [
        f"robot {robot.name}: gravity: expected one that points down in the world, got"
        f" {gravity[2]:.4g} m/s2 along z: change its sign; a robot that hangs has base_rpy_deg"
    ]


def _of_ideal_drives(case: Case) -> Iterator[str]:
    """Yield a sentence for each robot whose motors move nowhere, neither in the model nor the plant."""
    plant = [None] * len(case.robots) if case.plant is None else case.plant.robots
    for robot, difference in zip(case.robots, plant, strict=True):
        motors = any(joint.drive for joint in robot.description.joints)
        if motors and robot.drive == IDEAL and (difference is None or difference.drive == IDEAL):
            confirmed = robot.provenance.servos_confirmed
            why = "" if confirmed else " as measurements do not confirm the servos of its file"
            yield (
                f"robot {robot.description.name}: its drives are ideal{why}, all figures are without"
                f' following error and friction: drive = "servo" in [{robot.table}] computes the command'
                " of its servos"
            )
