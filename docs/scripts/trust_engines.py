"""The FMUs against solutions of other engines (tests/reference), the model against MuJoCo."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import cache

import numpy as np

from benchmarks.task import REFERENCE, ROBOT, TRAJECTORY
from coupling.fmu.job import SimulationJob
from coupling.fmu_export.build import KINDS
from coupling.robot.fmu_signals import POSE_OUTPUTS, WRENCH_INPUTS
from docs.scripts.page import DOCS
from docs.scripts.trust_comparison import Against, Comparison
from docs.scripts.trust_fmu import answers
from elastic_robot.torque_curves import TORQUE_CURVES

sys.path.insert(0, str(DOCS.parent / "tests" / "helpers"))
from mujoco_differences import both_at_rest, largest_differences
from random_robots import make_robot

# Names in the references' files, and those of the torque curves.
CURVES = {"nobacklash": "linear", "backlash": "backlash"}
ROBOTS, STATES = 50, 20
_LOAD = (200.0, -150.0, -1000.0, 10.0, 20.0, -5.0)  # [N, N m]
_STEP_POSTURE = (0.0, -0.3, 0.5, 0.0, 0.6, 0.0)  # [rad]
_COMMANDS = tuple(f"q_cmd[{i + 1}]" for i in range(6))
_NO_GRAVITY = {f"gravity.{axis}": 0.0 for axis in "xyz"}


@cache
def rest() -> Comparison:
    """Return how far the tools of both FMUs rest from the references, ten postures."""
    postures = _reference("poses")[:, 1:]
    loads = {"gravity": np.zeros(6), "wrench": np.array(_LOAD)}
    jobs = {
        "a_fk": _still("backlash", postures, loads["gravity"], **_NO_GRAVITY),
        **{
            f"b_static_{load}_{name}": _still(curve, postures, wrench)
            for load, wrench in loads.items()
            for name, curve in CURVES.items()
        },
    }
    rigid = _reference("a_fk")[:, 1:4]
    return _compared(
        "at rest under gravity and load",
        jobs,
        max(_largest(_reference(name)[:, 1:4] - rigid) for name in jobs),
    )


@cache
def force_step() -> Comparison:
    """Return how far both FMUs are from the references under a step of 2 kN."""
    jobs, moved = {}, 0.0
    for name, curve in CURVES.items():
        expected = _reference(f"c_step_{name}")
        moved = max(moved, _largest(expected[:, 1:4] - expected[0, 1:4]))
        time = expected[:, 0]
        # Row k acts over the step that ends at time[k]; half a sample keeps rounding out.
        rows = np.where((time > 0.1005) & (time < 0.3005), -2000.0, 0.0)[:, None]
        settings: dict[str, str | float] = {"mode": "dynamic", "torque_curve": curve}
        settings.update(zip(_COMMANDS, _STEP_POSTURE, strict=True))
        jobs[f"c_step_{name}"] = _job(settings, time, ("force.z",), rows)
    return _compared("a step of the force by 2 kN", jobs, moved)


@cache
def path(name: str) -> Comparison:
    """Return how far both FMUs are from the reference along the ISO 9283 path of 22.8 s."""
    expected, rigid = _reference(f"d_iso_{name}_10ms"), _reference("d_iso_rigid_10ms")
    settings = {"mode": "dynamic", "torque_curve": CURVES[name], "trajectory": str(TRAJECTORY)}
    nothing = np.zeros((len(expected), 1))
    job = _job(settings, expected[:, 0], ("force.z",), nothing)
    words = {"nobacklash": "ISO 9283 path", "backlash": "ISO 9283 path, backlash"}
    return _compared(
        words[name], {f"d_iso_{name}_10ms": job}, _largest(expected[:, 1:4] - rigid[:, 1:4])
    )


@cache
def mechanics() -> Comparison:
    """Return how far mass matrix, bias forces and kinematics are from MuJoCo's, random robots."""
    worst = max(
        largest_differences(make_robot(seed, 3 + seed % 6), STATES, seed).max()
        for seed in range(ROBOTS)
    )
    what = f"mass matrix of {ROBOTS} random robots"
    return Comparison(what, Against.PROGRAM, worst, 1.0, f"{worst:.0e} of the largest element")


@cache
def random_rest() -> Comparison:
    """Return how far random robots under random loads rest from MuJoCo's."""
    rng = np.random.default_rng(3)
    worst, largest = 0.0, 0.0
    for seed in range(ROBOTS):
        joints = 1 + seed % 8
        for curve in TORQUE_CURVES:
            q, wrench = rng.uniform(-2, 2, joints), rng.normal(size=6) * [300, 300, 300, 50, 50, 50]
            ours, other = both_at_rest(make_robot(seed, joints), curve, q, wrench)
            worst = max(worst, np.abs(ours - other).max(initial=0.0))
            largest = max(largest, np.abs(other).max(initial=0.0))
    words = f"{worst:.0e} of {largest:.0e} rad"
    return Comparison(f"{ROBOTS} random robots at rest", Against.PROGRAM, worst, largest, words)


def _still(curve: str, postures: np.ndarray, wrench: np.ndarray, **start: float) -> SimulationJob:
    """Return the job to rest in all postures under a wrench."""
    rows = np.hstack([postures, np.tile(wrench, (len(postures), 1))])
    settings: dict[str, str | float] = {"mode": "quasistatic", "torque_curve": curve, **start}
    return _job(settings, np.arange(len(rows), dtype=float), (*_COMMANDS, *WRENCH_INPUTS[:6]), rows)


def _job(
    settings: Mapping[str, str | float], time: np.ndarray, inputs: tuple[str, ...], rows: np.ndarray
) -> SimulationJob:
    return SimulationJob(settings, time, inputs, rows, POSE_OUTPUTS[:3], 3)


def _compared(what: str, jobs: dict[str, SimulationJob], moved: float) -> Comparison:
    """Return the largest distance from the references, of the FMUs of either kind."""
    both = (answers(ROBOT, jobs.values(), kind) for kind in KINDS)
    worst = max(
        _largest(answer - _reference(name)[:, 1:4])
        for found in both
        for name, answer in zip(jobs, found, strict=True)
    )
    return Comparison(what, Against.PROGRAM, worst, moved, f"{worst:.0e} m of {1e3 * moved:.2f} mm")


def _reference(name: str) -> np.ndarray:
    return np.loadtxt(REFERENCE / f"{name}.csv", delimiter=",", skiprows=1)


def _largest(vectors: np.ndarray) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())
