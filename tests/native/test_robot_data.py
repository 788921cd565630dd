"""The robot's data inside the native FMU: what the C core refuses."""

import subprocess
from dataclasses import replace

import numpy as np
import pytest
from native_core import Core, CoreError, read_data, with_settings
from native_fmu import SANITIZERS, build_linked
from random_robots import driven, make_robot

from coupling.fmu_export.exchange_blocks import all_blocks
from coupling.fmu_export.grouping import arrays
from coupling.fmu_export.native_fmu import robot_data
from coupling.native.robot_text import robot_text
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError
from elastic_robot.gear_parts import KinematicError


def test_robots_that_the_core_cannot_hold_are_refused(example):
    joint = example.joints[0]
    with pytest.raises(RobotFileError, match="at most 12 joints for a native FMU, got 13"):
        robot_text(replace(example, joints=(joint,) * 13), "{x}")
    with pytest.raises(CoreError, match="at most 12 joints"):
        Core(
            robot_text(replace(example, joints=(joint,) * 12), "{x}")[:-3]
            + "joint 0 0 0 0 0 1\nend"
        )
    table = tuple((float(k), float(k)) for k in range(-40, 40))
    many = tuple((float(k), 0.0) for k in range(300))
    for parts, message in (
        (
            {"torque_table": table},
            "torque_table: expected at most 64 points for a native FMU, got 80",
        ),
        ({"balancer": many}, "balancer: expected at most 256 points for a native FMU, got 300"),
        (
            {"kinematic_error": (KinematicError(1e-5, 1.0),) * 9},
            "kinematic_error: expected at most 8 sines for a native FMU, got 9",
        ),
    ):
        large = replace(example, joints=(replace(joint, **parts), *example.joints[1:]))
        with pytest.raises(RobotFileError, match=message):
            robot_text(large, "{x}")


def test_the_core_takes_its_settings_from_its_data(example):
    """A step with hardly any steps to take, and a gear that carries less than a raised limit."""
    push, posture = [0.0, 1e-3, 0.0, 0.0, 0.0, 0.0], [0.0, -0.3, 0.5, 0.0, 0.6, 0.0]
    hasty = with_settings(example, most_tries=1.0, most_tries_per_longest=1e-9)
    kick = [0.0, 0.0, -2000.0, 0.0, 0.0, 0.0]
    usual = Core(example)
    for core in (usual, hasty):
        core.reset("backlash", 0.0, posture, np.zeros(6))
    usual.step(0.1, posture, kick)
    with pytest.raises(CoreError, match="needs more than 1 tries"):
        hasty.step(0.1, posture, kick)
    rests = []
    for core in (Core(example), with_settings(example, neutral_torque=1.0)):
        core.reset("backlash", 0.0, posture, push, quasistatic=True)
        rests.append(core.outputs(11)["x"][0])
    assert abs(rests[0]) >= example.joints[0].backlash
    assert rests[1] == 0.0


def data_of(robot: Robot) -> str:
    """All lines of an FMU's robot.txt."""
    table = all_blocks(robot)
    return robot_data(robot, table, arrays(table), "{x}").decode()


