"""A FANUC R-2000iC through whose tool a drill's thrust is gone at once: surge, and nothing fitted.

Masses are published, stiffness is that of the shipped file, identified at rest; its damping is an
assumption. The data: examples/measured/fanuc_drilling.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.files.controller_axes import controller_axes
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu.job import SimulationJob
from coupling.robot.fmu_signals import POSE_OUTPUTS, WRENCH_INPUTS
from coupling.robot.parameters import robot_parameters
from docs.scripts.experiment import results
from docs.scripts.runs import measured_rows
from docs.scripts.trust_comparison import Against, Comparison
from docs.scripts.trust_fmu import answers
from elastic_robot.description import Robot
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

RECORDINGS = ("A-1", "A-2", "A-3")
# Damping over that of the file: as it is, and so much that the first mode has the ratio 0.24, that of
# the first decrement measured, as if the joints had all of it.
DAMPING = (1.0, 7.0)
# How long the thrust of the eight tests takes from 90 to 10 % [s]: not known, as of the recordings.
FALLS = (0.016, 0.032)
# Authors' stiffness of the joints [N m/rad], behind the thrust of the eight tests.
_PUBLISHED = (933941.7645, 4129256.136, 1907534.091, 233204.6026, 404358.8275, 79618.1594)
# How far the tools went on, read from the whole recordings [mm]; the feed leaves it open by 0.4.
STEPS = {"A-1": 2.3, "A-2": 1.7, "A-3": 1.4}
# Where a recording's rate is the feed alone, but for ripple [s].
_FEED = {"A-1": (2.193445, 2.395445), "A-2": (2.195445, 2.333045), "A-3": (1.902225, 2.203725)}
_STEP, _BEFORE, _AFTER = 5e-4, 0.02, 0.25  # [s]
# Slopes of recordings are taken over this much to either side [s].
_REACH = 1e-3


@dataclass(frozen=True)
class Surge:
    """Motion of the tool along the drill once its thrust falls.

    Attributes:
        rate: Largest one, feed and spring together [m/s].
        half_cycle: Time from there to the next smallest rate [s].
    """

    rate: float
    half_cycle: float


@dataclass(frozen=True)
class Release:
    """A robot at rest whose tool a falling force leaves.

    Attributes:
        q: Drive angles of the robot file [rad], (6,).
        time, force: Thrust on the tool, against the drill, straight in between [s, N], (k,).
        feed: Rate of the feed [m/s].
    """

    q: np.ndarray
    time: np.ndarray
    force: np.ndarray
    feed: float

    def drill(self) -> np.ndarray:
        """Unit vector in which the drill points, base axes, (3,)."""
        return drill_axis(self.q)

    def job(self, damping: float) -> SimulationJob:
        """Return the simulation of it, with the file's damping times a factor."""
        dampers = robot_parameters(robot(), "linear", ("damping",))
        start = self.time[0] - _BEFORE
        time = np.arange(round((self.time[-1] + _AFTER - start) / _STEP) + 1) * _STEP
        force = np.interp(time + start, self.time, self.force)
        before = np.append(force[0], force[:-1])
        still = np.zeros((len(time), 3))
        push = [-vector[:, None] * self.drill() for vector in (before, (force - before) / _STEP)]
        settings: dict[str, str | float] = {"mode": "dynamic", "torque_curve": "linear"}
        settings |= {f"q_cmd[{i + 1}]": float(angle) for i, angle in enumerate(self.q)}
        settings |= {p.name: damping * p.value for p in dampers}
        rows = np.hstack([push[0], still, push[1], still])
        return SimulationJob(settings, time, WRENCH_INPUTS, rows, POSE_OUTPUTS[:3], 3)

    def surge(self, path: np.ndarray) -> Surge:
        """Return what a simulated path of the tool [m], (n, 3), says, as recordings are read."""
        along, reach = path @ self.drill(), round(_REACH / _STEP)
        rate = (along[2 * reach :] - along[: -2 * reach]) / (2.0 * _REACH)
        top = int(rate.argmax())
        rising = np.flatnonzero(np.diff(rate[top:]) > 0.0)
        return Surge(self.feed + float(rate[top]), float(rising[0]) * _STEP)


@cache
def robot() -> Robot:
    """Return the shipped robot."""
    return load_robot(find_robot("fanuc_r2000ic"))


