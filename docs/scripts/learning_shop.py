"""Where robots whose parameters are hidden are run, measured in simulation, and learned."""

from __future__ import annotations

import resource
import tempfile
import time
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Self

import numpy as np
import tomlkit

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.identification.next.inputs import next_case_text
from coupling.identification.runs.learning import learn
from coupling.identification.runs.measurement import Measurement
from coupling.identification.runs.problem import FramePrior
from coupling.identification.runs.results import Learned
from coupling.identification.runs.source import MeasuredFile, read_source
from coupling.path.histories import ToolPath
from coupling.robot.parameters import apply_values
from coupling.run.execute import run_compensation
from coupling.run.fmu_pool import FmuPool
from coupling.run.folder import write_run
from docs.scripts.learning_studies import DEPTH, Left, Trial, Truth
from docs.scripts.runs import example_data
from elastic_robot.description import Robot

# Of the command's end nothing is judged, and nothing measured [s].
CUT = 0.3


def _cpu() -> float:
    """Return the CPU time of this process and of those that it has ended [s]."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(own.ru_utime + own.ru_stime for own in used)


def _unseen(run: Path) -> MeasuredFile:
    """Return a run as something to learn from, without what was measured."""
    return read_source(run, Measurement("", np.zeros(1), np.zeros((1, 3))))


class Shop:
    """Where robots are run and measured; a context manager that ends them.

    Args:
        data: The case.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self._scratch = tempfile.TemporaryDirectory()
        self._folder = Path(self._scratch.name)
        self._models = FmuPool("native")
        self._count = 0
        self._first = self._compensated(tomlkit.dumps(data))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._models.__exit__(*error)
        self._scratch.cleanup()

    @property
    def robot(self) -> Robot:
        """The robot of the case's file."""
        return self._case(self._first).robots[0].description

    def _case(self, run: Path) -> Case:
        return load_case(run / "case.toml")

    def _compensated(self, text: str) -> Path:
        """Run a case into a new run folder."""
        self._count += 1
        file = self._folder / f"case{self._count}.toml"
        file.write_text(text, encoding="utf-8")
        folder = self._folder / f"run{self._count}"
        folder.mkdir()
        case = load_case(file)
        write_run(folder, case, run_compensation(case))
        return folder

    def moved(self, run: Path, truth: Truth) -> ToolPath:
        """Return the path that the tool really takes under a run's command, in axes of the base."""
        source = _unseen(run)
        placed = self._case(self._first).robots[0]
        fmu = self._models.of(placed.description, placed.torque_curve).fmu
        robot = apply_values(placed.description, truth.values(placed.description))
        return fmu.simulate(source.stored.joints, source.stored.wrench, "dynamic", robot)

    def measurement(
        self, run: Path, truth: Truth, trial: Trial, seed: int, path: ToolPath
    ) -> Measurement:
        """Return what is measured of the path that the tool really takes."""
        rng = np.random.default_rng(seed)
        source = _unseen(run)
        clock, at = source.stored.desired.time, source.world_from_base
        rows = np.flatnonzero(clock <= min(clock[-1] - CUT, trial.seconds))
        noise = trial.noise * rng.standard_normal((len(rows), 3))
        if trial.beyond is not None:
            command = source.stored.joints
            noise += trial.beyond.at(source.robot, source.home, command, clock[rows])
        position = at.points(path.position[0][rows] + noise)
        return Measurement("measured.csv", clock[rows], position)

    def found(self, truth: Truth, trial: Trial, seed: int) -> Learned:
        """Return what one run under the file's command tells."""
        measured = self.measurement(self._first, truth, trial, seed, self.moved(self._first, truth))
        with FmuPool("native") as models:
            return learn([read_source(self._first, measured)], FramePrior(), models)

    def left(self, run: Path, path: ToolPath) -> Left:
        """Return how far the tool really is from its desired path."""
        desired = _unseen(run).stored.desired
        judged = desired.time <= desired.time[-1] - CUT
        return Left.of((path.position[0] - desired.position[0])[judged])

    def learned(self, truth: Truth, seed: int) -> tuple[list[Left], list[tuple[float, float]]]:
        """Measure, learn, command and measure again.

        Returns:
            What the commands leave, that of the file first; and the time of each fit, by the clock and
            of all processes together [s].
        """
        run, sources, trial = self._first, [], Trial()
        path = self.moved(run, truth)
        left, seconds = [self.left(run, path)], []
        for number in range(trial.runs):
            measured = self.measurement(run, truth, trial, seed + number, path)
            sources.append(read_source(run, measured))
            begin = (time.perf_counter(), _cpu())
            with FmuPool("native") as models:
                learned = learn(sources, FramePrior(), models)
            seconds.append((time.perf_counter() - begin[0], _cpu() - begin[1]))
            if not learned.result.refusal:
                run = self.commanded(run, learned)
                path = self.moved(run, truth)
            left.append(self.left(run, path))
            print(truth.name, *left, *(f"{s:.1f} s, CPU {c:.1f} s" for s, c in seconds), flush=True)
        return left, seconds

    def commanded(self, run: Path, found: Learned) -> Path:
        """Return the run folder of the next command, for the robot that was learned."""
        content = tomllib.loads((run / "case.toml").read_text(encoding="utf-8"))
        file = self._folder / f"learned{self._count}.toml"
        text = found.text(Path(found.result.robot), "measured.csv", file)
        file.write_text(text, encoding="utf-8")
        return self._compensated(next_case_text(content, file))


@cache
def cone() -> Shop:
    """Return the first contours of the example cone, 24 s."""
    return Shop(example_data("cone", tool_path={"depth_m": DEPTH}))
