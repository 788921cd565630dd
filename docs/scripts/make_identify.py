"""Write the tables of docs/identify.md: make identify.

The FANUC R-2000iC's measurements, 200 repetitions of 30 noisy measurements by MuJoCo;
with names, only those parts: python docs/scripts/make_identify.py coverage.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.intervals import intervals
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.fit import IdentifyOptions, fit_static
from coupling.identification.static.identification import identify
from coupling.identification.static.measurements import (
    Measurements,
    noise_of,
    read_measurements,
    rms,
)
from coupling.results.identified_result import IdentifiedResult
from docs.scripts.experiment import Page
from docs.scripts.page import table
from examples.mujoco_robot.measuring import measured

EXAMPLES = Path(__file__).parents[2] / "examples" / "identify"
REPETITIONS, ROWS = 200, 30
PAGE = Page("identify")
POSITION, FORCE = 2e-5, 5.0  # [m, N], standard deviations


@cache
def measurements() -> Measurements:
    """Return the FANUC's 43 measured deflections."""
    return read_measurements(EXAMPLES / "fanuc_r2000ic.csv", 6)


@cache
def identified(*add: str) -> IdentifiedResult:
    """Return what they say of its joints, and of parameters that are added to them."""
    start = load_robot(EXAMPLES / "fanuc_start.toml")
    options = IdentifyOptions(noise_of(measurements()), add=add)
    return identify(start, measurements(), options).result


@PAGE.part
def fanuc() -> str:
    """Return what 43 measured deflections say."""
    data, axial, tilted = measurements(), identified(), identified("supported")
    head = (
        f"{data.count} loads, data {1e3 * rms(data.deflection):.3f} mm rms",
        *("fit", "left out", "worst left out", "K1 .. K6 [kN m/rad]", "condition"),
    )
    rows = [
        ("six joints", *_sizes(axial)),
        ("and the tilt of joint 3 about z of its body", *_sizes(tilted)),
        ("published stiffness, no tilt", _mm(axial.rms_m.start), "", "", "", ""),
    ]
    (tilt,) = [p for p in tilted.parameters if p.added]
    assert tilt.support is not None
    return f"{table(head, rows)}\n\nThe tilt: {tilt.support.in_words}."


@PAGE.part
def coverage() -> str:
    """Return how often intervals hold the truth."""
    head = ("robot", "parameters", "identified in", "inside their interval", "median half width")
    robots = enumerate(("fanuc_r2000ic", "icme2008"), 1)
    return table(head, [_coverage(name, seed) for seed, name in robots])


def _coverage(name: str, seed: int) -> tuple[str, ...]:
    """Return the row of a robot that MuJoCo measures."""
    rng, true = np.random.default_rng(seed), load_robot(find_robot(name))
    right = ElasticParameters.of(true, "backlash")
    ways = rng.normal(size=(ROWS, 3))
    wrench = np.zeros((ROWS, 6))
    wrench[:, :3] = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    wrench *= rng.uniform(500.0, 1000.0, (ROWS, 1))
    points = [np.tile(rng.uniform(-0.2, 0.2, 3), (ROWS, 1)) for _ in range(2)]
    exact = measured(true, rng.uniform(-1.2, 1.2, (ROWS, len(true.joints))), wrench, points)
    first = right.described(right.start * rng.uniform(0.6, 1.6, len(right.start)))
    start = ElasticParameters.of(first, "backlash")
    inside, identified, halves = [], [], []
    for _ in range(REPETITIONS):
        forces = exact.wrench.copy()
        forces[:, :3] += FORCE * rng.normal(size=(ROWS, 3))
        noise = POSITION * rng.normal(size=exact.deflection.shape)
        rows = replace(exact, deflection=exact.deflection + noise, wrench=forces)
        noise_given = noise_of(rows, POSITION, None, FORCE, None)
        fit = fit_static(start, rows, IdentifyOptions(noise_given))
        sure = intervals(fit.experiment.linear, fit.experiment.weight, fit.x, is_noise_known=True)
        inside.append((sure.low <= right.start) & (right.start <= sure.high))
        identified.append((sure.low > 0.0) & np.isfinite(sure.high) & fit.converged)
        halves.append((sure.high - sure.low) / 2.0 / right.start)
    shares, often = np.mean(inside, axis=0), np.mean(identified, axis=0)
    median = np.median(halves, axis=0)
    return (
        name,
        str(len(right.names)),
        _percent(often, 0),
        _percent(shares, 1),
        _percent(median, 0),
    )


def _percent(shares: np.ndarray, digits: int) -> str:
    low, high = (f"{100 * share:.{digits}f}" for share in (shares.min(), shares.max()))
    return f"{low if low == high else f'{low} to {high}'} %".replace("inf %", "unlimited")


def _sizes(found: IdentifiedResult) -> tuple[str, ...]:
    torsions = [p.value for p in found.parameters if ".tilt[" not in p.name]
    tilts = [p.value for p in found.parameters if p.added]
    worst = np.linalg.norm(found.displacements("left_out_error"), axis=1).max()
    return (
        _mm(found.rms_m.fit),
        f"{_mm(found.rms_m.left_out)} mm",
        f"{1e3 * worst:.2f} mm",
        ", ".join(_kilo(value) for value in torsions if value)
        + "".join(f"; tilt {_kilo(value)}" for value in tilts if value),
        f"{found.condition:.1f}",
    )


def _mm(length: float | None) -> str:
    return "" if length is None else f"{1e3 * length:.3f}"


def _kilo(stiffness: float) -> str:
    return f"{1e-3 * stiffness:.0f}" if np.isfinite(stiffness) else "rigid"


if __name__ == "__main__":
    PAGE.write()
