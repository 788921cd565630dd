"""The robot's data inside the native FMU: what the C core refuses."""

from __future__ import annotations

import subprocess
from dataclasses import replace

import numpy as np
import pytest
from native_core import Core, CoreError, with_settings
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
