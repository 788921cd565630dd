"""The robot's data inside the native FMU: what the C core refuses."""

from __future__ import annotations

import subprocess
from dataclasses import replace

import pytest
from native_core import Core, CoreError, read_data
from native_fmu import SANITIZERS, compiler
from places import TESTS

from coupling.fmu_export.compiler import SOURCES, core_sources
from coupling.fmu_export.native_fmu import robot_data
from coupling.fmu_export.robot_text import robot_text
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError
from elastic_robot.fmi.interface import blocks


def test_robots_that_the_core_cannot_hold_are_refused(example):
    joint = example.joints[0]
    with pytest.raises(RobotFileError, match="at most 12 joints for a native FMU, got 13"):
        robot_text(replace(example, joints=(joint,) * 13), "{x}")
    with pytest.raises(CoreError, match="more than 12 joints"):
        Core(
            robot_text(replace(example, joints=(joint,) * 12), "{x}")[:-3]
            + "joint 0 0 0 0 0 1\nend"
        )
    table = tuple((float(k), float(k)) for k in range(-40, 40))
    long = replace(example, joints=(replace(joint, torque_table=table), *example.joints[1:]))
    with pytest.raises(RobotFileError, match="at most 64 points for a native FMU, got 80"):
        robot_text(long, "{x}")


def data_of(robot: Robot) -> str:
    """All lines of an FMU's robot.txt."""
    return robot_data(robot, blocks(robot), "{x}").decode()


LINES = {
    "version": ("elastic-robot 2", "elastic-robot 1", "found 1; needed is a whole number from 2"),
    "format": ("elastic-robot 2", "robot", "line 1: found 'robot'"),
    "number": ("gravity 0.0", "gravity zero", "line 3: found 'zero'; needed is a finite number"),
    "end": ("\nend", "", "needed is the line 'end'|found 'tolerance'"),
    "key": ("spring", "sprung", "found 'sprung'; needed is joint, spring"),
    "too much": ("-9.81", "-9.81 7", "found '7'; needed is the line's end"),
    "springs": ("tilt", "spring", "needed is at most one spring for each joint"),
    "tilts": ("\ntilt", "\ntilt 1 0 0 1 0\ntilt", "needed is at most two tilts for each joint"),
    "no setting": (
        "setting slack ",
        "setting safety ",
        "have no setting slack; expected each once",
    ),
    "a setting": ("setting slack ", "setting slackness ", "found 'slackness'; needed is the name"),
    "zero": ("setting slack 0.01", "setting slack 0", "needed is a setting above zero"),
    "tolerance": ("tolerance 1e-06", "tolerance -1", "a tolerance of -1 m; expected a number > 0"),
    "block": ("reals velocity", "reals speed", "found 'speed'; needed is the name of a block"),
    "fewer reals": (" tcp.vz", "", "2 variables of the block velocity; expected 3 for this robot"),
    "more reals": (" tcp.vz", " tcp.vz x", "4 variables of the block velocity; expected 3"),
    "no unit": ("velocity m/s tcp.vx tcp.vy tcp.vz", "velocity", "needed is a unit of less than"),
    "no name": ("velocity m/s tcp.vx tcp.vy tcp.vz", "velocity m/s", "needed is a name of less"),
    "long name": ("tcp.vz", 70 * "v", "needed is a name of less than 64 letters"),
    "apart": (
        "reals velocity",
        "reals wrench",
        "needed is each block's variables one after another",
    ),
    "no string": ("string mode", "strong mode", "found 'strong'; needed is string"),
    "start value": ("mode dynamic", "mode static", "choices with the start value among them"),
    "choices": ("dynamic quasistatic", "dynamic", "needed is one more choice"),
    "more choices": (
        "dynamic quasistatic",
        "dynamic quasistatic x",
        "found 'x'; needed is the line's",
    ),
}


@pytest.mark.parametrize("name", LINES)
def test_broken_data_are_refused_with_their_line(example, tmp_path, name):
    old, new, message = LINES[name]
    text = data_of(example)
    assert old in text
    file = tmp_path / "robot.txt"
    file.write_text(text.replace(old, new))
    with pytest.raises(CoreError, match=message):
        read_data(file)
    file.write_text(text)
    read_data(file)


def test_random_damage_is_read_or_refused_with_a_sentence(example, tmp_path):
    """Lines and words changed, doubled or lost, under address and behaviour sanitizers."""
    program, file = tmp_path / "fuzz_data", tmp_path / "robot.txt"
    file.write_text(data_of(example))
    flags = ["-std=c99", "-Wall", "-Wextra", *SANITIZERS, f"-I{SOURCES / 'fmi'}"]
    sources = [TESTS / "native" / "fuzz_data.c", *core_sources()]
    subprocess.run([compiler(), *flags, "-o", program, *sources, "-lm"], check=True)
    done = subprocess.run([program, file, "20000"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    times, refused = (int(word) for word in done.stdout.split() if word.isdigit())
    assert times == 20000
    assert 0.9 * times < refused < times
