"""Cycles of the native FMU in a C host: set the inputs, step, read the pose.

    python -m benchmarks.real_time                       a million cycles each, about 10 s
    python -m benchmarks.real_time --page performance    and write the table of docs/performance.md

All drives of the robot move and a force comes and goes, with backlash (tests/native/cycles.c).  The
cycles follow each other without a pause; what else runs on the machine is in the largest of them.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import fmpy

from benchmarks.task import ROBOT
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.compiler import SOURCES, host_platform
from docs.scripts.page import replace, table

_MASTER = Path(__file__).parent.parent / "tests" / "native" / "cycles.c"
# Of the cycle [s].
PERIODS = (1e-3, 2.5e-4)
_STEPS = 1_000_000


@dataclass(frozen=True)
class Cycles:
    """How long the cycles of a run took.

    Attributes:
        period: Simulated time of one [s].
        median, slow, largest: Time that half of them took at most, 99.9 % and all [s].
    """

    period: float
    median: float
    slow: float
    largest: float


def measured(periods: tuple[float, ...] = PERIODS, steps: int = _STEPS) -> list[Cycles]:
    """Return what cycles of each period [s] take."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        unpacked, master = folder / "fmu", folder / "cycles"
        fmpy.extract(
            str(build_fmu(ROBOT, folder / "Robot.fmu", BuildOptions("native"))), str(unpacked)
        )
        command = ["cc", "-std=c99", "-O2", f"-I{SOURCES / 'fmi'}", "-o", str(master), str(_MASTER)]
        subprocess.run([*command, "-ldl", "-lm"], check=True)
        platform = host_platform()
        fmu = (
            unpacked / "binaries" / platform.name / f"ElasticRobot{platform.suffix}",
            fmpy.read_model_description(str(unpacked)).guid,
            (unpacked / "resources").as_uri(),
        )
        return [_run((str(master), *map(str, fmu)), period, steps) for period in periods]


def _run(command: tuple[str, ...], period: float, steps: int) -> Cycles:
    script = f"{period},{steps}"
    said = subprocess.run([*command, script], check=True, capture_output=True, text=True).stdout
    return Cycles(period, *(1e-9 * float(number) for number in said.split()))


def lines(rows: list[Cycles]) -> str:
    """Return the table."""
    head = ("cycle", "median [us]", "99.9 % / median", "largest / median", "median / cycle")
    body = [
        (
            f"{1e3 * row.period:g} ms",
            f"{1e6 * row.median:.1f}",
            f"{row.slow / row.median:.1f}",
            f"{row.largest / row.median:.0f}",
            f"{row.median / row.period:.1e}",
        )
        for row in rows
    ]
    return table(head, body)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Cycles of the native FMU in a C host.")
    parser.add_argument("--steps", type=int, default=_STEPS, help="cycles of each length")
    parser.add_argument("--page", help="name of the page that takes the table")
    options = parser.parse_args()
    text = lines(measured(steps=options.steps))
    print(text)
    if options.page:
        replace(options.page, "real-time", text)


if __name__ == "__main__":
    main()
