"""Robots that are measured run after run, and the commands that are computed from that."""

from __future__ import annotations

import sys
import tempfile
import tomllib
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from coupling.case.file import load_case
from coupling.cli.next import expected
from coupling.events import unwatched
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.identification.next.command import plan
from coupling.identification.next.inputs import begin_inputs, inputs_folder, write_inputs
from coupling.identification.next.options import FrameAccuracy, NextOptions
from coupling.identification.runs.measurement import read_measurement
from coupling.identification.runs.source import MeasuredFile, read_source
from coupling.results.forecast import RunForecast
from coupling.run.execute import run_compensation
from coupling.run.fmu_pool import FmuPool
from coupling.run.folder import write_run
from docs.scripts.learning_studies import hidden
from docs.scripts.page import DOCS
from docs.scripts.runs import example_data

sys.path.insert(0, str(DOCS.parent / "tests" / "helpers"))

from measured_robot import Chain, Extras, MeasuredRobot
from replay_robot import Robot as ReplayedRobot
from replay_robot import Settings

# Logarithms of the hidden factors are even between plus and minus this.
WIDTHS = {"stiffness": 0.15, "backlash": 0.3, "damping": 0.4}
# What the robots have that the model has not, with the noise of the measurement.
EXTRAS = Extras(hysteresis=3e-5, drift=5e-5, gear_errors=7e-5)
# The frame is the robot's to this [m] and [rad].
KNOWN = FrameAccuracy(5e-5, 5e-5)


@dataclass(frozen=True)
class Path3:
    """A path.

    Attributes:
        name: In words.
        case: Case of the examples.
        keys: Keys of its [tool_path] that are other.
        roll: Of the robot's base about its x axis [deg]: where it is not tilted, gears are unloaded.
    """

    name: str
    case: str
    keys: Mapping[str, Any] = field(default_factory=dict)
    roll: float = 0.0


CONE = Path3("cone", "cone", {"depth_m": 0.0005})
PYRAMID = Path3("pyramid", "cone", {"kind": "pyramid", "radius_m": 0.05, "depth_m": 0.0005})
ISO = Path3("ISO 9283, 0.1 m/s, base rolled", "iso9283", {"size_m": 0.1}, 6.0)


@dataclass(frozen=True)
class Trial:
    """A robot on a path, measured so many times.

    Attributes:
        path: The path.
        seed: Of the hidden parameters.
        stiffness: Factor of the stiffness of the robot file itself: 0.25, 0.5 and 1 have lowest modes at
            about 5, 7 and 10 Hz.
        extras: What the robot has beyond the model.
        runs: Number of runs.
    """

    path: Path3
    seed: int
    stiffness: float = 1.0
    extras: Extras = EXTRAS
    runs: int = 4

    @property
    def name(self) -> str:
        """The trial, in words."""
        soft = "" if self.stiffness == 1.0 else f" x {self.stiffness:g}"
        return f"example{soft}, {self.path.name}"


@dataclass(frozen=True)
class Measured:
    """One run.

    Attributes:
        rms, maximum: Of the tool's true distance from its path [m].
        repeats: Rms without what was new in this run: what the command leaves [m].
        forecast: What was expected; None of the first.
        move: How its command was found; "" of the first.
    """

    rms: float
    maximum: float
    repeats: float
    forecast: RunForecast | None
    move: str


@dataclass(frozen=True)
class TrialResult:
    """What came of a trial.

    Attributes:
        trial: The trial.
        runs: Its runs.
    """

    trial: Trial
    runs: tuple[Measured, ...]

    @property
    def never_worse(self) -> bool:
        """Whether the last run is within a tenth of the best, and below the first."""
        return _never_worse([own.rms for own in self.runs])

    @property
    def commands_never_worse(self) -> bool:
        """Whether that is so of what the commands leave, without what was new in each run."""
        return _never_worse([own.repeats for own in self.runs])

    @property
    def held(self) -> list[bool]:
        """Whether each forecast held what was then measured."""
        return [
            own.forecast.low <= own.rms <= own.forecast.high for own in self.runs if own.forecast
        ]

    @property
    def row(self) -> str:
        """Rms after every run [um]."""
        return " → ".join(f"{1e6 * run.rms:.3g}" for run in self.runs)


def _never_worse(left: list[float]) -> bool:
    return left[-1] <= 1.1 * min(left) and left[-1] < left[0]


def trial_result(trial: Trial) -> TrialResult:
    """Measure a robot, compute its next command, and so on."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / "robot.toml"
        file.write_text(_robot_text(trial), encoding="utf-8")
        data = example_data(
            trial.path.case, robot={"description": str(file)}, tool_path=trial.path.keys
        )
        case_file = folder / "case.toml"
        case_file.write_text(tomlkit.dumps(data), encoding="utf-8")
        run = folder / "run1"
        run.mkdir()
        case = load_case(case_file)
        write_run(run, case, run_compensation(case))
        robot = load_robot(file)
        fmu = ReplayedRobot(build_fmu(robot, folder / "true.fmu", BuildOptions("native")))
        values = hidden(robot, trial.seed, WIDTHS).values(robot)
        settings = Settings(values=values, curve="backlash")
        real = MeasuredRobot(fmu, Chain.read(file), settings, trial.extras)
        runs, sources, forecast, move = [], [], None, ""
        for number in range(1, trial.runs + 1):
            moved = real.measure(run, folder / f"measured{number}.csv", number)
            left = Measured(moved.rms(), moved.largest(), moved.repeats(), forecast, move)
            runs.append(left)
            if number == trial.runs:
                break
            sources.append(read_source(run, read_measurement(folder / f"measured{number}.csv")))
            run = folder / f"run{number + 1}"
            forecast, move = commanded(sources, run)
    result = TrialResult(trial, tuple(runs))
    print(
        f"{trial.name} {trial.seed}: {result.row} ({', '.join(p.move for p in runs)})", flush=True
    )
    return result


def commanded(sources: list[MeasuredFile], run: Path) -> tuple[RunForecast | None, str]:
    """Compute the next command into a run folder; return what it is to leave, and how it was found."""
    with FmuPool("native") as models:
        found = plan(sources, NextOptions(KNOWN), models)
        begin_inputs(inputs_folder(run))
        case = load_case(write_inputs(inputs_folder(run), found))
        done = expected(case, found, unwatched)
    run.mkdir()
    write_run(run, case, done)
    return done.forecast, "back" if found.step.worse else found.move


def trial_results(trials: list[Trial]) -> list[TrialResult]:
    """Do trials two at a time."""
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        return list(pool.map(trial_result, trials))


def _robot_text(trial: Trial) -> str:
    data = tomllib.loads(find_robot("icme2008").read_text(encoding="utf-8"))
    for joint in data["joint"]:
        for table in (joint, *joint.get("tilt", ())):
            if "stiffness" in table:
                table["stiffness"] *= trial.stiffness
    data.pop("sources", None)
    roll = np.deg2rad(trial.path.roll)
    data["gravity"] = [0.0, float(-9.81 * np.sin(roll)), float(-9.81 * np.cos(roll))]
    return tomlkit.dumps(data)
