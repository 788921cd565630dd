"""Motors through the FMU: they move as the model's, and refuse what cannot be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pendulum import held, pendulum

from coupling.fmu_export.build import build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks
from elastic_robot.description import Robot
from elastic_robot.gear_parts import Drive, KinematicError
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load

DRIVE = Drive(30.0, 20.0, 4e3, 2e5, friction=20.0, viscous=10.0, stribeck=0.4, torque_limit=5e3)
OUTPUTS = ("deflection", "gear_torque", "motor_torque", "motor_angle", "motor_rate", "rotor_angle")
OUTPUTS += ("rotor_rate", "servo_integral", "presliding", "tcp", "rigid", "velocity", "deviation")
TIME = [0.0, 0.004, 0.011, 0.019, 0.03, 0.05]
FORCE = [0.0, 300.0, 300.0, -800.0, 100.0, 100.0]


def arm(**joint) -> Robot:
    """A motor whose gear has a kinematic error, with a link that hangs at it."""
    values = {"drive": DRIVE, "kinematic_error": (KinematicError(1e-4, 50.0),), **joint}
    return pendulum(gravity=(0.0, 0.0, -9.81), stiffness=1e6, **values)


def names_of(*keys: str) -> list[str]:
    return [variable.name for key in keys for variable in all_blocks(arm())[key].variables]


def job(drive: str, **more) -> dict:
    torque = (
        {"torque_cmd[1]": [200.0, 200.0, -50.0, -50.0, 10.0, 10.0]} if drive == "torque" else {}
    )
    strings = {"torque_curve": "linear", "drive": drive}
    inputs = {"force.z": FORCE, **torque}
    start = {"tcp_tolerance": 1e-9}
    found = {"settings": strings, "time": TIME, "start": start, "inputs": inputs}
    return {**found, "outputs": names_of(*OUTPUTS), **more}


@pytest.mark.parametrize("drive", ["servo", "torque"])
def test_motors_move_as_the_models(run_fmu, tmp_path, drive):
    """Angles and places to 1e-9, rates to 1e-6, torques to 1e-3; slipping, too."""
    order = job(drive)
    (answer,) = run_fmu(build_fmu(arm(), tmp_path / "R.fmu"), order)
    model, rows = ElasticRobot(arm(), "linear", tolerance=1e-9, drive=drive), []
    torques = order["inputs"].get("torque_cmd[1]", [0.0] * len(TIME))
    for k, (end, force, torque) in enumerate(zip(TIME, FORCE, torques, strict=True)):
        load = Load(np.array([0.0, 0.0, force, 0.0, 0.0, 0.0]))
        if k == 0:
            model.reset(0.0, held([0.0]), load, torque=np.array([torque]))
        else:
            model.step(end, held([0.0]), load, np.array([torque]))
        rows.append([getattr(model, key)() for key in OUTPUTS])
    most = {"torque": 1e-3, "integral": 1e-3, "rate": 1e-6, "velocity": 1e-6}
    scale = [most.get(key.split("_")[-1], 1e-9) for key in OUTPUTS]
    scales = np.repeat(scale, [len(value) for value in rows[0]])
    expected = np.array([np.concatenate(row) for row in rows])
    np.testing.assert_allclose(answer["values"] / scales, expected / scales, rtol=0, atol=1.0)
    slipped = np.abs([row[OUTPUTS.index("presliding")] for row in rows]) == DRIVE.slip_angle
    assert 0 < np.count_nonzero(slipped) < len(TIME)


@pytest.mark.parametrize(
    ("drive", "joint", "settings", "words"),
    [
        ("servo", {"drive": None}, {}, "expected ideal, as no joint of the robot has a drive"),
        ("torque", {}, {"mode": "quasistatic"}, "expected mode dynamic and no trajectory"),
        ("fast", {}, {}, "drive: expected one of ideal, servo, torque, got 'fast'"),
    ],
)
def test_drives_that_cannot_be_are_refused_in_a_sentence(
    run_fmu, tmp_path, drive, joint, settings, words
):
    order = job(drive, time=[0.0], inputs={}, outputs=["tcp.x"])
    order["settings"] |= settings
    robot = replace(arm(), joints=(replace(arm().joints[0], **joint),))
    (answer,) = run_fmu(build_fmu(robot, tmp_path / "R.fmu"), order)
    assert words in answer["stderr"]
