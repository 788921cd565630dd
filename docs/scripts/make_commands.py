"""Write the table of docs/import.md on inputs between communication points: make commands."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu_export.build import BuildOptions, build_fmu
from docs.scripts.page import finish, replace, table

RATES = (64, 128, 256)  # steps a second
DURATION = 2.5  # [s]
POSTURE = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
AMPLITUDE, OMEGA = 0.2, 2.0 * np.pi * 0.8
FORCE, FORCE_OMEGA = 300.0, 2.0 * np.pi * 5.0
# The tolerance leaves less than what is shown [m].
TOLERANCE = 1e-8


@dataclass(frozen=True)
class Swing:
    """All axes swing about a posture.

    Attributes:
        phase: Angle of the swing at time 0 [rad]; 0: at a turning point.
    """

    phase: float

    def at(self, time: float) -> np.ndarray:
        """Return q, q', q'' and q''' at a time, (4, 6)."""
        c, s = np.cos(OMEGA * time + self.phase), np.sin(OMEGA * time + self.phase)
        orders = np.array([-c, OMEGA * s, OMEGA**2 * c, -(OMEGA**3) * s])
        motion = AMPLITUDE * np.repeat(orders[:, None], len(POSTURE), axis=1)
        motion[0] += POSTURE
        return motion


class Fmu:
    """The native FMU of the example robot.

    Args:
        folder: Folder to build and unpack it in.
    """

    def __init__(self, folder: Path) -> None:
        file = build_fmu(
            load_robot(shipped_robots()["icme2008"]), folder / "R.fmu", BuildOptions("native")
        )
        self._folder = folder / "fmu"
        fmpy.extract(str(file), unzipdir=str(self._folder))
        self._description = fmpy.read_model_description(str(self._folder))
        self._references = {v.name: v.valueReference for v in self._description.modelVariables}
        self._trajectory = folder / "motion.npz"

    def of(self, *names: str) -> list[int]:
        """Return value references; a name before `[` stands for all joints."""
        joints = range(1, len(POSTURE) + 1)
        each = [[f"{n}{i}]" for i in joints] if n.endswith("[") else [n] for n in names]
        return [self._references[name] for group in each for name in group]

    def path(
        self,
        rate: int,
        first: np.ndarray,
        give: Callable[[FMU2Slave, float], None],
        trajectory: str = "",
    ) -> np.ndarray:
        """Return the TCP at the ends of steps, (k, 3) [m].

        Args:
            rate: Steps a second.
            first: Command at time 0, (4, 6).
            give: Function that gives the inputs of a step that starts at a time.
            trajectory: File of the joint motion; empty: inputs.
        """
        slave = FMU2Slave(
            guid=self._description.guid,
            unzipDirectory=str(self._folder),
            modelIdentifier=self._description.coSimulation.modelIdentifier,
            instanceName="robot",
        )
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.setReal(self.of("tcp_tolerance"), [TOLERANCE])
        slave.setString(self.of("trajectory"), [trajectory])
        slave.enterInitializationMode()
        self.command(slave, first)
        slave.exitInitializationMode()
        path = []
        for k in range(round(DURATION * rate)):
            give(slave, k / rate)
            slave.doStep(k / rate, 1.0 / rate)
            path.append(slave.getReal(self.of("tcp.x", "tcp.y", "tcp.z")))
        slave.terminate()
        slave.freeInstance()
        return np.array(path)

    def command(self, slave: FMU2Slave, motion: np.ndarray) -> None:
        """Command q, q', q''."""
        slave.setReal(self.of("q_cmd[", "qd_cmd[", "qdd_cmd["), motion[:3].ravel().tolist())

    def along(self, swing: Swing, rate: int) -> np.ndarray:
        """Return the TCP with the swing as `trajectory`."""
        time = np.arange(round(DURATION * 1024) + 1) / 1024
        rows = np.array([swing.at(t)[:3].ravel() for t in time])
        names = [f"{n}{i + 1}" for n in ("q", "qd", "qdd") for i in range(len(POSTURE))]
        data = np.column_stack([time, rows])
        np.savez(self._trajectory, columns=["time", *names], data=data)
        return self.path(rate, swing.at(0.0), lambda slave, time: None, str(self._trajectory))


def commanded(fmu: Fmu, swing: Swing, jerk: bool, orders: int = 3) -> list[float]:
    """Return the largest distances from the trajectory at each rate [m].

    Args:
        fmu: The robot.
        swing: Its motion.
        jerk: Whether the derivative of q'' is given as well.
        orders: How many of q, q', q'' are given; the others are zero.
    """

    def give(slave: FMU2Slave, time: float) -> None:
        motion = swing.at(time)
        motion[orders:3] = 0.0
        fmu.command(slave, motion)
        if jerk:
            slave.setRealInputDerivatives(fmu.of("qdd_cmd["), [1] * 6, motion[3].tolist())

    exact = fmu.along(swing, RATES[-1])
    return [
        _largest(
            fmu.path(rate, swing.at(0.0), give), exact[RATES[-1] // rate - 1 :: RATES[-1] // rate]
        )
        for rate in RATES
    ]


def pushed(fmu: Fmu, with_rate: bool) -> list[float]:
    """Return the largest distances from the path with 4096 steps a second under a force [m]."""

    def give(slave: FMU2Slave, time: float) -> None:
        force = FORCE * np.sin(FORCE_OMEGA * time)
        slave.setReal(fmu.of("force.z"), [force])
        if with_rate:
            slope = FORCE * FORCE_OMEGA * np.cos(FORCE_OMEGA * time)
            slave.setReal(fmu.of("force_rate.z"), [slope])

    rest = np.zeros((4, len(POSTURE)))
    rest[0] = POSTURE
    fine = 16 * RATES[-1]

    def finely(slave: FMU2Slave, time: float) -> None:
        force = [FORCE * np.sin(FORCE_OMEGA * (time + shift / fine)) for shift in (0.0, 1.0)]
        slave.setReal(fmu.of("force.z", "force_rate.z"), [force[0], fine * (force[1] - force[0])])

    exact = fmu.path(fine, rest, finely)
    return [
        _largest(fmu.path(rate, rest, give), exact[fine // rate - 1 :: fine // rate])
        for rate in RATES
    ]


def _largest(path: np.ndarray, exact: np.ndarray) -> float:
    return float(np.linalg.norm(path - exact, axis=1).max())


def commands_table() -> str:
    """Return the table as measured here."""
    with tempfile.TemporaryDirectory() as name:
        fmu = Fmu(Path(name))
        turning, full = Swing(0.0), Swing(0.5 * np.pi)
        rows = {
            "all axes from a turning point": commanded(fmu, turning, jerk=False),
            "from full swing": commanded(fmu, full, jerk=False),
            "from full swing, with the derivative of `qdd_cmd`": commanded(fmu, full, jerk=True),
            "from a turning point, q and q' alone": commanded(fmu, turning, False, orders=2),
            "from a turning point, q alone": commanded(fmu, turning, False, orders=1),
            "force, held": pushed(fmu, with_rate=False),
            "force, with its rate": pushed(fmu, with_rate=True),
        }
    orders = {what: np.log2(errors[-2] / errors[-1]) for what, errors in rows.items()}
    return table(
        ("", *(f"{rate} 1/s" for rate in RATES), "order"),
        [
            (what, *(f"{1e6 * error:.2g}" for error in errors), f"{orders[what]:.1f}")
            for what, errors in rows.items()
        ],
    )


if __name__ == "__main__":
    sys.exit(finish(lambda: replace("import", "commands", commands_table())))
