"""An FMU by the standards' functions alone, FMI 2.0 and 3.0 alike: statuses and messages as they come.

Knows nothing of this project but the names of variables.
"""

from ctypes import (
    CDLL,
    CFUNCTYPE,
    byref,
    c_bool,
    c_char_p,
    c_double,
    c_int,
    c_size_t,
    c_uint,
    c_void_p,
    create_string_buffer,
)
from pathlib import Path

import fmpy
from fmu import unpacked

OK, WARNING, DISCARD, ERROR = range(4)
POSTURE = {f"q_cmd[{i + 1}]": q for i, q in enumerate([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])}


def doubles(values):
    return (c_double * max(len(values), 1))(*values)


class Fmu:
    """An unpacked FMU, of the kind of use "cs" or "me"."""

    def __init__(self, file, use="cs"):
        self.description = fmpy.read_model_description(file, validate=False)
        self.folder, self.use = Path(unpacked(file)), use
        self.version = self.description.fmiVersion[0]
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.reference = {v.name: v.valueReference for v in self.variables.values()}
        (library,) = self.folder.glob("binaries/*linux*/*.so")
        self.library = CDLL(str(library))

    def instance(self, **options):
        return Instance(self, **options)


class Instance:
    """An instance; every method returns a status first, `log` has what the master was told."""

    def __init__(self, fmu, name="robot", logging=False, resources=None, token=None):
        self.fmu, self.log, self._two = fmu, [], fmu.version == "2"
        token = (token or fmu.description.guid).encode()
        folder = resources or fmu.folder / "resources"
        if self._two:
            kinds = (c_void_p, c_char_p, c_int, c_char_p, c_char_p)
            self._logger = CFUNCTYPE(None, *kinds)(lambda *message: self.log.append(message[2:]))
            self._callbacks = (c_void_p * 5)()
            self._callbacks[0] = _address(self._logger)
            make, kind = fmu.library.fmi2Instantiate, int(fmu.use == "cs")
            given = (name.encode(), kind, token, folder.as_uri().encode(), self._callbacks, 0)
            given = (*given, int(logging))
        else:
            kinds = (c_void_p, c_int, c_char_p, c_char_p)
            self._logger = CFUNCTYPE(None, *kinds)(lambda *message: self.log.append(message[1:]))
            given = (name.encode(), token, f"{folder}/".encode(), c_bool(False), c_bool(logging))
            if fmu.use == "cs":
                make = fmu.library.fmi3InstantiateCoSimulation
                given = (*given, c_bool(False), c_bool(False), None, c_size_t(0), None)
                given = (*given, self._logger, None)
            else:
                make = fmu.library.fmi3InstantiateModelExchange
                given = (*given, None, self._logger)
        make.restype = c_void_p
        made = make(*given)
        self.c = None if made is None else c_void_p(made)

    def call(self, name, *arguments):
        return getattr(self.fmu.library, f"fmi{self.fmu.version}{name}")(self.c, *arguments)

    # The life of an instance.

    def enter(self, start=0.0, stop=None, tolerance=None):
        told = [tolerance is not None, tolerance or 0.0, start, stop is not None, stop or 0.0]
        kinds = [c_int, c_double, c_double, c_int, c_double]
        if not self._two:
            kinds[0] = kinds[3] = c_bool
            given = (kind(value) for kind, value in zip(kinds, told, strict=True))
            return self.call("EnterInitializationMode", *given)
        given = (kind(value) for kind, value in zip(kinds, told, strict=True))
        return self.call("SetupExperiment", *given) or self.call("EnterInitializationMode")

    def exit(self):
        return self.call("ExitInitializationMode")

    def start(self, time=0.0, stop=None, tolerance=None, strings=(), **reals):
        """Initialised in a posture, and in model exchange in continuous-time mode."""
        for name, text in dict(strings).items():
            assert self.set_string(name, text) == OK
        assert self.enter(time, stop, tolerance) == OK
        assert self.set({**POSTURE, **reals}) == OK
        assert self.exit() == OK
        if self.fmu.use == "me":
            assert self.update() == OK
            assert self.call("EnterContinuousTimeMode") == OK
        return self

    def step(self, time, size):
        """Status and, in FMI 3.0, the last successful time."""
        given = [c_double(time), c_double(size), c_int(1)]
        if self._two:
            return self.call("DoStep", *given), None
        last = c_double()
        flags = [byref(c_bool()) for _ in range(3)]
        return self.call("DoStep", *given[:2], c_bool(True), *flags, byref(last)), last.value

    def last_time(self):
        """The end of the last step, as FMI 2.0 asks for it."""
        value = c_double()
        return self.call("GetRealStatus", 2, byref(value)), value.value

    # Values.

    def vrs(self, names):
        return (c_uint * max(len(names), 1))(*map(self.fmu.reference.get, names)), c_size_t(
            len(names)
        )

    def _counted(self, count):
        return () if self._two else (c_size_t(count),)

    def set(self, values):
        name = "SetReal" if self._two else "SetFloat64"
        given = doubles(list(values.values()))
        return self.call(name, *self.vrs(list(values)), given, *self._counted(len(values)))

    def get(self, *names):
        name, values = "GetReal" if self._two else "GetFloat64", doubles([0.0] * len(names))
        status = self.call(name, *self.vrs(names), values, *self._counted(len(names)))
        return status, list(values)

    def set_string(self, name, text):
        given = (c_char_p * 1)(text.encode())
        return self.call("SetString", *self.vrs([name]), given, *self._counted(1))

    def derive(self, unknowns, knowns, seed):
        """A directional derivative."""
        out = doubles([0.0] * len(unknowns))
        known = (*self.vrs(knowns), doubles(seed), *self._counted(len(seed)))
        given = (*self.vrs(unknowns), *known, out, *self._counted(len(unknowns)))
        return self.call("GetDirectionalDerivative", *given), list(out)[: len(unknowns)]

    def save(self):
        state = c_void_p()
        assert self.call(self.state_call("GetFMUstate"), byref(state)) == OK
        return state

    def restore(self, state):
        return self.call(self.state_call("SetFMUstate"), state)

    def bytes(self):
        """The serialised present state."""
        state, size = self.save(), c_size_t()
        assert self.call(self.state_call("SerializedFMUstateSize"), state, byref(size)) == OK
        data = create_string_buffer(size.value)
        assert self.call(self.state_call("SerializeFMUstate"), state, data, size) == OK
        assert self.call(self.state_call("FreeFMUstate"), byref(state)) == OK
        return data.raw

    def state_call(self, name):
        """A function on states, by its name in FMI 2.0."""
        return name if self._two else name.replace("FMUstate", "FMUState").replace("DeS", "Des")

    # Model exchange.

    def update(self):
        """New discrete states."""
        if self._two:
            return self.call("NewDiscreteStates", create_string_buffer(64))
        flags = [byref(c_bool()) for _ in range(5)]
        return self.call("UpdateDiscreteStates", *flags, byref(c_double()))

    def completed(self):
        flag = c_int if self._two else c_bool
        return self.call("CompletedIntegratorStep", flag(True), byref(flag()), byref(flag()))

    def set_time(self, time):
        return self.call("SetTime", c_double(time))

    def set_states(self, values):
        return self.call("SetContinuousStates", doubles(values), c_size_t(len(values)))

    def vector(self, what, count):
        """States, their derivatives or the event indicators."""
        name = (
            what if self._two else what.replace("GetDerivatives", "GetContinuousStateDerivatives")
        )
        values = doubles([0.0] * count)
        return self.call(name, values, c_size_t(count)), list(values)

    def count(self, base):
        return sum(name.startswith(f"{base}[") for name in self.fmu.reference)


def _address(function):
    from ctypes import cast

    return cast(function, c_void_p).value


__all__ = ["DISCARD", "ERROR", "OK", "POSTURE", "WARNING", "Fmu", "Instance", "doubles"]