LINES = {
    "version": ("elastic-robot 3", "elastic-robot 1", "expected a whole number from 3 to 3, got 1"),
    "format": ("elastic-robot 3", "robot", "line 1: expected 'elastic-robot', got 'robot'"),
    "number": ("gravity 0.0", "gravity zero", "line 3: expected a finite number, got 'zero'"),
    "end": ("\nend", "", "expected the line 'end'|got 'tolerance'"),
    "key": ("spring", "sprung", "expected joint, error, spring.*, got 'sprung'"),
    "too much": ("-9.81", "-9.81 7", "expected the line's end, got '7'"),
    "springs": ("tilt", "spring", "expected at most one spring for each joint"),
    "tilts": ("\ntilt", "\ntilt 1 0 0 1 0\ntilt", "expected at most two tilts for each joint"),
    "errors": ("\nspring", 9 * "\nerror 1e-5 1 0" + "\nspring", "at most eight sines of an error"),
    "late error": ("\nbody", "\nerror 1e-5 1 0\nbody", "before its tilts"),
    "balancers": (
        "\ntilt",
        2 * "\nbalancer 3 0 1 0 1 1 0 2 1 0" + "\ntilt",
        "at most one balancer for each joint",
    ),
    "flat balancer": (
        "\ntilt",
        "\nbalancer 3 0 1 0 0 1 0 2 1 0\ntilt",
        "expected rising angles of a balancer",
    ),
    "short balancer": ("\ntilt", "\nbalancer 2 0 1 0 1 1 0\ntilt", "number from 3 to 256, got 2"),
    "no setting": (
        "setting slack ",
        "setting safety ",
        "expected each setting once, got no slack",
    ),
    "a setting": (
        "setting slack ",
        "setting slackness ",
        "a setting, got 'slackness'",
    ),
    "zero": ("setting slack 0.01", "setting slack 0", "expected a setting above zero"),
    "tolerance": ("tolerance 1e-06", "tolerance -1", "expected tolerances > 0, got -1: build"),
    "block": ("reals velocity", "reals speed", "expected the name of a block .*, got 'speed'"),
    "states": ("state deflection ", "state tcp ", "expected a block of states, got 'tcp'"),
    "a state less": (
        "\nstate deflection_rate rate_derivative 0.05",
        "",
        "expected the block deflection_rate once among states, .* got it 0 times",
    ),
    "a state twice": (
        "state deflection_rate",
        "state deflection deflection_derivative 1\nstate deflection_rate",
        "expected the block deflection once among states, .* got it 2 times",
    ),
    "derivative": (
        "state deflection deflection_derivative",
        "state deflection tcp",
        "expected as many variables of the block tcp as of deflection",
    ),
    "indicators": ("indicator bend", "indicator tcp", "a block of event indicators, got 'tcp'"),
    "no indicator": ("\nindicator bend", "", "expected the block bend once .* got it 0 times"),
    "fewer reals": (" tcp.vz", "", "expected 6 variables of the block velocity, got 5"),
    "more reals": (" tcp.vz", " tcp.vz x", "expected 6 variables of the block velocity, got 7"),
    "no unit": ("velocity m/s tcp.vx tcp.vy tcp.vz", "velocity", "expected a unit of less than"),
    "no name": ("velocity m/s tcp.vx tcp.vy tcp.vz", "velocity m/s", "expected a name of less"),
    "long name": ("tcp.vz", 70 * "v", "expected a name of less than 64 letters"),
    "apart": (
        "reals velocity",
        "reals wrench",
        "expected each block's variables one after another",
    ),
    "no string": ("string mode", "strong mode", "expected string, got 'strong'"),
    "start value": ("mode dynamic", "mode static", "choices with the start value among them"),
    "choices": ("dynamic quasistatic", "dynamic", "expected one more choice"),
    "more choices": (
        "dynamic quasistatic",
        "dynamic quasistatic x",
        "expected the line's end, got 'x'",
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


OF_DRIVES = {
    "no spring": ("\nspring", "\nstop 1 1\nspring", "element of hysteresis behind its spring"),
    "two motors": (
        "\nmotor",
        "\nmotor 1 1 1 1 1 1 1 1 1 1 1 0\nmotor",
        "at most one motor for each joint",
    ),
    "few numbers": (
        "\nmotor",
        "\nmotor 1 2\nmotor",
        "expected a finite number, got ''",
    ),
    "no inertia": (
        "\nmotor",
        "\nmotor 0 1 1 1 1 1 1 1 1 1 1 0\nm",
        "inertia, slip angle and Stribeck",
    ),
    "no slip angle": (
        "\nmotor",
        "\nmotor 1 1 0 1 1 1 1 1 1 1 1 0\nm",
        "inertia, slip angle and Stribeck",
    ),
    "many elements": ("\nstop", 4 * "\nstop 1 1" + "\nstop", "at most six elements of hysteresis"),
    "no angle": ("\nstop", "\nstop 1 0\nstop", "a torque and an angle above zero"),
    "a stop word": ("\nstop", "\nstop 1 nan\nstop", "expected a finite number, got 'nan'"),
    "fewer torques": (
        "reals torque_cmd N.m torque_cmd[1]\n",
        "",
        "variables of the block torque_cmd, got 1",
    ),
    "friction": (
        "reals friction N.m joint[1].friction\n",
        "",
        "variables of the block friction, got 1",
    ),
    "drive": ("string drive ideal", "string drive fast", "choices with the start value among them"),
}


@pytest.mark.parametrize("name", OF_DRIVES)
def test_broken_data_of_drives_are_refused_with_their_line(tmp_path, name):
    old, new, message = OF_DRIVES[name]
    text = data_of(driven(make_robot(4, 2), np.random.default_rng(4)))
    assert old in text
    file = tmp_path / "robot.txt"
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(CoreError, match=message):
        read_data(file)


@pytest.mark.parametrize("kind", ["plain", "driven"])
def test_random_damage_is_read_or_refused_with_a_sentence(example, sanitized, tmp_path, kind):
    """Lines and words changed, doubled or lost, under sanitizers."""
    damage = build_linked("fuzz_data", tmp_path / "fuzz_data", sanitized, *SANITIZERS)
    file = tmp_path / "robot.txt"
    robot = example if kind == "plain" else driven(make_robot(4, 2), np.random.default_rng(4))
    file.write_text(data_of(robot))
    done = subprocess.run([damage, file, "20000"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    times, refused = (int(word) for word in done.stdout.split() if word.isdigit())
    assert times == 20000
    assert 0.9 * times < refused < times
