"""Robots with motors for tests of the native FMU, and the state in which it starts them."""

from __future__ import annotations

import numpy as np
from driven_robot import DrivenRobot
from native_fmu import NativeFmu

from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.description import Body, Joint, Robot
from elastic_robot.gear_parts import Drive


def one_joint(drive: Drive, gravity: float = 0.0, stiffness: float = 1e6) -> Robot:
    """A link of 10 kg m^2 about its joint, horizontal."""
    link = Body(mass=10.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 7.5, 7.5))
    joint = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link, stiffness, damping=200.0, drive=drive)
    return Robot("arm", (joint,), gravity=(0.0, 0.0, -gravity), tcp_position=(1.0, 0.0, 0.0))


def built(robot: Robot, folder) -> NativeFmu:
    return NativeFmu(build_fmu(robot, folder / "R.fmu", BuildOptions("native")), folder / "fmu")


def start_of(fmu: NativeFmu, slave, own: DrivenRobot, q: np.ndarray) -> np.ndarray:
    """The state in which the FMU has started, as the equation has it."""
    m, motors = len(own.stiffness), own.driven
    x = np.array(fmu.get(slave, *(f"deflection[{k + 1}]" for k in range(m))))
    torque = np.array(fmu.get(slave, *(f"motor_torque[{i + 1}]" for i in motors)))
    stops = np.array(fmu.get(slave, *(f"elongation[{k + 1}]" for k in range(len(own.stop_of)))))
    still = np.zeros(len(motors))
    return np.concatenate([x, 0.0 * x, q[motors], still, torque, stops, still])
