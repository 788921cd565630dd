"""A drive's equations and the least squares of its command (docs/inverse.md, 3), dense, on SciPy."""

import numpy as np
from scipy.integrate import trapezoid
from scipy.interpolate import BSpline

from coupling.inverse.fit import SMOOTHING, SplineFit
from coupling.inverse.gear_drive import GearDrive

# Points of half a step.
_POINTS = 801
# Weights of equations, and of a change of the command by itself.
_HEAVY, _IDLE = 1e4, 1e-7


def defects(drive: GearDrive, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
    """Impulses missing at all nodes but the last, as angles, for a drive whose path begins with it."""
    h, degree, task = drive.step, drive.layout.degree, drive.task
    knots = drive.cycle * np.arange(-degree, len(coefficients) + 1)
    command, nodes = BSpline(knots, coefficients, degree), h * np.arange(len(misses))
    missing = np.zeros(len(misses) - 1)
    for n in range(len(missing)):
        momentum = drive.inertia[n] / h * (misses[n + 1] - misses[n])
        halves = []
        for half in range(2):
            t = nodes[n] + 0.5 * h * (half + np.linspace(0.0, 1.0, _POINTS))
            outputs = task.errors.output_angle(command(t)[:, None])[:, 0]
            x = task.link.at(drive.start + t)[:, 0] - outputs + np.interp(t, nodes, misses)
            torque = task.curve.torque(x[:, None])[:, 0]
            given = task.damping * (x[-1] - x[0]) - drive.impulse[2 * n + half]
            halves.append(trapezoid(torque, t) + given)
        missing[n] += momentum + halves[0]
        if n + 1 < len(missing):
            missing[n + 1] += halves[1] - momentum
    (q,), rate = command(nodes[:1]), command(nodes[0], 1)
    slope = task.errors.slope(np.array([[q]]))[0, 0]
    missing[0] -= drive.inertia[0] * (slope * rate - drive.link_rate)
    return drive.scale * missing


def step(
    fit: SplineFit, coefficients: np.ndarray, misses: np.ndarray, damping: float
) -> np.ndarray:
    """The step of the linearised least squares, of all unknowns that are free."""
    layout, cycle = fit.drive.layout, fit.drive.cycle
    equations, errors = fit.equations(coefficients, misses)
    unit = np.eye(layout.size)
    bends = SMOOTHING / cycle**2 * np.diff(unit[layout.coefficient], 2, axis=0)
    bent = SMOOTHING * (np.diff(coefficients, 2) / cycle**2 - fit.drive.bend)
    still = np.sqrt(_IDLE) * unit[layout.coefficient]
    parts = [
        (_HEAVY * equations.toarray(), _HEAVY * errors),
        (unit[layout.miss], misses),
        (bends, bent),
        (damping * bends, 0.0 * bent),
        (still, np.zeros(len(still))),
    ]
    rows = np.vstack([part[0] for part in parts])[:, fit.free]
    found = np.zeros(layout.size)
    right = -np.concatenate([part[1] for part in parts])
    found[fit.free] = np.linalg.lstsq(rows, right, rcond=None)[0]
    return found
