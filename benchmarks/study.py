"""Samples per second of a study, on one worker and on two: python -m benchmarks.study.

The example cone's command on 200 sampled robots.  Both are timed in the same run, from the command to
the last sample on the disk, the start of the workers among it; samples are the same to the last bit.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from coupling.case.file import load_case
from coupling.events import unwatched
from coupling.results.study_result import StudySample
from coupling.run.execute import run_compensation
from coupling.run.folder import write_run
from coupling.study.conduct import changed_table, open_study, simulate_samples
from coupling.study.robot_pool import Workers

CASE = Path(__file__).parents[1] / "examples" / "cases" / "cone.toml"
SAMPLES = 200
WORKERS = 2
# Share of so many times one worker's speed that the workers are meant to reach.
WANTED = 0.9


@dataclass(frozen=True)
class Timed:
    """A study that was timed.

    Attributes:
        workers: Number of its workers.
        wall: Wall time [s].
        samples: What it found.
    """

    workers: int
    wall: float
    samples: list[StudySample]

    def __str__(self) -> str:
        speed = len(self.samples) / self.wall
        return f"{self.workers} workers: {self.wall:.1f} s, {speed:.2f} samples a second"


def studied(case_file: Path, run: Path, workers: int, samples: int) -> Timed:
    """Simulate the samples of a study in a folder of its own."""
    case = load_case(case_file)
    table = changed_table(case.study, samples=samples)
    with tempfile.TemporaryDirectory() as folder:
        study = open_study(Path(folder), case, table, run, couple=False)
        start = time.perf_counter()
        found = simulate_samples(study, Workers(workers), unwatched)
        return Timed(workers, time.perf_counter() - start, found)


def efficiency(one: Timed, more: Timed) -> float:
    """Return the speed of several workers over as many times that of one."""
    return one.wall / (more.workers * more.wall)


def main(samples: int = SAMPLES) -> None:
    """Time both and print the share."""
    case = load_case(CASE)
    with tempfile.TemporaryDirectory() as folder:
        write_run(Path(folder), case, run_compensation(case))
        load = os.getloadavg()[0]
        print(f"{os.cpu_count()} cores, load before: {load:.2f}", flush=True)
        timed = []
        for workers in (1, WORKERS):
            timed.append(studied(CASE, Path(folder), workers, samples))
            print(timed[-1], f"load now: {os.getloadavg()[0]:.2f}", sep="; ", flush=True)
    one, more = timed
    if one.samples != more.samples:
        raise SystemExit("the samples differ")
    share = efficiency(one, more)
    verdict = "reached" if share >= WANTED else "not reached"
    print(
        f"share of {WORKERS} times one worker's speed: {share:.3f} (at least {WANTED}; {verdict})"
    )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
