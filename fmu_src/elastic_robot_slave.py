"""FMI variables <-> ElasticRobot, nothing else.

PythonFMU puts the FMU's resources folder on the module path and imports this file by its name
(`elastic_robot_entry.py`); modules of the host or of another FMU may answer instead of the FMU's own.
So everything that belongs to an instance is read from its own `resources` in `__init__`, no module
has state, and an instance refuses to run with another version's modules.
"""

from __future__ import annotations

import ctypes
import functools
import os
import sys
from collections.abc import Callable
from math import isfinite
from pathlib import Path
from typing import Any, TypeVar, cast

from pythonfmu import Fmi2Slave

try:
    if sys.version_info < (3, 11):  # noqa: UP036  (the host's Python may be any)
        raise ImportError("there is no support for so old a version")
    import numpy as np
    import pinocchio  # noqa: F401  (an import error is told here)
    import scipy  # noqa: F401
except ImportError as error:
    text = (
        "this FMU's host: expected Python 3.11 or newer, numpy, scipy and pin, got"
        f" {sys.executable or sys.prefix} {sys.version.split()[0]} ({error}): python -m pip install"
        " numpy scipy pin, or see documentation/externalDependencies.txt in the FMU"
    )
    print(f"ElasticRobot: {text}", file=sys.stderr, flush=True)
    raise ImportError(text) from error

import elastic_robot
from elastic_robot.chain import build_chain
from elastic_robot.commands import Command, CommandedMotion, Past
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError, ParameterError, StateError
from elastic_robot.fingerprint import fingerprint
from elastic_robot.fmi import lifecycle
from elastic_robot.fmi.fmu_state import FmuState, PackedState, require_own
from elastic_robot.fmi.inputs import DERIVATIVES, OF_DERIVATIVES
from elastic_robot.fmi.interface import MODEL_NAME, TOLERANCE, blocks
from elastic_robot.fmi.real_variables import RealVariables
from elastic_robot.fmi.string_variables import StringVariables
from elastic_robot.motion import Drives
from elastic_robot.parameters import Parameters
from elastic_robot.robot import ElasticRobot
from elastic_robot.settings import SETTINGS
from elastic_robot.tool_load import NO_RATE, NO_SPRING, ContactSpring, Load, symmetric
from elastic_robot.trajectory import Trajectory, read_trajectory

_Method = TypeVar("_Method", bound=Callable[..., Any])

# Of the 6x6 compliance the translations' symmetric block is given: xx xy xz yy yz zz.
_UPPER = np.triu_indices(3)


class _RefusedError(Exception):
    """What PythonFMU is told of an error; it logs the `repr`, formatted like printf."""

    def __repr__(self) -> str:
        return str(self).replace("%", "%%")


def _allowed(call: lifecycle.Call) -> Callable[[_Method], _Method]:
    """Refuse a call out of its time, and let the user see every error.

    FMI passes on a status only, and the log may be off.
    """

    def decorate(method: _Method) -> _Method:
        @functools.wraps(method)
        def wrapper(self: ElasticRobotSlave, *args: Any) -> Any:
            try:
                call.require(self._phase)
                return method(self, *args)
            except BaseException as error:  # whatever it is, it is raised again
                raise self._refusal(error) from error

        return cast(_Method, wrapper)

    return decorate