def file_angles(row: dict[str, str]) -> np.ndarray:
    """Return the drive angles of a row's posture in the controller's count [rad], (6,)."""
    controller = np.deg2rad([[float(row[f"theta{i}"]) for i in range(1, 7)]])
    return controller_axes(find_robot("fanuc_r2000ic"), 6).file_angles(controller)[0]


def at_rest(q: np.ndarray, other: Robot | None = None) -> ElasticRobot:
    """Return the robot, or another one, in equilibrium under its weight."""
    model, none = ElasticRobot(other or robot(), "linear"), np.zeros(6)
    model.reset(0.0, HeldCommand(0.0, q, none, none), Load())
    return model


def drill_axis(q: np.ndarray) -> np.ndarray:
    """Return the unit vector in which the drill points, y of the maker's flange, base axes, (3,)."""
    flange = controller_axes(find_robot("fanuc_r2000ic"), 6).last_from_flange
    tool = Rotation.from_quat(at_rest(q).rigid()[3:])
    return (tool * flange).apply([0.0, 1.0, 0.0])


def compliance(q: np.ndarray) -> float:
    """Return the static compliance of the tool along the drill [m/N]."""
    along = drill_axis(q)
    return float(along @ at_rest(q).compliance()[:3, :3] @ along)


def rows(name: str) -> list[dict[str, str]]:
    """Return the rows of a table of the data, by its columns."""
    return measured_rows(f"fanuc_drilling/{name}")


@cache
def recorded(name: str) -> tuple[Release, Surge]:
    """Return a recording's fall of the thrust, and what was measured."""
    fall = np.array([(r["time_s"], r["force_N"]) for r in rows("force_fall") if r["file"] == name])
    time, force = fall.astype(float).T
    own = [row for row in rows("ringdown_extremes") if row["file"] == name]
    place = {float(row["time_s"]): row["displacement_mm"] for row in own}
    first, last = _FEED[name]
    feed = 1e-3 * (float(place[last]) - float(place[first])) / (last - first)
    at = next(k for k, row in enumerate(own) if row["note"] == "surge")
    low = next(row for row in own[at:] if (row["quantity"], row["kind"]) == ("slope", "min"))
    half = float(low["time_s"]) - float(own[at]["time_s"])
    posture = next(row for row in rows("breakthrough_initial") if row["no."] == name)
    release = Release(file_angles(posture), time, force, feed)
    return release, Surge(1e-3 * float(own[at]["slope_mm_s"]), half)


@cache
def predicted() -> dict[str, tuple[Surge, ...]]:
    """Return what the model says of the recordings, a surge for each of DAMPING."""
    surges = iter(_surges([(recorded(n)[0], damping) for n in RECORDINGS for damping in DAMPING]))
    return {name: tuple(next(surges) for _ in DAMPING) for name in RECORDINGS}


def _surges(tests: Sequence[tuple[Release, float]]) -> list[Surge]:
    """Simulate releases, each with the file's damping times a factor."""
    paths = answers(robot(), [release.job(damping) for release, damping in tests])
    return [release.surge(path) for (release, _), path in zip(tests, paths, strict=True)]


def static_step(name: str) -> float:
    """Return how far the tool goes on as the thrust of a recording is gone [m]."""
    release = recorded(name)[0]
    return float(release.force[0] - release.force[-1]) * compliance(release.q)


@dataclass(frozen=True)
class Drilled:
    """The eight tests.

    Attributes:
        measured: Surge [m/s], (8,).
        authors: What their model of one fitted factor says [m/s], (8,).
        thrust: That behind it, by their formula and stiffness [N], (8,).
        range: What ours says for all of FALLS and DAMPING [m/s], (8, 4).
        declared: For the file's damping and the middle of FALLS [m/s], (8,).
    """

    measured: np.ndarray
    authors: np.ndarray
    thrust: np.ndarray
    range: np.ndarray
    declared: np.ndarray


