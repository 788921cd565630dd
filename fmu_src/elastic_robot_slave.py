"""FMI variables <-> ElasticRobot, nothing else.

PythonFMU puts the FMU's resources folder on the module path, imports this file by its name and runs
it twice; modules of the host or of another FMU may answer instead of the FMU's own.  So everything
that belongs to an instance is read from its own `resources` in `__init__`, and no module has state.
"""

import functools
import sys
from math import isfinite
from pathlib import Path

import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real, String
from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.enums import Fmi2Status

from elastic_robot.description import Robot
from elastic_robot.errors import ParameterError
from elastic_robot.interface import INITIAL_STATES, MODES, blocks
from elastic_robot.parameters import Parameters
from elastic_robot.robot import ElasticRobot
from elastic_robot.trajectory import HeldCommand, read_trajectory

# A communication step may start this far [s] from where the last one ended (rounding of sums).
_TIME_SLACK = 1e-9
# Lists of variables of which the places are kept.
_LISTS_KEPT = 100
# Of the 6x6 compliance the translations' symmetric block is given: xx xy xz yy yz zz.
_UPPER = np.triu_indices(3)


def _reported(method):
    """Let the user see an error: FMI passes on a status only, and the log may be off."""

    @functools.wraps(method)
    def wrapper(self, *args):
        try:
            return method(self, *args)
        except Exception as error:
            text = f"{self.instance_name}: {error}"
            print(text, file=sys.stderr, flush=True)
            self.log(text.replace("%", "%%"), Fmi2Status.error)  # the host formats it like printf
            raise

    return wrapper


