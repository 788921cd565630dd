"""Files of a run folder for `replay`, and what stands between their rows."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.interpolate import BPoly, CubicSpline

# Of the largest speed: below it a path counts as at rest at its end.
AT_REST = 0.05
# Points per row of a command at which its rates and accelerations are looked at.
DENSE = 10


def read_table(file: Path) -> dict[str, np.ndarray]:
    """Return the columns of a CSV file with a header line, by name."""
    with file.open(encoding="utf-8") as stream:
        names = [name.strip() for name in stream.readline().split(",")]
        rows = np.loadtxt(stream, delimiter=",", ndmin=2)
    return dict(zip(names, rows.T, strict=True))


def columns(table: Mapping[str, np.ndarray], names: tuple[str, ...]) -> np.ndarray:
    """Return some columns of a table side by side."""
    return np.column_stack([table[name] for name in names])


def path_between_samples(time: np.ndarray, position: np.ndarray) -> CubicSpline:
    """Return the C2 cubic spline, which stands still at an end where the path is at rest."""
    speed = np.linalg.norm(CubicSpline(time, position)(time[[0, -1]], 1), axis=1)
    largest = (np.linalg.norm(np.diff(position, axis=0), axis=1) / np.diff(time)).max()
    ends = tuple((1, np.zeros(3)) if end <= AT_REST * largest else "not-a-knot" for end in speed)
    return CubicSpline(time, position, bc_type=ends)


def command_spline(table: Mapping[str, np.ndarray]) -> CubicSpline | BPoly:
    """Return the motion that the rows of a command stand for, [rad] over [s], (joints,).

    Without rates the C2 cubic spline at rest at both ends; with them the quintic of Hermite, by its
    Bernstein coefficients q, q + h q'/5, q + 2 h q'/5 + h^2 q''/20 from either end.
    """
    count = sum(name[:1] == "q" and name[1:].isdigit() for name in table)
    q, *rates = (
        columns(table, tuple(f"{kind}{i + 1}" for i in range(count)))
        for kind in ("q", "qd", "qdd")
        if f"{kind}1" in table
    )
    time = table["time"]
    if not rates:
        return CubicSpline(time, q, bc_type="clamped")
    v, a = rates
    h = np.diff(time)[:, None]
    left = q[:-1], q[:-1] + h * v[:-1] / 5, q[:-1] + 2 * h * v[:-1] / 5 + h**2 * a[:-1] / 20
    right = q[1:] - 2 * h * v[1:] / 5 + h**2 * a[1:] / 20, q[1:] - h * v[1:] / 5, q[1:]
    return BPoly(np.stack([*left, *right]), time)


def command_figures(table: Mapping[str, np.ndarray]) -> dict[str, object]:
    """Return the largest acceleration of every drive [rad/s^2], between rows too."""
    motion, time = command_spline(table), table["time"]
    inside = np.arange(DENSE) / DENSE
    dense = np.append((time[:-1, None] + inside * np.diff(time)[:, None]).ravel(), time[-1])
    return {"max_acceleration_rad_s2": np.abs(motion(dense, 2)).max(axis=0).tolist()}
