"""Robots with motors for tests of the native FMU, alone and beside the model in Python."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from native_fmu import NativeFmu

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks
from elastic_robot.body import Body
from elastic_robot.commands import Command, CommandedMotion, LastStep
from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive
from elastic_robot.fmi.interface import Mode
from elastic_robot.gear_parts import KinematicError
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand


def one_joint(drive: Drive, gravity: float = 0.0, stiffness: float = 1e6) -> Robot:
    """A link of 10 kg m^2 about its joint, horizontal."""
    link = Body(mass=10.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 7.5, 7.5))
    joint = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link, stiffness, damping=200.0, drive=drive)
    return Robot("arm", (joint,), gravity=(0.0, 0.0, -gravity), tcp_position=(1.0, 0.0, 0.0))


def geared(robot: Robot, rng: np.random.Generator, load_friction: bool = True) -> Robot:
    """The robot with errors in all gears, balancers and, if wanted, friction with the load."""

    def joint(own: Joint) -> Joint:
        errors = (
            KinematicError(
                rng.uniform(2e-5, 1e-4), rng.uniform(50.0, 200.0), rng.uniform(0.0, 6.0)
            ),
            KinematicError(rng.uniform(1e-4, 3e-4), 1.0, 1.0),
        )
        own = replace(own, kinematic_error=errors)
        if own.drive is None:
            return own
        points = tuple((a, rng.uniform(-500.0, 500.0)) for a in np.linspace(-1.0, 1.0, 9))
        share = rng.uniform(0.02, 0.2) if load_friction else 0.0
        return replace(own, balancer=points, drive=replace(own.drive, load_friction=share))

    return replace(robot, joints=tuple(map(joint, robot.joints)))


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
        mode: dynamic or quasistatic.
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
        mode: Mode = "dynamic",
    ) -> None:
        self.fmu = built(robot, folder)
        self.slaves = [
            self.fmu.start(
                self.fmu.slave(), q, tolerance, drive=drive, torque_curve=curve, mode=mode
            )
            for tolerance in tolerances
        ]
        self.model = ElasticRobot(robot, curve, mode == "quasistatic", exact, drive)
        self.names = {k: [v.name for v in b.variables] for k, b in all_blocks(robot).items()}
        self.model.reset(0.0, HeldCommand(0.0, q, 0.0 * q, 0.0 * q), Load())
        self.time, self.keeps_last = 0.0, mode == "dynamic"
        self._last: LastStep | None = None

    def step(
        self,
        length: float,
        q: np.ndarray,
        qd: np.ndarray,
        wrench: Sequence[float] = (0.0,) * 6,
        torque: Sequence[float] = (),
        qdd: np.ndarray | None = None,
    ) -> None:
        """Move all on under commands, a wrench and torques of motors."""
        qdd = 0.0 * q if qdd is None else qdd
        torque = torque if len(torque) else np.zeros(len(self.names["torque_cmd"]))
        told = {"q_cmd": q, "qd_cmd": qd, "qdd_cmd": qdd, "wrench": wrench, "torque_cmd": torque}
        for slave in self.slaves:
            for key, values in told.items():
                self.fmu.set(slave, dict(zip(self.names[key], values, strict=True)))
            slave.doStep(self.time, length)
        end, command = self.time + length, Command(q, qd, qdd, np.full(len(q), np.nan))
        motion = CommandedMotion.after(self._last, command, self.time, length)
        self.model.step(end, motion, Load(np.array(wrench)), np.array(torque))
        self._last = motion.past(end, self._last) if self.keeps_last else None
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
