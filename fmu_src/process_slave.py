"""FMI variables <-> a force law without memory: a process FMU.

Beside this file the FMU's resources hold force_laws.py (the formulas), law.json (which one, and its
constants) and, where the law follows a desired path, desired.npy (time, x, y, z).  All three are
read per instance and by path, so that FMUs in one process share nothing but this file and
slave_refusal.py.
"""

from __future__ import annotations

import importlib.util
import json
import sys
from math import isfinite
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from slave_refusal import refusal

# Value references: tcp.x .. tcp.qw, force.x .. moment.z, anchor.x .. anchor.kzz.
POSE, WRENCH, SPRING = range(7), range(7, 13), range(13, 25)
_UPPER = np.triu_indices(3)  # xx, xy, xz, yy, yz, zz
LAST_TIME = 1 << 30  # by which python_host reads the end of the last step
_SOURCE = Path(__file__).read_bytes()
_NAMES = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]


class ProcessSlave(Fmi2Slave):
    """The force at the pose that is set, for the time at which a step starts, and how it changes.

    A robot that moves on from that position p0 to p feels F + K (p0 - p), with K = -dF/dp, from a
    contact spring whose anchor is p0.  Where the law follows a desired path, the anchor goes along with
    it over the step that the master takes meanwhile and over the one in which the robot feels it.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.modelName = "Process"
        resources = Path(self.resources)
        if (resources / Path(__file__).name).read_bytes() != _SOURCE:
            raise ImportError(
                "process_slave: expected this FMU's own, got another version that this process has"
                f" loaded from {__file__}: run FMUs of each version in their own process"
            )
        law = json.loads((resources / "law.json").read_text(encoding="utf-8"))
        constants = {name: np.array(value) for name, value in law["constants"].items()}
        path = resources / "desired.npy"
        desired = np.load(path) if path.is_file() else None
        laws = _module(resources / "force_laws.py")
        self._law = laws.ForceLaw(law["law"], constants, desired)
        self._time = self._end = 0.0
        self._values = np.zeros(SPRING.stop)
        self._values[: POSE.stop] = law["pose_at_start"]
        self._stepped = False

    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Take the start time."""
        self._time = self._end = start_time

    def exit_initialization_mode(self) -> None:
        """Compute the first wrench."""
        self._evaluate(0.0)
        self.log(f"starts at {self._time} s", Fmi2Status.ok, "logEvents")

    def terminate(self) -> None:
        """End the simulation."""
        self.log(f"ends at {self._end} s", Fmi2Status.ok, "logEvents")

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute the wrench of the pose, which is the robot's at the step's start."""
        self._time, self._end = current_time, current_time + step_size
        self._evaluate(step_size)
        self._stepped = True
        return True

    def get_real(self, vrs: list[int]) -> list[float]:
        """Return values; before the first step wrench and spring follow the pose at once."""
        if vrs and vrs[0] == LAST_TIME:
            return [self._end]
        if not self._stepped:
            self._evaluate(0.0)
        return self._values[list(vrs)].tolist()

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set the pose."""
        for vr, value in zip(vrs, values, strict=True):
            if vr not in POSE:
                raise refusal(self, "force, moment and spring are outputs and cannot be set")
            if not isfinite(value):
                sentence = f"{_NAMES[vr]}: expected a finite number, got {value}"
                raise refusal(self, sentence, may_retry=True)
        self._values[list(vrs)] = values

    def _evaluate(self, step: float) -> None:
        position = self._values[:3].copy()
        reaction = self._law.reaction(np.array([self._time]), position[None])
        now, felt, after = self._law.place(self._time + step * np.arange(3.0))
        velocity = (after - felt) / step if step else np.zeros(3)
        self._values[WRENCH.start :] = np.concatenate(
            [
                reaction.force[0],
                np.zeros(3),
                position + felt - now,
                velocity,
                reaction.stiffness[0][_UPPER],
            ]
        )


def _module(file: Path) -> ModuleType:
    """Import a file under a name that no other FMU takes, and keep it to this instance."""
    name = f"force laws of {file.parent}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up by name while they are made
    spec.loader.exec_module(module)
    del sys.modules[name]
    return module