class ElasticRobotSlave(Fmi2Slave):
    """The FMU: inputs, outputs and parameters of `elastic_robot.interface`."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.modelName = "ElasticRobot"
        self.description = "Industrial robot with elastic joints, tilts and backlash"
        self.default_experiment = DefaultExperiment(step_size=0.01, tolerance=1e-6)
        self._robot = Robot.from_json(
            Path(self.resources, "robot.json").read_text(encoding="utf-8")
        )
        self._register()
        self._model = None
        self._time = 0.0
        self._tolerance = 1e-6
        self._initialised = False  # the state belongs to the present inputs and parameters
        self._stepped = False
        self._lists = {}  # lists of variables that were asked for
        self._fresh = set()  # output blocks computed for the present state
        self._parameters_changed = False

    def _register(self):
        self._slices, starts, names = {}, [], []
        table = blocks(self._robot)
        self._strings = {v.name: v.start for v in table.pop("strings").variables}
        for key, block in table.items():
            self._slices[key] = slice(len(starts), len(starts) + len(block.variables))
            for variable in block.variables:
                real = Real(
                    variable.name,
                    causality=Fmi2Causality[block.causality],
                    variability=Fmi2Variability[block.variability],
                    description=f"{variable.text} [{variable.unit}]",
                    getter=functools.partial(self._start_of, len(starts)),
                )
                self.register_variable(real, nested=False)
                starts.append(0.0 if variable.start is None else variable.start)
                names.append(variable.name)
        self._values, self._names = np.array(starts), names
        self._output_of = {
            vr: key
            for key, block in table.items()
            if block.causality == "output"
            for vr in range(self._slices[key].start, self._slices[key].stop)
        }
        self._inputs = range(self._slices["tcp"].start)
        self._string_names = list(self._strings)
        for name in self._string_names:
            string = String(
                name,
                causality=Fmi2Causality.parameter,
                variability=Fmi2Variability.fixed,
                getter=functools.partial(self._strings.get, name),
            )
            self.register_variable(string, nested=False)

    def _start_of(self, reference):
        return self._values[reference]

    def _block(self, key):
        return self._values[self._slices[key]]

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        """Take the start time, and the tolerance as the error allowed at the TCP [m]."""
        self._time = start_time
        if tolerance:
            self._tolerance = tolerance

    @_reported
    def exit_initialization_mode(self):
        """Compute the initial state from the inputs and parameters set by now."""
        self._initialise()
        self._stepped = True

    @_reported
    def do_step(self, current_time, step_size):
        """Move on by a communication step; inputs are held over it."""
        if not isfinite(step_size) or step_size < 0.0:
            raise ParameterError(f"step size is {step_size} s; needed is a finite number >= 0")
        if abs(current_time - self._time) > _TIME_SLACK:
            raise ParameterError(
                f"the step starts at {current_time} s; needed is the last step's end, {self._time} s"
            )
        if step_size == 0.0:
            return True
        if self._parameters_changed:
            self._model.parameters = self._checked_parameters()
            self._parameters_changed = False
        end = current_time + step_size
        self._model.step(end, self._drives(), self._block("wrench").copy())
        self._time = end
        self._fresh.clear()
        return True

    @_reported
    def get_real(self, vrs):
        """Return values; an output is computed when it is read."""
        if not vrs:
            return []
        rows, outputs = self._asked(tuple(vrs))
        stale = outputs - self._fresh
        if stale:
            self._initialise()
        for key in stale:
            value = getattr(self._model, key)()
            self._values[self._slices[key]] = value[_UPPER] if key == "compliance" else value
            self._fresh.add(key)
        return self._values[rows].tolist()

    @_reported
    def set_real(self, vrs, values):
        """Set inputs and parameters."""
        if not vrs:
            return
        if not all(map(isfinite, values)):
            vr, value = next((vr, v) for vr, v in zip(vrs, values, strict=True) if not isfinite(v))
            raise ParameterError(f"{self._names[vr]} is {value}; needed is a finite number")
        rows, outputs = self._asked(tuple(vrs))
        if outputs:
            first = next(vr for vr in vrs if vr in self._output_of)
            raise ParameterError(f"{self._names[first]} is an output and cannot be set")
        if max(vrs) not in self._inputs:
            self._parameters_changed = True
        self._values[rows] = values
        if not self._stepped:
            self._initialised = False

    @_reported
    def set_string(self, vrs, values):
        """Set the fixed parameters, before the initial state is computed."""
        if self._stepped:
            raise ParameterError("strings are fixed; set them before initialisation ends")
        for vr, value in zip(vrs, values, strict=True):
            self._strings[self._string_names[vr - len(self._values)]] = value
        self._initialised = False

    def get_string(self, vrs):
        """Return the fixed parameters."""
        return [self._strings[self._string_names[vr - len(self._values)]] for vr in vrs]

    def _asked(self, vrs):
        """Return an index of these variables and the names of the output blocks among them.

        Masters ask for the same few lists over and over; the answer is kept, and where they follow
        one another the index is a slice.
        """
        known = self._lists.get(vrs)
        if known is None:
            if vrs == tuple(range(vrs[0], vrs[0] + len(vrs))):
                rows = slice(vrs[0], vrs[0] + len(vrs))
            else:
                rows = list(vrs)
            known = rows, {self._output_of[vr] for vr in vrs if vr in self._output_of}
            if len(self._lists) < _LISTS_KEPT:
                self._lists[vrs] = known
        return known

    def _initialise(self):
        if self._initialised:
            return
        for name, known in (("mode", MODES), ("initial_state", INITIAL_STATES)):
            if self._strings[name] not in known:
                raise ParameterError(
                    f"{name} is {self._strings[name]!r}; needed is one of {', '.join(known)}"
                )
        self._model = ElasticRobot(
            self._robot,
            torque_curve=self._strings["torque_curve"],
            quasistatic=self._strings["mode"] == "quasistatic",
            tolerance=self._tolerance,
        )
        self._model.parameters = self._checked_parameters()
        self._parameters_changed = False
        path = self._strings["trajectory"]
        self._trajectory = read_trajectory(Path(path), len(self._robot.joints)) if path else None
        undeflected = self._strings["initial_state"] == "undeflected"
        self._model.reset(self._time, self._drives(), self._block("wrench").copy(), undeflected)
        self._fresh.clear()
        self._initialised = True

    def _drives(self):
        if self._trajectory is not None:
            return self._trajectory
        q, qd, qdd = (self._block(key).copy() for key in ("q_cmd", "qd_cmd", "qdd_cmd"))
        return HeldCommand(self._time, q, qd, qdd)

    def _checked_parameters(self):
        backlash = np.zeros(len(self._block("stiffness")))
        backlash[self._model.chain.elastic_tilt == 0] = self._block("backlash")
        for key, strict in (("stiffness", True), ("damping", False), ("backlash", False)):
            values = self._block(key)
            bad = np.flatnonzero(values <= 0.0 if strict else values < 0.0)
            if len(bad):
                name = self._names[self._slices[key].start + bad[0]]
                bound = "> 0" if strict else ">= 0"
                raise ParameterError(f"{name} is {values[bad[0]]}; needed is a number {bound}")
        return Parameters(
            gravity=self._block("gravity").copy(),
            stiffness=self._block("stiffness").copy(),
            damping=self._block("damping").copy(),
            backlash=backlash,
            tables=self._model.parameters.tables,
        )
