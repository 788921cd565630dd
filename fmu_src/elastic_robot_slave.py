"""The robot's FMU in Python, to be read: FMI variables <-> `ElasticRobot`, as a slave of PythonFMU.

    set values, initialise    drives, load and parameters from the inputs; the robot at rest, `reset`
    set inputs, step          the same from the inputs at the step's start, `ElasticRobot.step`
    get an output             the method of `ElasticRobot` with the name of the output's block

`elastic_robot.fmi.interface` has the variables, docs/fmu.md what they mean.  The FMU to simulate with
is the native one (`native/fmi`), which also has states, derivatives, model exchange and the checks of
values and of the order of calls that the standards ask for.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from dataclasses import replace
from math import inf, isfinite
from pathlib import Path
from typing import Any, TypeVar, cast

from pythonfmu import Fmi2Slave, Real, String

from slave_refusal import refusal, require_host

require_host(
    "ElasticRobot",
    {"numpy": "numpy", "scipy": "scipy", "pinocchio": "pin"},
    ", or see documentation/externalDependencies.txt in the FMU",
)

import numpy as np

import elastic_robot
from elastic_robot.commands import Command, CommandedMotion, LastStep
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError, ParameterError
from elastic_robot.fingerprint import fingerprint
from elastic_robot.fmi.interface import MODEL_NAME, SLIPPED, STARTS, blocks
from elastic_robot.fmi.tolerance import allowed_error
from elastic_robot.motors import require_drives
from elastic_robot.plane_contact import NO_CONTACT, PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import NO_SPRING, ContactSpring, Load, symmetric
from elastic_robot.trajectory import Drives, Trajectory, read_trajectory

_Method = TypeVar("_Method", bound=Callable[..., Any])
# Of the 6x6 compliance the translations' symmetric block is given: xx xy xz yy yz zz.
_UPPER = np.triu_indices(3)


def _shown(method: _Method) -> _Method:
    """Show every error of a call to the user: FMI passes on a status only, and the log may be off."""

    @functools.wraps(method)
    def call(slave: ElasticRobotSlave, *arguments: Any) -> Any:
        try:
            return method(slave, *arguments)
        except Exception as error:
            raise refusal(slave, error) from error

    return cast(_Method, call)


class ElasticRobotSlave(Fmi2Slave):
    """An instance of the FMU."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.modelName = MODEL_NAME  # PythonFMU's builder names the binaries by it
        self._folder = Path(self.resources)
        self._require_modules_of_this_fmu()
        self._description = Robot.from_json(self._text("robot.json"))
        starts = json.loads(self._text(STARTS)) if (self._folder / STARTS).is_file() else {}
        self._values: dict[str, np.ndarray] = {}  # of real variables by block
        self._strings: dict[str, str] = {}
        self._register(starts)
        self._robot: ElasticRobot | None = None  # None: its initial state is not computed
        self._initialised = self._is_tuned = False
        self._trajectory: Trajectory | None = None
        self._last_step: LastStep | None = None
        self._start, self._relative_tolerance = 0.0, 0.0
        self._outputs: dict[str, np.ndarray] = {}  # those of the present state that were asked for

    def _text(self, name: str) -> str:
        return (self._folder / name).read_text(encoding="utf-8")

    def _require_modules_of_this_fmu(self) -> None:
        """Raise where another FMU of this process, or its host, has loaded another version's modules."""
        loaded, packed = Path(elastic_robot.__file__).parent, self._folder / "elastic_robot"
        if loaded.resolve() != packed.resolve() and fingerprint(loaded) != fingerprint(packed):
            raise ElasticRobotError(
                f"{self.instance_name}: elastic_robot: expected this FMU's own, got another version that"
                f" this process has loaded from {loaded}: run FMUs of each version in their own process"
            )

    def _register(self, starts: dict[str, str]) -> None:
        """Register the variables; PythonFMU numbers them in this order."""
        for key, block in blocks(self._description, starts).items():
            if key == "strings":
                for variable in block.variables:
                    self._register_string(variable.name, str(variable.start))
                continue
            self._values[key] = np.array([float(v.start or 0.0) for v in block.variables])
            for k, variable in enumerate(block.variables):
                self._register_real(variable.name, key, k, block.causality)

    def _register_string(self, name: str, start: str) -> None:
        self._strings[name] = start

        def set_value(value: str) -> None:
            if self._initialised:
                raise ParameterError(f"{name} is fixed: set it before initialisation ends")
            self._strings[name], self._robot = value, None

        variable = String(name, getter=lambda: self._strings[name], setter=set_value)
        self.register_variable(variable, nested=False)

    def _register_real(self, name: str, key: str, k: int, causality: str) -> None:
        is_output = causality == "output"

        def set_value(value: float) -> None:
            if is_output:
                raise ParameterError(f"{name} is an output and cannot be set")
            if not isfinite(value):
                raise ParameterError(f"{name}: expected a finite number, got {value}")
            self._values[key][k] = value
            self._is_tuned = self._is_tuned or causality == "parameter"
            if not self._initialised:  # the initial state follows what is set until then
                self._robot = None

        def get_value() -> float:
            return float((self._output(key) if is_output else self._values[key])[k])

        self.register_variable(Real(name, getter=get_value, setter=set_value), nested=False)

    @_shown
    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Take the start time and the relative tolerance."""
        self._start, self._relative_tolerance = start_time, tolerance or 0.0

    @_shown
    def exit_initialization_mode(self) -> None:
        """Compute the initial state from the inputs and parameters set by now."""
        self._at_rest()
        self._initialised = True

    @_shown
    def do_step(self, current_time: float, step_size: float) -> bool:
        """Move on by a communication step; inputs are those at its start."""
        if not (isfinite(current_time) and 0.0 <= step_size < inf):
            raise ParameterError(
                f"step: expected a finite time and size >= 0, got {current_time} s and {step_size} s"
            )
        robot, end = self._at_rest(), current_time - self._start + step_size
        if not end > robot.time:
            return True
        drives = self._drives(robot.time, end)
        if self._is_tuned:
            self._tune(robot)
        robot.step(end, drives, self._load(), self._values["torque_cmd"].copy())
        if isinstance(drives, CommandedMotion) and self._strings["mode"] == "dynamic":
            self._last_step = drives.past(end, self._last_step)
        self._outputs.clear()
        return True

    @_shown
    def get_real(self, vrs: list[int]) -> list[float]:
        """Return values; an output is computed when it is read."""
        return super().get_real(vrs)

    @_shown
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set inputs and parameters."""
        super().set_real(vrs, values)

    @_shown
    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Set fixed parameters."""
        super().set_string(vrs, values)

    @_shown
    def _get_fmu_state(self) -> dict[str, Any]:
        """Refuse: PythonFMU's own states are the variables alone, without the robot's state."""
        raise ParameterError("states are asked for; this FMU has none, the native one has")

    def _output(self, key: str) -> np.ndarray:
        """Return the values of a block of outputs in the present state."""
        robot = self._at_rest()
        if key not in self._outputs:
            value = getattr(robot, key)()
            self._outputs[key] = value[_UPPER] if key == "compliance" else value.ravel()
        return self._outputs[key]

    def _at_rest(self) -> ElasticRobot:
        """Return the robot, in its initial state if that was not computed yet."""
        if self._robot is not None:
            return self._robot
        strings = self._strings
        quasistatic = strings["mode"] == "quasistatic"
        require_drives(
            self._description, strings["drive"], quasistatic, bool(strings["trajectory"])
        )
        error = allowed_error(float(self._values["tolerance"][0]), self._relative_tolerance)
        curve, drive = strings["torque_curve"], strings["drive"]
        robot = ElasticRobot(self._description, curve, quasistatic, error, drive)
        self._tune(robot)
        self._trajectory, self._last_step = self._read_trajectory(), None
        state = strings["initial_state"]
        robot.reset(
            0.0,
            self._drives(0.0, 0.0),
            self._load(),
            undeflected=state == "undeflected",
            slipped=SLIPPED.get(state, 0),
            torque=self._values["torque_cmd"].copy(),
        )
        self._outputs.clear()
        self._robot = robot
        return robot

    def _read_trajectory(self) -> Trajectory | None:
        """Return the drives' motion from a file among the resources, or else where the host finds it."""
        if not self._strings["trajectory"]:
            return None
        file = Path(self._strings["trajectory"])
        packed = self._folder / file
        found = packed if packed.exists() else file
        return read_trajectory(found, len(self._description.joints))

    def _drives(self, start: float, end: float) -> Drives:
        """Return the drives over a step [s], in the model's time, which begins with the experiment."""
        if self._trajectory is not None:
            return self._trajectory.since(self._start)
        q, qd, qdd = (self._values[key].copy() for key in ("q_cmd", "qd_cmd", "qdd_cmd"))
        command = Command(q, qd, qdd, jerk=np.full(len(q), np.nan))
        return CommandedMotion.after(self._last_step, command, start, end - start)

    def _load(self) -> Load:
        """Return the load on the tool; without stiffness the anchor is nowhere."""
        values = {key: value.copy() for key, value in self._values.items()}
        stiffness, spring, contact = values["anchor_stiffness"], NO_SPRING, NO_CONTACT
        if values["contact"][0] != 0.0:
            contact = PlaneContact.of(np.append(values["contact"], values["contact_normal"]))
        if stiffness.any() or contact.holds:
            place, velocity = values["anchor"], values["anchor_velocity"]
            spring = ContactSpring(place, velocity, symmetric(stiffness))
        return Load(values["wrench"], spring, values["wrench_rate"], contact)

    def _tune(self, robot: ElasticRobot) -> None:
        """Give a robot the tunable parameters; tilts have no backlash, nor all gears hysteresis."""
        values = {key: value.copy() for key, value in self._values.items()}
        backlash, hysteresis = np.zeros((2, robot.chain.elastic_count))
        backlash[robot.chain.torsions] = values["backlash"]
        hysteresis[robot.chain.elements.gears] = values["hysteresis"]
        tuned: dict[str, Any] = {
            key: values[key] for key in ("gravity", "stiffness", "damping", "friction")
        }
        tuned |= {"backlash": backlash, "hysteresis": hysteresis}
        robot.parameters = replace(robot.parameters, **tuned)
        self._is_tuned = False
