"""Robots with motors for tests of the native FMU, alone and beside the model in Python."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from native_fmu import NativeFmu

from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.description import Body, Joint, Robot
from elastic_robot.fmi.interface import blocks
from elastic_robot.gear_parts import Drive
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand


def one_joint(drive: Drive, gravity: float = 0.0, stiffness: float = 1e6) -> Robot:
    """A link of 10 kg m^2 about its joint, horizontal."""
    link = Body(mass=10.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 7.5, 7.5))
    joint = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link, stiffness, damping=200.0, drive=drive)
    return Robot("arm", (joint,), gravity=(0.0, 0.0, -gravity), tcp_position=(1.0, 0.0, 0.0))


def built(robot: Robot, folder) -> NativeFmu:
    return NativeFmu(build_fmu(robot, folder / "R.fmu", BuildOptions("native")), folder / "fmu")


class Both:
    """A robot in the native FMU and in the model in Python, moved together.

    Args:
        robot: The robot.
        folder: Where the FMU is built.
        q: Drives at the start, at rest [rad], (n,).
        drive: How they move.
        curve: Torque curve.
        tolerance: Of the FMU [m].
        exact: Of the model in Python [m].
    """

    def __init__(
        self,
        robot: Robot,
        folder,
        q: np.ndarray,
        drive: str,
        curve: str = "linear",
        tolerance: float = 1e-9,
        exact: float = 1e-9,
    ) -> None:
        self.fmu = built(robot, folder)
        self.slave = self.fmu.start(self.fmu.slave(), q, tolerance, drive=drive, torque_curve=curve)
        self.model = ElasticRobot(robot, curve, tolerance=exact, drive=drive)
        self.names = {k: [v.name for v in b.variables] for k, b in blocks(robot).items()}
        self.model.reset(0.0, HeldCommand(0.0, q, 0.0 * q, 0.0 * q), Load())
        self.time = 0.0

    def step(
        self, length: float, q: np.ndarray, qd: np.ndarray, wrench: Sequence[float], torque=()
    ) -> None:
        """Move both on under commands, a wrench and torques of motors."""
        torque = torque if len(torque) else np.zeros(len(self.names["torque_cmd"]))
        told = {"q_cmd": q, "qd_cmd": qd, "wrench": wrench, "torque_cmd": torque}
        for key, values in told.items():
            self.fmu.set(self.slave, dict(zip(self.names[key], values, strict=True)))
        self.slave.doStep(self.time, length)
        end, command = self.time + length, HeldCommand(self.time, q, qd, 0.0 * q)
        self.model.step(end, command, Load(np.array(wrench)), np.array(torque))
        self.time = end

    def of_both(self, block: str) -> tuple[np.ndarray, np.ndarray]:
        """Values of a block of outputs, of the FMU and of the model."""
        found = self.fmu.get(self.slave, *self.names[block])
        return np.array(found), getattr(self.model, block)()

    def require_same(self, most: float, *outputs: str) -> None:
        """Compare blocks of outputs."""
        for block in outputs:
            found, expected = self.of_both(block)
            np.testing.assert_allclose(found, expected, rtol=0, atol=most, err_msg=block)
