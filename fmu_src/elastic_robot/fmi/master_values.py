"""Inputs, parameters and strings that a master has set, and what they are to the model."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from elastic_robot.chain import build_chain
from elastic_robot.commands import Command
from elastic_robot.description import Robot
from elastic_robot.fmi.inputs import DERIVATIVES, limits_of
from elastic_robot.fmi.interface import STARTS, blocks
from elastic_robot.fmi.real_variables import RealVariables
from elastic_robot.fmi.string_variables import StringVariables
from elastic_robot.motors import require_drives
from elastic_robot.parameters import Parameters
from elastic_robot.plane_contact import NO_CONTACT, PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import NO_RATE, NO_SPRING, ContactSpring, Load, symmetric
from elastic_robot.trajectory import Trajectory, read_trajectory


class MasterValues:
    """Values of all variables of an instance.

    Args:
        robot: The robot, with whose parameters the instance begins.
        resources: The FMU's resources; start values of strings, and a trajectory, may lie there.

    Attributes:
        reals: The real variables, outputs among them.
        strings: The string variables.
        jerk: Rates of qdd_cmd [rad/s^3], (n,); nan where the master has given none.
    """

    def __init__(self, robot: Robot, resources: Path) -> None:
        starts = resources / STARTS
        texts = json.loads(starts.read_text(encoding="utf-8")) if starts.is_file() else {}
        table = blocks(robot, texts)
        strings = table.pop("strings").variables
        self.reals = RealVariables(table)
        self.strings = StringVariables(strings, first=len(self.reals))
        self.jerk = np.full(len(robot.joints), np.nan)
        self._robot, self._resources = robot, resources
        self._drives = table["q_cmd"].variables
        limits = np.array([limits_of(variable) for variable in self._drives])
        self._low, self._high = limits.T
        self._beyond = np.zeros(len(limits), dtype=bool)
        self._last, self._jumps = np.full(len(limits), np.nan), 0
        chain = build_chain(robot)
        self._torsions, self._gears = chain.torsions, chain.elements.gears
        self._wrench, self._wrench_rate = map(self.reals.block, ("wrench", "wrench_rate"))
        anchor = ("anchor", "anchor_velocity", "anchor_stiffness")
        self._anchor = tuple(self.reals.block(key) for key in anchor)
        self._contact, self._normal = map(self.reals.block, ("contact", "contact_normal"))
        self._commands = tuple(self.reals.block(key) for key in ("q_cmd", "qd_cmd", "qdd_cmd"))

    def command_beyond_limits(self) -> str:
        """Return the drive that is commanded beyond its limits, once until it is back; else ""."""
        q = self._commands[0]
        beyond = (q < self._low) | (q > self._high)
        new = np.flatnonzero(beyond & ~self._beyond)
        self._beyond = beyond
        if not len(new):
            return ""
        i = int(new[-1])
        return (
            f"{self._drives[i].shown}: expected an angle within the drive's limits, {self._range(i)},"
            f" got {q[i]} rad"
        )

    def motion_without_rates(self) -> str:
        """Return what is wrong where angles jump from step to step without rates, once; else "".

        Asked after every step of drives that follow the inputs.
        """
        q, qd, qdd = self._commands
        moved = np.flatnonzero(q != self._last)
        is_first = bool(np.isnan(self._last).any())
        self._last = q.copy()
        if self._jumps > 1:
            return ""
        jumps = len(moved) > 0 and not is_first and not (qd.any() or qdd.any())
        self._jumps = self._jumps + 1 if jumps else 0
        if self._jumps < 2:
            return ""
        return (
            f"{self._drives[moved[0]].shown}: expected qd_cmd and qdd_cmd beside angles that change from"
            " step to step, got zero: each angle is held to the step's end, and the drive jumps to the"
            " next; set all three, or name the motion's file in trajectory"
        )

    def trajectory_beyond_limits(self, motion: Trajectory) -> str:
        """Return a trajectory's violation of the drives' limits, in words; "" without one."""
        beyond = np.argwhere((motion.q < self._low) | (motion.q > self._high))
        if not len(beyond):
            return ""
        k, i = beyond[0]
        return (
            f"trajectory: expected angles within the limits of drive {i + 1}, {self._range(i)}, got"
            f" {motion.q[k, i]} rad at {motion.time[k]} s"
        )

    def _range(self, drive: int) -> str:
        return f"{self._low[drive]} to {self._high[drive]} rad"

    def set_derivatives(self, references: Sequence[int], values: Sequence[float]) -> str:
        """Take first derivatives of inputs; return the name of the first that has no effect, or "".

        Raises:
            ParameterError: If a variable is no input, or a derivative not finite.
        """
        ignored = ""
        inputs = self.reals.inputs(references, values)
        for reference, (key, k), value in zip(references, inputs, values, strict=True):
            if key == "qdd_cmd":
                self.jerk[k] = value
            elif key in DERIVATIVES:
                self.reals.block(DERIVATIVES[key])[k] = value
            else:
                ignored = ignored or self.reals.name(reference)
        return ignored

    def command(self) -> Command:
        """Return the drives' command."""
        q, qd, qdd = (block.copy() for block in self._commands)
        return Command(q, qd, qdd, self.jerk.copy())

    def load(self) -> Load:
        """Return the load on the tool; without stiffness or contact the anchor is nowhere."""
        wrench, rate = self._wrench.copy(), NO_RATE
        if self._wrench_rate.any():
            rate = self._wrench_rate.copy()
        position, velocity, entries = self._anchor
        contact = NO_CONTACT
        if self._contact[0] != 0.0:
            contact = PlaneContact.of(np.append(self._contact, self._normal))
        if not entries.any() and not contact.holds:
            return Load(wrench, NO_SPRING, rate)
        spring = ContactSpring(position.copy(), velocity.copy(), symmetric(entries))
        return Load(wrench, spring, rate, contact)

    def torque(self) -> np.ndarray:
        """Return the torques that motors without servo are given [N m], (motors,)."""
        return self.reals.block("torque_cmd").copy()

    def parameters(self) -> Parameters:
        """Return the tunable parameters."""
        reals = self.reals
        own = Parameters.of(self._robot)
        backlash = np.zeros_like(own.backlash)
        backlash[self._torsions] = reals.block("backlash")
        hysteresis = np.zeros_like(own.hysteresis)
        hysteresis[self._gears] = reals.block("hysteresis")
        return Parameters(
            gravity=reals.block("gravity").copy(),
            stiffness=reals.block("stiffness").copy(),
            damping=reals.block("damping").copy(),
            backlash=backlash,
            hysteresis=hysteresis,
            tables=own.tables,
            friction=reals.block("friction").copy(),
        )

    def new_model(self, strings: dict[str, str], tolerance: float) -> ElasticRobot:
        """Return a model without a state.

        Args:
            strings: Values of the string variables by name.
            tolerance: Error allowed at the TCP over a path [m].
        """
        curve, drive = strings["torque_curve"], strings["drive"]
        quasistatic = strings["mode"] == "quasistatic"
        require_drives(self._robot, drive, quasistatic, bool(strings["trajectory"]))
        return ElasticRobot(self._robot, curve, quasistatic, tolerance, drive)

    def read_trajectory(self, strings: dict[str, str]) -> Trajectory | None:
        """Return the drives' motion; None where they follow the inputs.

        Raises:
            TrajectoryError: If the file is none.
        """
        if not strings["trajectory"]:
            return None
        path = Path(strings["trajectory"])
        packed = Path(
            self._resources, path
        )  # not replaced by a file in the master's working folder
        file = packed if os.path.exists(packed) else path
        return read_trajectory(file, len(self._robot.joints))
