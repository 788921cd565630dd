"""Robots with motors for tests of the native FMU, alone and beside the model in Python."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from native_fmu import NativeFmu

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive
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
    """A robot in the model in Python and in instances of the native FMU, moved together.

    Args:
        robot: The robot.
        folder: Where the FMU is built.
        q: Drives at the start, at rest [rad], (n,).
        drive: How they move.
        curve: Torque curve.
        tolerances: Of the instances [m], one of each.
        exact: Of the model in Python [m].
    """

    def __init__(
        self,
        robot: Robot,
        folder,
        q: np.ndarray,
        drive: str,
        curve: str = "linear",
        tolerances: Sequence[float] = (1e-9,),
        exact: float = 1e-9,
    ) -> None:
        self.fmu = built(robot, folder)
        self.slaves = [
            self.fmu.start(self.fmu.slave(), q, tolerance, drive=drive, torque_curve=curve)
            for tolerance in tolerances
        ]
        self.model = ElasticRobot(robot, curve, tolerance=exact, drive=drive)
        self.names = {k: [v.name for v in b.variables] for k, b in all_blocks(robot).items()}
        self.model.reset(0.0, HeldCommand(0.0, q, 0.0 * q, 0.0 * q), Load())
        self.time = 0.0

    def step(
        self, length: float, q: np.ndarray, qd: np.ndarray, wrench: Sequence[float], torque=()
    ) -> None:
        """Move all on under commands, a wrench and torques of motors."""
        torque = torque if len(torque) else np.zeros(len(self.names["torque_cmd"]))
        told = {"q_cmd": q, "qd_cmd": qd, "wrench": wrench, "torque_cmd": torque}
        for slave in self.slaves:
            for key, values in told.items():
                self.fmu.set(slave, dict(zip(self.names[key], values, strict=True)))
            slave.doStep(self.time, length)
        end, command = self.time + length, HeldCommand(self.time, q, qd, 0.0 * q)
        self.model.step(end, command, Load(np.array(wrench)), np.array(torque))
        self.time = end

    def of_all(self, block: str) -> tuple[np.ndarray, np.ndarray]:
        """Values of a block of outputs, of the instances and of the model."""
        found = [self.fmu.get(slave, *self.names[block]) for slave in self.slaves]
        return np.array(found), getattr(self.model, block)()

    def require_same(self, most: float | Sequence[float], *outputs: str) -> None:
        """Compare blocks of outputs, to the same of all instances or to one value for each."""
        for block in outputs:
            found, expected = self.of_all(block)
            for values, limit in zip(found, np.broadcast_to(most, len(found)), strict=True):
                np.testing.assert_allclose(values, expected, rtol=0, atol=limit, err_msg=block)
