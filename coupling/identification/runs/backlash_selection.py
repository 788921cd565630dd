"""Selection of backlash before a fit: gears that a run shows to be otherwise than their file says.

A fit knows backlash as factors of what it starts with, and no factor makes none of some or some of none.
So robots are simulated of which some gears have none, or all for which the file states none have a usual
one.  Which have none follows from derivatives c_k by the logarithm of each backlash: on a gear's flank
its wind-up is linear in it, and of a residual r a robot without that of some leaves r + sum of c_k.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from coupling.errors import SimulationError
from coupling.identification.runs.effect import ParameterEffect
from coupling.identification.runs.measurement import MeasuredPath
from coupling.identification.runs.slow_part import SlowPart
from coupling.robot.parameter_table import PARAMETER_KINDS
from coupling.robot.parameters import acting_parts, apply_values
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.description import Joint, Robot

# Half of the backlash that gears may have of which none is stated [rad]: half, one and two arc minutes.
_USUAL = (0.75e-4, 1.5e-4, 3e-4)
# Part of the rms that a robot must leave at most, without a backlash that its file states, as a file
# that is only wrong by 30 % leaves less than none, and with one of which the file says nothing.
_WITHOUT, _WITH = 0.5, 0.85


def select_backlashes(
    run: MeasuredPath, effect: ParameterEffect, robot: Robot, fmu: RobotFmu
) -> dict[str, float]:
    """Return backlashes with which a robot explains a run much better than with its file's, by name.

    Args:
        run: The measured run.
        effect: Effect of the parameters of the file's robot along it.
        robot: The robot of the file.
        fmu: FMU that simulates it.

    Returns:
        Those that differ from the file's [rad]; 0 of gears that have none.
    """
    time, slow = run.measured.time, SlowPart.of(run.measured.time)
    columns = slow(effect(np.zeros(len(effect.parameters)), time)[:, :3])
    columns = (columns - columns.mean(axis=0)).reshape(-1, len(effect.parameters))
    kinds = np.array([parameter.kind for parameter in effect.parameters])
    # A stiffness that is wrong moves the tool as well, and is fitted later.
    span = np.linalg.qr(columns[:, kinds == "stiffness"])[0]

    def unexplained(rows: np.ndarray) -> np.ndarray:
        unspanned: np.ndarray = rows - span @ (span.T @ rows)
        return unspanned

    def residual(values: dict[str, float]) -> np.ndarray:
        path = run.simulated(fmu, apply_values(robot, values))
        rows = slow(run.measured.position - path.position(time))
        return unexplained((rows - rows.mean(axis=0)).ravel())

    before = residual({})
    least = float(np.linalg.norm(before))
    names = [p.name for p in effect.parameters if p.kind == "backlash"]
    absent = _absent(names, before, unexplained(columns[:, kinds == "backlash"]))
    candidates = [(dict.fromkeys(absent, 0.0), _WITHOUT * least)] if absent else []
    unstated = _gears_without(robot, fmu)
    candidates += [(dict.fromkeys(unstated, b), _WITH * least) for b in _USUAL if unstated]
    best: dict[str, float] = {}
    for values, most in candidates:
        try:
            remaining = float(np.linalg.norm(residual(values)))
        except SimulationError:
            continue
        if remaining < min(least, most):
            best, least = values, remaining
    return best


def _absent(names: Sequence[str], residual: np.ndarray, columns: np.ndarray) -> list[str]:
    """Return the names of the backlashes without which least is expected to be left."""
    subsets = np.array([*product((0.0, 1.0), repeat=len(names))], dtype=float)
    squares = np.einsum("sk,kl,sl->s", subsets, columns.T @ columns, subsets)
    best = subsets[np.argmin(squares + 2.0 * subsets @ (columns.T @ residual))]
    return [name for name, is_absent in zip(names, best, strict=True) if is_absent]


def _gears_without(robot: Robot, fmu: RobotFmu) -> list[str]:
    """Return the names of the backlashes that would act and that the file does not state."""
    places = acting_parts(robot, fmu.torque_curve, fmu.drive, PARAMETER_KINDS["backlash"])
    return [
        f"{place}.backlash"
        for place, part in places
        if isinstance(part, Joint) and part.stiffness is not None and part.backlash == 0.0
    ]
