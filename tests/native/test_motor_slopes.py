"""Directional derivatives over steps of robots with motors, against differences of whole steps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from native_fmu import NativeFmu
from native_motors import built, geared
from random_robots import driven, limited, make_robot

from elastic_robot.description import Robot

STEP = 4e-3
WIDTHS = {"force": 1e-1, "moment": 1e-1, "q_cmd": 1e-6, "qd_cmd": 1e-4, "qdd_cmd": 1e-2}
WIDTHS |= {"torque_cmd": 1e-1, "friction": 1e-3, "hysteresis": 1e-3, "damping": 1e-2}
PARAMETERS = ("friction", "hysteresis", "damping")


@dataclass(frozen=True)
class Setting:
    """A robot under forces that come and go.

    Attributes:
        robot, drive: The robot and what moves its drives.
        steps: Number of steps.
        rate: Of the drives' commands [rad/s].
        share: Of the differences that agree: others cross an edge of friction, at rest or with the load.
    """

    robot: Robot
    drive: str
    steps: int = 8
    rate: float = 0.0
    share: float = 1.0


def robot_of(seed: int, joints: int, load_friction: bool | None = None) -> Robot:
    """Driven; with errors, balancers and, if wanted, friction with the load where it is not None."""
    rng = np.random.default_rng(seed)
    robot = driven(make_robot(seed, joints), rng)
    return robot if load_friction is None else geared(robot, rng, load_friction)


def weightless(robot: Robot, limit: float) -> Robot:
    return replace(limited(robot, limit), gravity=(0.0, 0.0, 0.0))


SETTINGS = {
    "slips and sticks, servo": Setting(robot_of(9, 3), "servo", 25, share=0.99),
    "slips and sticks, torque": Setting(robot_of(9, 3), "torque", 25, share=0.99),
    "at torque limits": Setting(weightless(robot_of(8, 3), 60.0), "servo", 15, 0.1, 0.99),
    "at torque limits, 4 joints": Setting(
        weightless(robot_of(11, 4), 60.0), "servo", 15, 0.1, 0.99
    ),
    "geared": Setting(robot_of(9, 3, True), "ideal", rate=1.0, share=0.95),
    "geared, servo": Setting(robot_of(9, 3, True), "servo", rate=1.0, share=0.95),
    # Torques without a servo let those of the gears change their sign in steps that differ then.
    "geared, torque": Setting(robot_of(9, 3, False), "torque", share=0.95),
}


def width_of(name: str) -> float:
    """Change of an input or parameter that shows its slope."""
    return WIDTHS[name.split(".")[-1 if name.startswith("joint") else 0].split("[")[0]]


def slopes(
    fmu: NativeFmu, slave: FMU2Slave, before, time: float, name: str, outputs: Sequence[str]
) -> np.ndarray:
    """Slopes of outputs at a step's end by an input or parameter at its start.

    Central differences that are halved once and extrapolated.
    """
    ends, width = {}, width_of(name)
    for part in (1.0, -1.0, 0.5, -0.5):
        slave.setFMUstate(before)
        fmu.set(slave, {name: fmu.get(slave, name)[0] + part * width})
        slave.doStep(time, STEP)
        ends[part] = np.array(fmu.get(slave, *outputs))
    coarse = (ends[1.0] - ends[-1.0]) / (2.0 * width)
    return (4.0 * (ends[0.5] - ends[-0.5]) / width - coarse) / 3.0


@pytest.mark.parametrize("name", SETTINGS)
def test_derivatives_of_steps_with_motors_are_slopes(tmp_path, name):
    """By loads, commands and parameters, relative to the largest of each kind of output."""
    setting, rng = SETTINGS[name], np.random.default_rng(9)
    fmu, count = built(setting.robot, tmp_path), len(setting.robot.joints)
    moved = [i + 1 for i, joint in enumerate(setting.robot.joints) if joint.drive is not None]
    start, rate = rng.uniform(-0.5, 0.5, (2, count)) * [[1.0], [setting.rate]]
    slave = fmu.start(fmu.slave(), start, 1e-10, drive=setting.drive, torque_curve="linear")
    torques = [f"torque_cmd[{i}]" for i in moved]
    kinds = ("q_cmd", "qd_cmd") if setting.drive == "servo" else ("q_cmd", "qd_cmd", "qdd_cmd")
    limits = {joint.drive.torque_limit for joint in setting.robot.joints if joint.drive}
    commands = [] if limits != {None} else [f"{kind}[{i}]" for kind in kinds for i in moved]
    # A motor at its limit answers its command by rounding alone.
    knowns = ["force.z", "moment.x", *(torques if setting.drive == "torque" else commands)]
    knowns += [f"joint[{moved[0]}].{key}" for key in PARAMETERS]
    variables = fmu.description.modelVariables
    outputs = [v.name for v in variables if v.causality == "output" and v.type == "Real"]
    rows: dict[str, list[int]] = {}
    for k, output in enumerate(outputs):
        rows.setdefault(output.split("[")[0].split(".")[0], []).append(k)
    apart, at_limit = [], set()
    for k in range(setting.steps):
        time = k * STEP
        fmu.set(slave, {"force.z": 300.0 * np.sin(40.0 * time), "moment.x": 20.0})
        if setting.drive == "torque":
            fmu.set(slave, dict.fromkeys(torques, 60.0 * np.sin(25.0 * time)))
        else:
            fmu.set(slave, {f"q_cmd[{i + 1}]": q for i, q in enumerate(start + rate * time)})
            fmu.set(slave, {f"qd_cmd[{i + 1}]": value for i, value in enumerate(rate)})
        before = slave.getFMUstate()
        slave.doStep(time, STEP)
        after = slave.getFMUstate()
        carried = np.abs(np.array(fmu.get(slave, *outputs))[rows["motor_torque"]])
        at_limit |= {
            bool(torque > 0.999 * limit) for torque in carried for limit in limits if limit
        }
        for known in knowns:
            found = slave.getDirectionalDerivative(fmu.of(outputs), fmu.of([known]), [1.0])
            expected = slopes(fmu, slave, before, time, known, outputs)
            slave.setFMUstate(after)
            for places in rows.values():
                error = np.abs(np.array(found)[places] - expected[places]).max()
                scale = np.abs(expected[places]).max()
                apart.append(error / (scale + 1e-9 / width_of(known)))
    assert np.median(apart) < 1e-6
    assert np.quantile(apart, setting.share) < 1e-4
    assert at_limit == ({False, True} if limits != {None} else set())
