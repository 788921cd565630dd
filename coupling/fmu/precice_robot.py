"""A robot's FMU as a participant of preCICE, on pyprecice: one vertex that moves and is pushed.

In every iteration of a time window the robot moves on from the window's start by one step under

    F(t) + K (a(t) - x(t)),    F(t) = F0 + (F1 - F0) t / h,    a(t) = x0 + (x1 - x0) t / h

with the force at the window's start and end as preCICE has it, the tool's positions x0 at its start and
x1 at its end in the iteration before, to which F1 belongs, and the stiffness K = -dF/dx that the process
writes beside its force.  Where the iteration has converged the spring is without load at both ends.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from coupling.errors import HostError, SimulationError
from coupling.fmu.job import FmuError
from coupling.fmu.stepped import SteppedFmu

_AXES = ("x", "y", "z")
_TCP = tuple(f"tcp.{axis}" for axis in (*_AXES, "qx", "qy", "qz", "qw"))
_FORCE = tuple(f"{name}.{axis}" for name in ("force", "force_rate") for axis in _AXES)
_ANCHOR = tuple(f"anchor.{sign}{axis}" for sign in ("", "v") for axis in _AXES)
_STIFFNESS = tuple(f"anchor.k{entry}" for entry in ("xx", "yy", "zz", "xy", "xz", "yz"))


@dataclass(frozen=True)
class PreciceNames:
    """Names in preCICE's configuration; all data are vectors of three numbers on one vertex.

    Attributes:
        participant: The robot.
        mesh: Its mesh.
        position: Data that it writes: position of the TCP, base frame [m].
        force: Data that it reads: force on the tool at the TCP, base axes [N].
        stiffness: Data that it reads, K of the process [N/m]: kxx, kyy, kzz, and kxy, kxz, kyz; empty:
            the force alone is read.
    """

    participant: str = "Robot"
    mesh: str = "Robot-Mesh"
    position: str = "Position"
    force: str = "Force"
    stiffness: tuple[str, ...] = ("Stiffness", "Cross-Stiffness")


@dataclass(frozen=True)
class CoupledMotion:
    """Motion of the tool in a coupled simulation, at the ends of its time windows.

    Attributes:
        time: Times [s], (n,); the first is the start.
        pose: Poses of the TCP, base frame: x, y, z [m] and quaternion x, y, z, w, (n, 7).
        force: Forces on the tool, base axes [N], (n, 3).
        iterations: Number of iterations of the window that ends there, (n,); 0 for the start.
    """

    time: np.ndarray
    pose: np.ndarray
    force: np.ndarray
    iterations: np.ndarray


def run_robot(
    fmu: Path,
    configuration: Path,
    parameters: Mapping[str, float | str] = MappingProxyType({}),
    names: PreciceNames = PreciceNames(),
) -> CoupledMotion:
    """Simulate a robot as a participant of preCICE until the coupling ends.

    The FMU goes back to the window's start by one saved state, which is freed when the next one is made.

    Args:
        fmu: A native FMU of the robot.
        configuration: preCICE's XML file.
        parameters: Start values of the FMU by name, `trajectory` among them.
        names: Names in the configuration.

    Raises:
        HostError: If pyprecice, or the preCICE that it needs, is not there.
        SimulationError: If the FMU cannot be loaded or refuses a value or a step.
    """
    inputs = (*_FORCE, *(_ANCHOR + _STIFFNESS if names.stiffness else ()))
    try:
        with SteppedFmu(fmu, inputs, _TCP, parameters) as robot:
            return _Participant(robot, configuration, names).run()
    except FmuError as cause:
        raise SimulationError(f"{fmu}: {cause}") from cause


class _Participant:
    """The robot between preCICE's calls."""

    def __init__(self, robot: SteppedFmu, configuration: Path, names: PreciceNames) -> None:
        self._robot, self._names = robot, names
        self._precice = _pyprecice().Participant(names.participant, str(configuration), 0, 1)
        self._vertex = self._precice.set_mesh_vertices(names.mesh, np.zeros((1, 3)))

    def run(self) -> CoupledMotion:
        precice, robot = self._precice, self._robot
        before = after = robot.read()
        if precice.requires_initial_data():
            self._write(before)
        precice.initialize()
        rows = [np.concatenate([[robot.time], before, self._read(self._names.force, 0.0), [0.0]])]
        iteration = 0
        while precice.is_coupling_ongoing():
            if precice.requires_writing_checkpoint():
                robot.keep()
            window = precice.get_max_time_step_size()
            iteration += 1
            after = robot.step(self._inputs(before, after, window), window)
            force = self._read(self._names.force, window)
            self._write(after)
            precice.advance(window)
            if precice.requires_reading_checkpoint():
                robot.go_back()
                continue
            rows.append(np.concatenate([[robot.time], after, force, [iteration]]))
            before, iteration = after, 0
        precice.finalize()
        time, pose, forces, iterations = np.split(np.array(rows), [1, 8, 11], axis=1)
        return CoupledMotion(time[:, 0], pose, forces, iterations[:, 0].astype(int))

    def _inputs(self, before: np.ndarray, after: np.ndarray, window: float) -> np.ndarray:
        """Return the inputs of a step over a window, from the poses before it and at its end."""
        first, last = (self._read(self._names.force, at) for at in (0.0, window))
        values = [first, (last - first) / window]
        if self._names.stiffness:
            values += [before[:3], (after[:3] - before[:3]) / window]
            values += [self._read(name, window) for name in self._names.stiffness]
        return np.concatenate(values)

    def _read(self, data: str, at: float) -> np.ndarray:
        row: np.ndarray = self._precice.read_data(self._names.mesh, data, self._vertex, at)[0]
        return row

    def _write(self, pose: np.ndarray) -> None:
        names = self._names
        self._precice.write_data(names.mesh, names.position, self._vertex, pose[None, :3])


def _pyprecice() -> Any:
    try:
        return importlib.import_module("precice")
    except (ImportError, RuntimeError) as cause:  # or a library that it needs
        raise HostError(
            f"preCICE: expected pyprecice 3 and the preCICE that it needs, got {cause}: install preCICE,"
            " then pip install pyprecice (docs/precice.md)"
        ) from cause