class ElasticRobotSlave(Fmi2Slave):
    """The FMU: inputs, outputs and parameters of `elastic_robot.fmi.interface`."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        # PythonFMU's library leaves it there for every instance; its builder takes it back.
        if "visible" in kwargs and self.resources in sys.path:
            sys.path.remove(self.resources)
        self.modelName = MODEL_NAME  # PythonFMU's builder names the binaries by it
        resources = Path(self.resources)
        self._require_own_modules(resources)
        self._fingerprint = fingerprint(resources)
        self._robot = Robot.from_json((resources / "robot.json").read_text(encoding="utf-8"))
        table = blocks(self._robot)
        strings = table.pop("strings").variables
        self._reals = RealVariables(table)
        self._strings = StringVariables(strings, first=len(self._reals))
        self._torsions = build_chain(self._robot).torsions
        # None: to be computed from the present inputs and parameters.
        self._model: ElasticRobot | None = None
        self._trajectory: Trajectory | None = None
        # What the last step leaves to a moving robot that follows the inputs.
        self._past: Past | None = None
        # The model's own time is that since the start: late times have few digits for seconds.
        self._start = self._time = 0.0
        self._tolerance = TOLERANCE
        self._phase = lifecycle.Phase.INSTANTIATED
        self._parameters_changed = False
        # Blocks of outputs whose values are those of the present state.
        self._computed: set[str] = set()
        self._wrench, self._wrench_rate = map(self._reals.block, ("wrench", "wrench_rate"))
        anchor = ("anchor", "anchor_velocity", "anchor_stiffness")
        self._anchor = tuple(self._reals.block(key) for key in anchor)
        self._commands = tuple(self._reals.block(key) for key in ("q_cmd", "qd_cmd", "qdd_cmd"))
        # Rates of qdd_cmd; nan where the master has told none.
        self._jerk = np.full(len(self._robot.joints), np.nan)

    def _refusal(self, error: BaseException) -> _RefusedError:
        text = f"{self.instance_name}: {error}"
        print(text, file=sys.stderr, flush=True)
        # PythonFMU's binary gives up its references to these three at every exception, and once more
        # when the instance is freed; without others that is a use after free.
        for owned in (self, type(self), self.log_queue):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(owned))
        return _RefusedError(text)

    def _require_own_modules(self, resources: Path) -> None:
        loaded, own = Path(elastic_robot.__file__).parent, resources / "elastic_robot"
        if loaded.resolve() != own.resolve() and fingerprint(loaded) != fingerprint(own):
            raise ElasticRobotError(
                f"{self.instance_name}: elastic_robot: expected this FMU's own, got another version that"
                f" this process has loaded from {loaded}: run FMUs of each version in their own process"
            )

    @_allowed(lifecycle.SETUP)
    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Take the start time, and the tolerance as the error allowed at the TCP [m]."""
        if not isfinite(start_time):
            raise ParameterError(f"start time: expected a finite number, got {start_time} s")
        if tolerance is not None and not (isfinite(tolerance) and tolerance >= 0.0):
            raise ParameterError(
                f"tolerance: expected a number > 0, or 0 for {TOLERANCE:g} m, got {tolerance} m"
            )
        self._start = self._time = start_time
        if tolerance:
            self._tolerance = tolerance
        self._model = None
        self._computed.clear()

    @_allowed(lifecycle.ENTER)
    def enter_initialization_mode(self) -> None:
        """Enter initialisation mode."""
        self._phase = lifecycle.Phase.INITIALISING

    @_allowed(lifecycle.EXIT)
    def exit_initialization_mode(self) -> None:
        """Compute the initial state from the inputs and parameters set by now."""
        self._initialised()
        self._phase = lifecycle.Phase.RUNNING

    @_allowed(lifecycle.TERMINATE)
    def terminate(self) -> None:
        """End the simulation; values and states are still there."""
        self._phase = lifecycle.Phase.TERMINATED

    @_allowed(lifecycle.STEP)
    def do_step(self, current_time: float, step_size: float) -> bool:
        """Move on by a communication step; inputs are those at its start."""
        self._require_step(current_time, step_size)
        if step_size > 0.0:
            model = self._initialised()
            end = self._end(model, current_time, step_size)
            drives = self._drives(model.time, end)
            self._step(model, end, drives, self._load())
            if isinstance(drives, CommandedMotion) and self._strings["mode"] == "dynamic":
                self._past = drives.past(end, self._past)
            self._time = current_time + step_size
            self._computed.clear()
        return True

    def _require_step(self, current_time: float, step_size: float) -> None:
        if not isfinite(step_size) or step_size < 0.0:
            raise ParameterError(f"step size: expected a finite number >= 0, got {step_size} s")
        if not abs(current_time - self._time) <= SETTINGS.slack_at(self._time):
            raise ParameterError(
                f"step start: expected the last step's end, {self._time} s, got {current_time} s"
            )

    def _end(self, model: ElasticRobot, current_time: float, step_size: float) -> float:
        """Return a step's end since the start: in the model's time while the master's cannot tell."""
        told, own = (current_time - self._start) + step_size, model.time + step_size
        rounding = SETTINGS.time_rounding(max(abs(self._start), abs(current_time)))
        return own if abs(told - own) <= rounding else told

    def _step(self, model: ElasticRobot, end: float, drives: Drives, load: Load) -> None:
        if not self._parameters_changed:
            model.step(end, drives, load)
            return
        before = model.snapshot
        model.parameters = self._checked_parameters()
        try:
            model.step(end, drives, load)
        except ElasticRobotError:
            model.snapshot = before
            raise
        self._parameters_changed = False

    @_allowed(lifecycle.GET)
    def get_real(self, vrs: list[int]) -> list[float]:
        """Return values; an output is computed when it is read."""
        if not vrs:
            return []
        places = self._reals.places(vrs)
        for key in places.outputs - self._computed:
            value = getattr(self._initialised(), key)()
            self._reals.block(key)[:] = value[_UPPER] if key == "compliance" else value.ravel()
            self._computed.add(key)
        return self._reals.get(vrs, places)

    @_allowed(lifecycle.SET)
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set inputs and parameters."""
        if not vrs:
            return
        if vrs[0] >= OF_DERIVATIVES:  # python_host's fmi2SetRealInputDerivatives
            self._set_derivatives([vr - OF_DERIVATIVES for vr in vrs], values)
        elif self._reals.set(vrs, values).has_parameters:
            self._parameters_changed = True
        if self._phase < lifecycle.Phase.RUNNING:
            self._model = None
            self._computed.clear()

    def _set_derivatives(self, vrs: list[int], values: list[float]) -> None:
        """Take first derivatives of inputs; those without a place here have no effect."""
        for (key, k), value in zip(self._reals.inputs(vrs, values), values, strict=True):
            if key == "qdd_cmd":
                self._jerk[k] = value
            elif key in DERIVATIVES:
                self._reals.block(DERIVATIVES[key])[k] = value

    @_allowed(lifecycle.SET)
    def set_string(self, vrs: list[int], values: list[str | None]) -> None:
        """Set the fixed parameters, before initialisation ends."""
        if not vrs:
            return
        lifecycle.SET_FIXED.require(self._phase)
        self._strings.set(vrs, values)
        self._model = None
        self._computed.clear()

    @_allowed(lifecycle.GET)
    def get_string(self, vrs: list[int]) -> list[str]:
        """Return the fixed parameters."""
        return self._strings.get(vrs)

    @_allowed(lifecycle.GET)
    def get_integer(self, vrs: list[int]) -> list[int]:
        """Refuse: there are no integer variables."""
        self._require_none(vrs, "integer")
        return []

    @_allowed(lifecycle.SET)
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Refuse: there are no integer variables."""
        self._require_none(vrs, "integer")

    @_allowed(lifecycle.GET)
    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Refuse: there are no boolean variables."""
        self._require_none(vrs, "boolean")
        return []

    @_allowed(lifecycle.SET)
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Refuse: there are no boolean variables."""
        self._require_none(vrs, "boolean")

    def _require_none(self, vrs: list[int], kind: str) -> None:
        if vrs:
            raise ParameterError(
                f"{kind} variable {vrs[0]} is asked for; this FMU has real and string variables only"
            )

    def _initialised(self) -> ElasticRobot:
        """Return the model, in its initial state if it was not computed yet."""
        if self._model is not None:
            return self._model
        strings = self._strings.values
        model = self._new_model(strings, self._tolerance)
        model.parameters = self._checked_parameters()
        self._trajectory = self._read_trajectory(strings)
        undeflected = strings["initial_state"] == "undeflected"
        self._past = None
        model.reset(0.0, self._drives(0.0, 0.0), self._load(), undeflected)
        self._computed.clear()
        self._parameters_changed = False
        self._model = model
        return model

    def _new_model(self, strings: dict[str, str], tolerance: float) -> ElasticRobot:
        quasistatic = strings["mode"] == "quasistatic"
        return ElasticRobot(self._robot, strings["torque_curve"], quasistatic, tolerance)

    def _read_trajectory(self, strings: dict[str, str]) -> Trajectory | None:
        if not strings["trajectory"]:
            return None
        path = Path(strings["trajectory"])
        packed = Path(self.resources, path)  # of use where a master unpacks it no one knows where
        file = packed if os.path.exists(packed) and not os.path.exists(path) else path
        return read_trajectory(file, len(self._robot.joints))

    def _drives(self, start: float, end: float) -> Drives:
        """Return the drives over a step, in the model's time."""
        if self._trajectory is not None:
            return self._trajectory.since(self._start)
        q, qd, qdd = (block.copy() for block in self._commands)
        command = Command(q, qd, qdd, self._jerk.copy())
        return CommandedMotion.after(self._past, command, start, end - start)

    def _load(self) -> Load:
        """Return what acts on the tool; without stiffness the anchor is nowhere."""
        wrench, rate = self._wrench.copy(), NO_RATE
        if self._wrench_rate.any():
            rate = self._wrench_rate.copy()
        position, velocity, entries = self._anchor
        if not entries.any():
            return Load(wrench, NO_SPRING, rate)
        spring = ContactSpring(position.copy(), velocity.copy(), symmetric(entries))
        return Load(wrench, spring, rate)

    def _checked_parameters(self) -> Parameters:
        reals = self._reals
        for key, above in (("stiffness", True), ("damping", False), ("backlash", False)):
            reals.require_at_least_zero(key, above)
        own = Parameters.of(self._robot)
        backlash = np.zeros_like(own.backlash)
        backlash[self._torsions] = reals.block("backlash")
        return Parameters(
            gravity=reals.block("gravity").copy(),
            stiffness=reals.block("stiffness").copy(),
            damping=reals.block("damping").copy(),
            backlash=backlash,
            tables=own.tables,
        )

    @_allowed(lifecycle.ANY)
    def _get_fmu_state(self) -> FmuState:
        """Return the state, an object that PythonFMU keeps for the host."""
        trajectory = None if self._model is None else self._trajectory
        return FmuState(
            fingerprint=self._fingerprint,
            start=self._start,
            time=self._time,
            tolerance=self._tolerance,
            phase=self._phase,
            parameters_changed=self._parameters_changed,
            values=self._reals.values.copy(),
            jerk=self._jerk.copy(),
            strings=tuple(self._strings.values.values()),
            model=None if self._model is None else self._model.snapshot,
            past=self._past,
            trajectory=trajectory,
            trajectory_digest="" if trajectory is None else trajectory.digest,
        )

    @_allowed(lifecycle.ANY)
    def _set_fmu_state(self, state: FmuState | PackedState) -> None:
        """Go back to a state of this instance or of another one of the same FMU."""
        if isinstance(state, PackedState):
            state = state.open(self._fingerprint, Parameters.of(self._robot))
        require_own(state.fingerprint, self._fingerprint)
        strings = self._strings.of(state.strings)
        model, trajectory = None, None
        if state.model is not None:
            same = (strings, state.tolerance) == (self._strings.values, self._tolerance)
            model = self._model if same else None
            model = model or self._new_model(strings, state.tolerance)
            trajectory = state.trajectory
            if trajectory is None and state.trajectory_digest:
                trajectory = self._read_trajectory(strings)
                if trajectory is None or trajectory.digest != state.trajectory_digest:
                    raise StateError(
                        f"trajectory {strings['trajectory']}: expected the motion that the state was"
                        " saved with, got another"
                    )
            model.snapshot = state.model
        self._model, self._trajectory, self._strings.values = model, trajectory, strings
        self._start, self._time, self._tolerance = state.start, state.time, state.tolerance
        self._phase, self._parameters_changed = state.phase, state.parameters_changed
        self._reals.values[:] = state.values
        self._past, self._jerk = state.past, state.jerk.copy()
        self._computed.clear()

    @staticmethod
    def _fmu_state_to_bytes(state: FmuState | PackedState) -> bytes:
        return state.to_bytes()

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> PackedState:
        # Damaged bytes are refused when they are set, where there is an instance to tell it; our library
        # in front of PythonFMU's does so at once.
        return PackedState(data)
