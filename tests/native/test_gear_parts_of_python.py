"""Kinematic errors, load friction and balancers: the native FMU against the readable model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from native_motors import built
from random_robots import make_robot, with_gear_parts

from elastic_robot.commands import Command, CommandedMotion, LastStep
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


def robot_of(seed: int) -> Robot:
    """With motors whose friction grows with the load in all gears."""
    robot = with_gear_parts(make_robot(seed, 1 + seed % 6), seed)
    drive = Drive(20.0, 20.0, 2e3, friction=10.0, load_friction=0.1)
    joints = (replace(j, drive=drive if j.stiffness else None) for j in robot.joints)
    return replace(robot, joints=tuple(joints))


def outputs_of(model: ElasticRobot) -> dict[str, list[str]]:
    """Methods of the model and the FMU's names of what they return."""
    chain = model.chain
    gears = [f"[{i + 1}]" for i in chain.elastic_joint[chain.torsions]]
    joints = [f"[{i + 1}]" for i in range(chain.joint_count)]
    return {
        "tcp": [f"tcp.{axis}" for axis in POSE],
        "rigid": [f"rigid.{axis}" for axis in POSE],
        "velocity": [f"tcp.{kind}{axis}" for kind in "vw" for axis in "xyz"],
        "deviation": [f"deviation.{kind}{axis}" for kind in ("", "r") for axis in "xyz"],
        "deflection": [f"deflection[{k + 1}]" for k in range(chain.elastic_count)],
        "gear_torque": [f"gear_torque{gear}" for gear in gears],
        "motor_torque": [f"motor_torque{gear}" for gear in gears],
        "motor_angle": [f"motor_angle{joint}" for joint in joints],
        "motor_rate": [f"motor_rate{joint}" for joint in joints],
    }


@pytest.mark.parametrize("mode", ["dynamic", "quasistatic"])
@pytest.mark.parametrize("curve", ["linear", "backlash"])
@pytest.mark.parametrize("seed", [1, 2, 4, 5])
def test_both_tell_the_same_of_a_robot_that_moves(tmp_path, seed, curve, mode):
    """Poses and angles to 1e-9, rates and torques to 1e-6 of the largest, over commanded steps."""
    robot, rng = robot_of(seed), np.random.default_rng(seed)
    count = len(robot.joints)
    q0, rate, bend = rng.uniform(-0.5, 0.5, (3, count)) * [[1.0], [1.0], [4.0]]
    fmu = built(robot, tmp_path)
    slave = fmu.start(fmu.slave(), q0, 1e-8, torque_curve=curve, mode=mode)
    own = ElasticRobot(robot, curve, mode == "quasistatic", 1e-8)
    own.reset(0.0, HeldCommand(0.0, q0, 0.0 * q0, 0.0 * q0), Load())
    outputs, time, step, past = outputs_of(own), 0.0, 4e-3, None
    for _ in range(5):
        q, qd = q0 + rate * time + 0.5 * bend * time**2, rate + bend * time
        told = {"q_cmd": q, "qd_cmd": qd, "qdd_cmd": bend}
        fmu.set(slave, {f"{k}[{i + 1}]": v[i] for k, v in told.items() for i in range(count)})
        slave.doStep(time, step)
        past = moved(own, Command(q, qd, bend, np.full(count, np.nan)), time, step, past)
        time += step
        for method, names in outputs.items():
            if names:
                expected = getattr(own, method)()
                scale = max(1e-3, np.abs(expected).max())
                most = 1e-6 * scale if method.endswith(("torque", "velocity")) else 1e-9
                np.testing.assert_allclose(fmu.get(slave, *names), expected, rtol=0, atol=most)


def moved(
    model: ElasticRobot, command: Command, time: float, step: float, past: LastStep | None
) -> LastStep | None:
    """Step the model as an FMU does; return the step as the next one's last."""
    motion = CommandedMotion.after(past, command, time, step)
    model.step(time + step, motion, Load())
    return None if model._quasistatic else motion.past(time + step, past)
