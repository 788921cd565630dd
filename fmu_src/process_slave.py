"""FMI variables <-> a force law without memory: a process FMU.

Beside this file the FMU's resources hold force_laws.py (the formulas), law.json (which one, and its
constants) and, where the law follows a desired path, desired.npy (time, x, y, z).  All three are
read per instance and by path, so that FMUs in one process share nothing but this file and
slave_refusal.py.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import sys
from dataclasses import astuple, dataclass
from functools import cached_property
from math import isfinite
from pathlib import Path
from types import ModuleType
from typing import Any

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from slave_refusal import refusal, require_host

require_host("Process", {"numpy": "numpy"})

import numpy as np

# Value references: tcp.x .. tcp.qw, force.x .. moment.z, anchor.x .. anchor.kzz.
POSE, WRENCH, SPRING = range(7), range(7, 13), range(13, 25)
_UPPER = np.triu_indices(3)  # xx, xy, xz, yy, yz, zz
LAST_TIME = 1 << 30  # by which python_host reads the end of the last step
_SOURCE = Path(__file__).read_bytes()
_NAMES = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]
_HEADER = b"elastic-robot process state 1\n"
_DIGEST = hashlib.sha256().digest_size


@dataclass(frozen=True)
class ProcessState:
    """State of an instance: the law remembers nothing, so it is what was set and computed last.

    Attributes:
        guid: GUID of the FMU that it belongs to.
        time, end: Start and end of the last step [s].
        stepped: Whether there was a step.
        values: Values of all variables.
    """

    guid: str
    time: float
    end: float
    stepped: bool
    values: tuple[float, ...]

    def to_bytes(self) -> bytes:
        """Return the state as bytes; equal states give equal bytes."""
        content = json.dumps(astuple(self)).encode()
        return _HEADER + hashlib.sha256(content).digest() + content

    @classmethod
    def of(cls, data: bytes) -> ProcessState:
        """Return the state of its bytes.

        Raises:
            ValueError: If they are no state, or damaged.
        """
        digest, content = data[len(_HEADER) :][:_DIGEST], data[len(_HEADER) + _DIGEST :]
        if not data.startswith(_HEADER) or hashlib.sha256(content).digest() != digest:
            raise ValueError(
                f"state: expected an unchanged one that this FMU has saved, got {len(data)} other bytes"
            )
        guid, time, end, stepped, values = json.loads(content)
        return cls(guid, time, end, stepped, tuple(values))


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

    @cached_property
    def _guid(self) -> str:
        return Path(self.resources, "guid.txt").read_text(encoding="utf-8").strip()

    def _get_fmu_state(self) -> ProcessState:
        """Return the state, an object that PythonFMU keeps for the host."""
        values = tuple(self._values.tolist())
        return ProcessState(self._guid, self._time, self._end, self._stepped, values)

    def _set_fmu_state(self, state: ProcessState | bytes) -> None:
        """Go back to a state of this instance or of another one of the same FMU."""
        try:
            opened = ProcessState.of(state) if isinstance(state, bytes) else state
        except ValueError as error:
            raise refusal(self, error) from error
        if opened.guid != self._guid:
            raise refusal(
                self, f"state: expected one of FMU {self._guid}, got one of {opened.guid}"
            )
        self._time, self._end, self._stepped = opened.time, opened.end, opened.stepped
        self._values[:] = opened.values

    @staticmethod
    def _fmu_state_to_bytes(state: ProcessState | bytes) -> bytes:
        return state if isinstance(state, bytes) else state.to_bytes()

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> bytes:
        # Opened when it is set, where there is an instance to refuse it.
        return bytes(data)

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