@cache
def drilled() -> Drilled:
    """Return the eight tests, simulated."""
    drillings = rows("breakthrough_surge")
    feeds, measured, authors = (
        1e-3 * np.array([float(row[key]) for row in drillings])
        for key in ("v_feed", "v_surge", "v_surge_theory")
    )
    thrust = np.array([_thrust(row) for row in drillings])
    cases = [(fall, damping) for fall in FALLS for damping in DAMPING] + [(sum(FALLS) / 2.0, 1.0)]
    # From 90 to 10 % of it, straight: four fifths.
    tests = [
        (
            Release(file_angles(row), np.array([0.0, fall / 0.8]), np.array([push, 0.0]), feed),
            damping,
        )
        for row, push, feed in zip(drillings, thrust, feeds, strict=True)
        for fall, damping in cases
    ]
    rates = np.reshape([surge.rate for surge in _surges(tests)], (len(drillings), len(cases)))
    return Drilled(measured, authors, thrust, rates[:, :-1], rates[:, -1])


def table() -> str:
    """Return the page's table of the recordings."""

    def both(name: str, figure: str) -> str:
        return ", ".join(f"{1e3 * getattr(surge, figure):.0f}" for surge in predicted()[name])

    return results(
        ("",),
        {name: name for name in RECORDINGS},
        str,
        {
            "thrust": lambda name: f"{recorded(name)[0].force[0]:.0f} N",
            "surge [mm/s]": lambda name: both(name, "rate"),
            "measured": lambda name: f"{1e3 * recorded(name)[1].rate:.1f}",
            "half cycle [ms]": lambda name: both(name, "half_cycle"),
            "measured ": lambda name: f"{1e3 * recorded(name)[1].half_cycle:.0f}",
            "step at rest [mm]": lambda name: f"{1e3 * static_step(name):.1f}",
            "measured  ": lambda name: f"{STEPS[name]:.1f} ± 0.4",
        },
    )


def values() -> dict[str, Any]:
    """Return what the page says of it, by the names of its template."""
    feeds = [1e3 * recorded(name)[0].feed for name in RECORDINGS]
    tests = drilled()
    least, most = tests.range.min(axis=1), tests.range.max(axis=1)
    inside = (least <= tests.measured) & (tests.measured <= most)
    misses = {"authors": tests.authors, "ours": tests.declared}
    missed = {name: 100.0 * np.abs(said / tests.measured - 1.0) for name, said in misses.items()}
    return {
        **comparisons(),
        "breakthroughs": table(),
        "feed_low": min(feeds),
        "feed_high": max(feeds),
        "inside": int(inside.sum()),
        **{f"{name}_rms": np.sqrt(np.mean(off**2)) for name, off in missed.items()},
        **{f"{name}_worst": off.max() for name, off in missed.items()},
    }


def comparisons() -> dict[str, Comparison]:
    """Return the page's entries: rms over recordings or tests, the file's damping."""

    def pair(figure: str) -> tuple[np.ndarray, np.ndarray]:
        surges = [(predicted()[name][0], recorded(name)[1]) for name in RECORDINGS]
        ours, theirs = np.transpose([[getattr(s, figure) for s in both] for both in surges])
        return ours, theirs

    tests = drilled()
    return {
        "surge": _compared("surge of a real robot, three recordings", *pair("rate"), "mm/s"),
        "half_cycle": _compared("its first half cycle", *pair("half_cycle"), "ms"),
        "drilled": _compared("surge in eight more tests", tests.declared, tests.measured, "mm/s"),
    }


def _compared(what: str, ours: np.ndarray, theirs: np.ndarray, unit: str) -> Comparison:
    error, size = (float(np.sqrt(np.mean(x**2))) for x in (ours - theirs, theirs))
    words = f"{1e3 * error:.0f} of {1e3 * size:.0f} {unit} rms"
    return Comparison(what, Against.MEASUREMENT, error, size, words)


def _thrust(row: dict[str, str]) -> float:
    """Return the thrust [N] behind the authors' theory^2 = thrust^2 compliance / moving mass [mm^2/s^2].

    Compliance along the drill is that of joints with their stiffness, the moving mass that of all links.
    """
    q = file_angles(row)
    plain = [
        replace(joint, stiffness=stiffness, tilt=())
        for joint, stiffness in zip(robot().joints, _PUBLISHED, strict=True)
    ]
    authors = replace(robot(), joints=tuple(plain), gravity=(0.0, 0.0, 0.0))
    linear = at_rest(q, authors).linearise()
    lever = linear.forcing[:, :3] @ drill_axis(q)
    given, inverse_mass = (
        float(lever @ np.linalg.solve(matrix, lever)) for matrix in (linear.stiffness, linear.mass)
    )
    return 1e-3 * float(np.sqrt(float(row["theory^2"]) / (given * inverse_mass)))
