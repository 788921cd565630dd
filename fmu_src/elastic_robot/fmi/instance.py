"""An instance of the FMU between two calls: variables <-> ElasticRobot.

Whoever calls knows when a call may be made (`lifecycle.py`).  `native/fmi/instance.h` is the same in C.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite
from pathlib import Path

import numpy as np

from elastic_robot.commands import CommandedMotion, LastStep
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError, ParameterError, StateError
from elastic_robot.fmi.fmu_state import FmuState, PackedState, require_own
from elastic_robot.fmi.interface import SLIPPED
from elastic_robot.fmi.lifecycle import Phase
from elastic_robot.fmi.master_values import MasterValues
from elastic_robot.fmi.tolerance import TOLERANCE, allowed_error
from elastic_robot.parameters import Parameters
from elastic_robot.robot import ElasticRobot
from elastic_robot.settings import SETTINGS
from elastic_robot.trajectory import Drives, Trajectory

# Of the 6x6 compliance the translations' symmetric block is given: xx xy xz yy yz zz.
_UPPER = np.triu_indices(3)


class Instance:
    """Values, model and time.

    Args:
        resources: The FMU's resources.
        fingerprint: Hash of robot and model; states of another are refused.

    Attributes:
        phase: State of the instance's life cycle.
    """

    def __init__(self, robot: Robot, resources: Path, fingerprint: str) -> None:
        self.phase = Phase.INSTANTIATED
        self._robot, self._fingerprint = robot, fingerprint
        self._values = MasterValues(robot, resources)
        # None: to be computed from the present inputs and parameters.
        self._model: ElasticRobot | None = None
        self._trajectory: Trajectory | None = None
        # What the last step leaves to a moving robot that follows the inputs.
        self._past: LastStep | None = None
        # The model's own time is that since the start: late times have few digits for seconds.
        self._start = self._time = 0.0
        self._stop = inf
        self._relative_tolerance = 0.0
        self._parameters_changed = False
        # Blocks of outputs whose values are those of the present state.
        self._computed: set[str] = set()

    @property
    def time(self) -> float:
        """End of the last step, or the start [s]."""
        return self._time

    def set_up(self, start: float, stop: float | None, tolerance: float | None) -> None:
        """Take start and stop time [s], and the relative tolerance."""
        if not isfinite(start):
            raise ParameterError(f"start time: expected a finite number, got {start} s")
        stop = inf if stop is None else stop
        if not stop >= start:
            raise ParameterError(
                f"stop time: expected the start time, {start} s, or a later one, got {stop} s"
            )
        if tolerance is not None and not (isfinite(tolerance) and tolerance >= 0.0):
            raise ParameterError(
                f"tolerance: expected a number > 0, or 0 for {TOLERANCE:g} m at the TCP, got {tolerance}"
            )
        self._start = self._time = start
        self._stop = stop
        self._relative_tolerance = tolerance or 0.0
        self._forget()

    def initialised(self) -> ElasticRobot:
        """Return the model, in its initial state if it was not computed yet."""
        if self._model is not None:
            return self._model
        strings = self._values.strings.values
        model = self._values.new_model(strings, self._allowed_error())
        model.parameters = self._values.parameters()
        self._trajectory = self._values.read_trajectory(strings)
        undeflected = strings["initial_state"] == "undeflected"
        slipped = SLIPPED.get(strings["initial_state"], 0)
        self._past = None
        drives, load, torque = self._drives(0.0, 0.0), self._values.load(), self._values.torque()
        model.reset(0.0, drives, load, undeflected, slipped, torque)
        self._computed.clear()
        self._parameters_changed = False
        self._model = model
        return model

    def step(self, time: float, length: float) -> str:
        """Move on by a communication step [s]; inputs are those at its start.

        Returns:
            What is wrong with inputs that were taken all the same, or "".
        """
        self._require_step(time, length)
        if length == 0.0:
            return ""
        self._require_before_stop(time + length)
        model = self.initialised()
        end = self._end(model, time, length)
        drives = self._drives(model.time, end)
        try:
            self._move(model, end, drives)
        except ElasticRobotError as error:
            error.may_retry = True
            raise
        if isinstance(drives, CommandedMotion) and self._values.strings["mode"] == "dynamic":
            self._past = drives.past(end, self._past)
        self._time = time + length
        self._computed.clear()
        return "" if self._trajectory is not None else self._values.motion_without_rates()

    def get_reals(self, references: Sequence[int]) -> list[float]:
        """Return values; an output is computed when it is read."""
        if not references:
            return []
        reals = self._values.reals
        places = reals.places(references)
        for key in places.outputs - self._computed:
            value = getattr(self.initialised(), key)()
            reals.block(key)[:] = value[_UPPER] if key == "compliance" else value.ravel()
            self._computed.add(key)
        return reals.get(references, places)

    @property
    def start_text(self) -> str:
        """What starts, in words."""
        strings = self._values.strings.values
        return (
            f"starts at {self._time} s: {strings['mode']}, from {strings['initial_state']}, torque curve"
            f" {strings['torque_curve']}; tolerance {self._allowed_error()} m at the TCP"
        )

    def trajectory_beyond_limits(self) -> str:
        """Return the trajectory's violation of the drives' limits, in words; "" without one."""
        motion = self._trajectory
        return "" if motion is None else self._values.trajectory_beyond_limits(motion)

    def set_reals(self, references: Sequence[int], values: Sequence[float]) -> str:
        """Set inputs and parameters; return what is wrong with those that were taken, or ""."""
        if not references:
            return ""
        if self.phase >= Phase.RUNNING:
            self._values.reals.require_unfixed(references)
        places = self._values.reals.set(references, values)
        if places.has_parameters:
            self._parameters_changed = True
        self._forget_initial()
        return self._values.command_beyond_limits() if places.has_angles else ""

    def set_derivatives(self, references: Sequence[int], values: Sequence[float]) -> str:
        """Take first derivatives of inputs; return the name of the first that has no effect, or ""."""
        ignored = self._values.set_derivatives(references, values)
        self._forget_initial()
        return ignored

    def set_strings(self, references: Sequence[int], values: Sequence[str | None]) -> None:
        """Set the fixed parameters."""
        self._values.strings.set(references, values)
        self._forget()

    def get_strings(self, references: Sequence[int]) -> list[str]:
        """Return the fixed parameters."""
        return self._values.strings.get(references)

    @property
    def state(self) -> FmuState:
        """The present state; assigning one of the same FMU, or its bytes, goes back to it."""
        values, trajectory = self._values, None if self._model is None else self._trajectory
        return FmuState(
            fingerprint=self._fingerprint,
            start=self._start,
            time=self._time,
            stop=self._stop,
            tolerance=self._relative_tolerance,
            phase=self.phase,
            parameters_changed=self._parameters_changed,
            values=values.reals.values.copy(),
            jerk=values.jerk.copy(),
            strings=tuple(values.strings.values.values()),
            model=None if self._model is None else self._model.snapshot,
            past=self._past,
            trajectory=trajectory,
            trajectory_digest="" if trajectory is None else trajectory.digest,
        )

    @state.setter
    def state(self, state: FmuState | PackedState) -> None:
        if isinstance(state, PackedState):
            state = state.open(self._fingerprint, Parameters.of(self._robot))
        require_own(state.fingerprint, self._fingerprint)
        values = self._values
        strings = values.strings.of(state.strings)
        model, trajectory = None, None
        if state.model is not None:
            own = values.reals.slice_of("tolerance")
            error = allowed_error(float(state.values[own][0]), state.tolerance)
            same = (strings, error) == (values.strings.values, self._allowed_error())
            model = self._model if same else None
            model = model or values.new_model(strings, error)
            trajectory = state.trajectory
            if trajectory is None and state.trajectory_digest:
                trajectory = self._read_again(strings, state.trajectory_digest)
            model.snapshot = state.model
        self._model, self._trajectory, values.strings.values = model, trajectory, strings
        self._start, self._time, self._stop = state.start, state.time, state.stop
        self._relative_tolerance = state.tolerance
        self.phase, self._parameters_changed = state.phase, state.parameters_changed
        values.reals.values[:] = state.values
        self._past, values.jerk = state.past, state.jerk.copy()
        self._computed.clear()

    def _read_again(self, strings: dict[str, str], digest: str) -> Trajectory:
        trajectory = self._values.read_trajectory(strings)
        if trajectory is None or trajectory.digest != digest:
            raise StateError(
                f"trajectory {strings['trajectory']}: expected the motion that the state was"
                " saved with, got another"
            )
        return trajectory

    def _forget(self) -> None:
        self._model = None
        self._computed.clear()

    def _forget_initial(self) -> None:
        """The initial state follows what is set until initialisation ends."""
        if self.phase < Phase.RUNNING:
            self._forget()

    def _require_step(self, time: float, length: float) -> None:
        if not isfinite(length) or length < 0.0:
            raise ParameterError(f"step size: expected a finite number >= 0, got {length} s")
        if not abs(time - self._time) <= SETTINGS.slack_at(self._time):
            raise ParameterError(
                f"step start: expected the last step's end, {self._time} s, got {time} s"
            )

    def _allowed_error(self) -> float:
        return allowed_error(
            float(self._values.reals.block("tolerance")[0]), self._relative_tolerance
        )

    def _require_before_stop(self, end: float) -> None:
        stop = self._stop
        if end <= stop:
            return
        rounding = SETTINGS.slack_at(stop) + SETTINGS.stop_slack * (stop - self._start)
        if not end - stop <= rounding:
            raise ParameterError(f"time: expected at most the stop time, {stop} s, got {end} s")

    def _end(self, model: ElasticRobot, time: float, length: float) -> float:
        """Return a step's end since the start, in the model's time where the two differ by rounding."""
        given, own = (time - self._start) + length, model.time + length
        rounding = SETTINGS.time_rounding(max(abs(self._start), abs(time)))
        return own if abs(given - own) <= rounding else given

    def _move(self, model: ElasticRobot, end: float, drives: Drives) -> None:
        load, torque = self._values.load(), self._values.torque()
        if not self._parameters_changed:
            model.step(end, drives, load, torque)
            return
        before = model.snapshot
        model.parameters = self._values.parameters()
        try:
            model.step(end, drives, load, torque)
        except ElasticRobotError:
            model.snapshot = before
            raise
        self._parameters_changed = False

    def _drives(self, start: float, end: float) -> Drives:
        """Return the drives over a step, in the model's time."""
        if self._trajectory is not None:
            return self._trajectory.since(self._start)
        return CommandedMotion.after(self._past, self._values.command(), start, end - start)
