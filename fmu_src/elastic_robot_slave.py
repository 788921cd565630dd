"""PythonFMU's calls <-> an instance of the FMU, nothing else.

PythonFMU puts the FMU's resources folder on the module path and imports this file by its name
(`slave_entry.py`); modules of the host or of another FMU may answer instead of the FMU's own.
So everything that belongs to an instance is read from its own `resources` in `__init__`, no module
has state, and an instance refuses to run with another version's modules.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from slave_refusal import refusal, require_host

require_host(
    "ElasticRobot",
    {"numpy": "numpy", "scipy": "scipy", "pinocchio": "pin"},
    ", or see documentation/externalDependencies.txt in the FMU",
)

import elastic_robot
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError, ParameterError
from elastic_robot.fingerprint import fingerprint
from elastic_robot.fmi import lifecycle
from elastic_robot.fmi.fmu_state import FmuState, PackedState
from elastic_robot.fmi.inputs import LAST_TIME, OF_DERIVATIVES
from elastic_robot.fmi.instance import Instance
from elastic_robot.fmi.interface import MODEL_NAME

_Method = TypeVar("_Method", bound=Callable[..., Any])


def _allowed(call: lifecycle.Call) -> Callable[[_Method], _Method]:
    """Refuse a call out of its time, and let the user see every error.

    FMI passes on a status only, and the log may be off.
    """

    def decorate(method: _Method) -> _Method:
        @functools.wraps(method)
        def wrapper(self: ElasticRobotSlave, *args: Any) -> Any:
            try:
                call.require(self._instance.phase)
                return method(self, *args)
            except BaseException as error:  # whatever it is, it is raised again
                raise refusal(self, error) from error

        return cast(_Method, wrapper)

    return decorate


class ElasticRobotSlave(Fmi2Slave):
    """The FMU: inputs, outputs and parameters of `elastic_robot.fmi.interface`."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.modelName = MODEL_NAME  # PythonFMU's builder names the binaries by it
        resources = Path(self.resources)
        self._require_own_modules(resources)
        robot = Robot.from_json((resources / "robot.json").read_text(encoding="utf-8"))
        self._instance = Instance(robot, resources, fingerprint(resources))

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
        """Take start and stop, and the relative tolerance."""
        self._instance.set_up(start_time, stop_time, tolerance)

    @_allowed(lifecycle.ENTER)
    def enter_initialization_mode(self) -> None:
        """Enter initialisation mode."""
        self._instance.phase = lifecycle.Phase.INITIALISING

    @_allowed(lifecycle.EXIT)
    def exit_initialization_mode(self) -> None:
        """Compute the initial state from the inputs and parameters set by now."""
        self._instance.initialised()
        self._warn(self._instance.trajectory_beyond_limits())
        self._instance.phase = lifecycle.Phase.RUNNING
        self.log(self._instance.start_text, Fmi2Status.ok, "logEvents")

    @_allowed(lifecycle.TERMINATE)
    def terminate(self) -> None:
        """End the simulation; values and states are still there."""
        self._instance.phase = lifecycle.Phase.TERMINATED
        self.log(f"ends at {self._instance.time} s", Fmi2Status.ok, "logEvents")

    @_allowed(lifecycle.STEP)
    def do_step(self, current_time: float, step_size: float) -> bool:
        """Move on by a communication step; inputs are those at its start."""
        said = self._instance.step(current_time, step_size)
        if said:  # in the log only: some masters stop at a step that is not OK
            self.log(said, Fmi2Status.ok, "logStatusWarning")
        return True

    @_allowed(lifecycle.GET)
    def get_real(self, vrs: list[int]) -> list[float]:
        """Return values; an output is computed when it is read."""
        if vrs and vrs[0] == LAST_TIME:  # python_host's fmi2GetRealStatus
            lifecycle.RESULT.require(self._instance.phase)
            return [self._instance.time]
        return self._instance.get_reals(vrs)

    @_allowed(lifecycle.SET)
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set inputs and parameters."""
        if vrs and vrs[0] >= OF_DERIVATIVES:  # python_host's fmi2SetRealInputDerivatives
            ignored = self._instance.set_derivatives([vr - OF_DERIVATIVES for vr in vrs], values)
            if ignored:
                self._warn(
                    f"derivative of {ignored}: expected that of force, moment, qdd_cmd or the anchor's"
                    " position, got one without effect"
                )
        else:
            self._warn(self._instance.set_reals(vrs, values))

    @_allowed(lifecycle.SET)
    def set_string(self, vrs: list[int], values: list[str | None]) -> None:
        """Set the fixed parameters, before initialisation ends."""
        if not vrs:
            return
        lifecycle.SET_FIXED.require(self._instance.phase)
        self._instance.set_strings(vrs, values)

    @_allowed(lifecycle.GET)
    def get_string(self, vrs: list[int]) -> list[str]:
        """Return the fixed parameters."""
        return self._instance.get_strings(vrs)

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

    def _warn(self, text: str) -> None:
        if text:
            self.log(text, Fmi2Status.warning, "logStatusWarning")

    def _require_none(self, vrs: list[int], kind: str) -> None:
        if vrs:
            raise ParameterError(
                f"{kind} variable {vrs[0]} is asked for; this FMU has real and string variables only"
            )

    @_allowed(lifecycle.ANY)
    def _get_fmu_state(self) -> FmuState:
        """Return the state, an object that PythonFMU keeps for the host."""
        return self._instance.state

    @_allowed(lifecycle.ANY)
    def _set_fmu_state(self, state: FmuState | PackedState) -> None:
        """Go back to a state of this instance or of another one of the same FMU."""
        self._instance.state = state

    @staticmethod
    def _fmu_state_to_bytes(state: FmuState | PackedState) -> bytes:
        return state.to_bytes()

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> PackedState:
        # Damaged bytes are refused when they are set, where there is an instance to tell it; our library
        # in front of PythonFMU's does so at once.
        return PackedState(data)
