"""Cycles of the native FMU in a C host: set the inputs, step, read the pose.

    python -m benchmarks.real_time                       a million cycles each, about 20 s
    python -m benchmarks.real_time --page performance    and write the tables of docs/performance.md

All drives of the robot move and a force comes and goes, with backlash (tests/native/cycles.c).  The
cycles follow each other without a pause; what else runs on the machine is in the largest of them.  The
second table has what motors and hysteresis cost: steps of 4 ms of the same robot with them, over those
without.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import tempfile
from dataclasses import dataclass
from dataclasses import replace as changed
from pathlib import Path

import fmpy

from benchmarks.task import ROBOT
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.native.compiler import SOURCES, host_platform
from docs.scripts.page import replace, table
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.gear_parts import StopElement

_MASTER = Path(__file__).parent.parent / "tests" / "native" / "cycles.c"
# Of the cycle [s].
PERIODS = (1e-3, 2.5e-4)
_STEPS = 1_000_000
# Motors and gears of six joints: rotors at the gear's output [kg m^2], friction of motors and of the
# elements of gears [N m], slip angles of these [rad]; rate loops of 30 Hz and 20 ms in position loops of
# 20 1/s.
_ROTORS = (400.0, 400.0, 300.0, 40.0, 40.0, 30.0)
_FRICTION = (300.0, 300.0, 200.0, 60.0, 50.0, 40.0)
_SLIP_TORQUES, _SLIP_ANGLES = (120.0, 120.0, 90.0, 25.0, 20.0, 20.0), (20e-6, 60e-6, 150e-6)


@dataclass(frozen=True)
class Cycles:
    """How long the cycles of a run took.

    Attributes:
        period: Simulated time of one [s].
        median, slow, largest: Time that half of them took at most, 99.9 % and all [s].
        mean: Mean time of all but the longest 0.1 % [s].
    """

    period: float
    median: float
    slow: float
    largest: float
    mean: float


def measured(
    periods: tuple[float, ...] = PERIODS,
    steps: int = _STEPS,
    robot: Robot = ROBOT,
    drive: str = "ideal",
) -> list[Cycles]:
    """Return what cycles of each period [s] take, of a robot whose drives follow like this."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        unpacked, master = folder / "fmu", folder / "cycles"
        fmpy.extract(
            str(build_fmu(robot, folder / "Robot.fmu", BuildOptions("native"))), str(unpacked)
        )
        command = ["cc", "-std=c99", "-O2", f"-I{SOURCES / 'fmi'}", "-o", str(master), str(_MASTER)]
        subprocess.run([*command, "-ldl", "-lm"], check=True)
        platform = host_platform()
        fmu = (
            unpacked / "binaries" / platform.name / f"ElasticRobot{platform.suffix}",
            fmpy.read_model_description(str(unpacked)).guid,
            (unpacked / "resources").as_uri(),
        )
        command = [str(master), *map(str, fmu)]
        return [_run(command, f"{period},{steps},{drive}", period) for period in periods]


def _run(command: list[str], script: str, period: float) -> Cycles:
    said = subprocess.run([*command, script], check=True, stdout=subprocess.PIPE, text=True).stdout
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


def with_motors(rubs: bool) -> Robot:
    """Return the robot with motors and servos, their friction if it `rubs`."""
    joints = []
    for joint, rotor, friction in zip(ROBOT.joints, _ROTORS, _FRICTION, strict=True):
        gain = rotor * 2.0 * math.pi * 30.0
        own = friction * rubs
        drive = Drive(rotor, 20.0, gain, gain / 0.02, 1.0, own, 20e-6, own)
        joints.append(joint if joint.stiffness is None else changed(joint, drive=drive))
    return changed(ROBOT, joints=tuple(joints))


def with_elements(robot: Robot) -> Robot:
    """Return a robot whose gears have three elements of hysteresis each."""
    joints = []
    for joint, torque in zip(robot.joints, _SLIP_TORQUES, strict=True):
        elements = tuple(StopElement(torque / 3.0, angle) for angle in _SLIP_ANGLES)
        joints.append(joint if joint.stiffness is None else changed(joint, hysteresis=elements))
    return changed(robot, joints=tuple(joints))


def costs(steps: int) -> str:
    """Return the table of what motors and hysteresis cost."""
    plain, rubbing = with_motors(False), with_motors(True)
    rows, first = [], 0.0
    for name, robot, drive in (
        ("drives that follow their commands", ROBOT, "ideal"),
        ("hysteresis", with_elements(ROBOT), "ideal"),
        ("servos", plain, "servo"),
        ("servos and friction", rubbing, "servo"),
        ("servos, friction and hysteresis", with_elements(rubbing), "servo"),
    ):
        (one,) = measured((4e-3,), steps, robot, drive)
        first = first or one.mean
        rows.append((name, f"{1e6 * one.mean:.1f}", f"{one.mean / first:.2f}"))
    return table(("robot", "step of 4 ms, mean [us]", "over the first"), rows)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Cycles of the native FMU in a C host.")
    parser.add_argument("--steps", type=int, default=_STEPS, help="cycles of each length")
    parser.add_argument("--page", help="name of the page that takes the table")
    options = parser.parse_args()
    text, cost = lines(measured(steps=options.steps)), costs(options.steps // 10)
    print(f"{text}\n\n{cost}")
    if options.page:
        replace(options.page, "real-time", text)
        replace(options.page, "motors", cost)


if __name__ == "__main__":
    main()
