"""The linearised robot as a state space, for tools that design and simulate controls."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from coupling.errors import StabilityError
from coupling.files.atomic_file import writing
from coupling.files.extras import extra
from coupling.files.written_files import claim_file
from elastic_robot.linearisation import Linearisation

NPZ, MAT = "state_space.npz", "state_space.mat"
_INPUT_UNITS = {"force": "N", "moment": "N m", "q_cmd": "rad", "qd_cmd": "rad/s"}
_OUTPUT_UNITS = {"v": "m/s", "w": "rad/s", "r": "rad"}


@dataclass(frozen=True)
class NamedStateSpace:
    """x' = A x + B u, y = C x + D u, in SI units and radians.

    Attributes:
        A, B, C, D: The matrices, (2 m, 2 m), (2 m, i), (12, 2 m), (12, i), entries in the units below.

    Example:
        >>> from coupling.files.robot_file import find_robot, load_robot
        >>> from coupling.modes.locked_robot import LockedRobot
        >>> locked = LockedRobot(load_robot(find_robot("manutec_r3")), "linear")
        >>> space = NamedStateSpace.of(locked.linear(np.array([0, 0.2, 0.3, 0, 1, 0]), np.zeros(6)))
        >>> dict(list(zip(space.inputs, space.input_units))[5:8])
        {'moment.z': 'N m', 'q_cmd[1]': 'rad', 'q_cmd[2]': 'rad'}
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    state_units: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]

    @classmethod
    def of(cls, linear: Linearisation) -> NamedStateSpace:
        """Return that of a linearised robot."""
        states = linear.states
        return cls(
            *linear.state_space,
            states,
            linear.inputs,
            linear.outputs,
            tuple("rad/s" if name.endswith(".rate") else "rad" for name in states),
            tuple(
                _INPUT_UNITS.get(name.partition(".")[0].partition("[")[0], "rad/s2")
                for name in linear.inputs
            ),
            tuple(
                _OUTPUT_UNITS.get(name.removeprefix("tcp.")[:-1], "m") for name in linear.outputs
            ),
        )

    def write(self, folder: Path) -> None:
        """Write it for NumPy and for MATLAB, with names and units.

        Raises:
            StabilityError: If a file cannot be written.
        """
        from scipy.io import savemat

        matrices = {name: getattr(self, name) for name in "ABCD"}
        words = ("states", "inputs", "outputs", "state_units", "input_units", "output_units")
        names = {name: getattr(self, name) for name in words}
        with writing(folder, StabilityError):
            arrays = matrices | {name: np.array(values) for name, values in names.items()}
            with claim_file(folder / NPZ).open("wb") as stream:
                np.savez(stream, allow_pickle=False, **arrays)
            cells = {name: np.array(values, dtype=object) for name, values in names.items()}
            savemat(claim_file(folder / MAT), {**matrices, **cells}, oned_as="column")

    def system(self) -> Any:
        """Return it as a `control.StateSpace` of python-control, `tcp.x` being its `tcp_x`.

        Raises:
            RobotFileError: If python-control is not installed.
        """
        control = extra("control", "control", "a system of python-control")
        names = {
            kind: [name.replace(".", "_") for name in getattr(self, kind)]
            for kind in ("states", "inputs", "outputs")
        }
        return control.ss(self.A, self.B, self.C, self.D, **names)
