"""What both standards ask of every FMU, clause by clause: clauses.py FMU USE OUT [CLAUSE ..].

USE is cs or me; OUT gets, as JSON, what went wrong by clause.  Texts: FMI 2.0.5 and FMI 3.0.2.
"""

import json
import math
import sys
import traceback
from ctypes import byref, c_bool, c_double, c_int, c_size_t, c_uint
from pathlib import Path

from clauses_of_absence import (
    absent_clocks,
    absent_modes,
    absent_results,
    absent_variables,
    debug_lists,
    state_numbers,
    versions,
)
from clauses_of_runs import (
    events,
    halved_steps,
    input_derivatives,
    limits,
    quaternion,
    tolerance,
)
from standard import DISCARD, ERROR, OK, Fmu, doubles

H = 0.01  # [s]


def stop_time(fmu):
    """FMI 2, 2.1.6, FMI 3, 2.3.2: "if the environment tries to compute past stopTime" it gets Error."""
    i = fmu.instance(logging=True).start(stop=0.3)
    if fmu.use == "me":  # solvers look ahead and interpolate; what is completed counts
        assert i.set_time(0.31) == OK
        assert i.vector("GetDerivatives", i.count("deflection"))[0] in (OK, ERROR)
        before = i.bytes()
        assert i.completed() == ERROR
        assert i.bytes() == before
        assert i.set_time(0.3) == OK
        assert i.completed() == OK
    else:
        time = 0.0
        for _ in range(3):  # to 0.30000000000000004
            assert i.step(time, 0.1)[0] == OK
            time += 0.1
        before = i.bytes()
        assert i.step(time, 1e-3)[0] == ERROR
        assert i.bytes() == before
        state = i.save()
        assert i.call("Reset") == OK
        assert i.restore(state) == OK
        assert i.step(time, 1e-3)[0] == ERROR
    assert b"stop time, 0.3 s" in i.log[-1][-1], i.log
    assert i.call("Reset") == OK
    assert i.enter(1.0, stop=0.5) == ERROR
    assert i.call("Reset") == OK
    i.start(time=0.2)
    assert fmu.use == "me" or i.step(0.2, 0.2)[0] == OK


def failed_instantiation(fmu):
    """FMI 2, 2.1.5: "In that case, functions->logger is called with detailed information about the
    reason."; FMI 3, 2.3.1: "the FMU must call logMessage".  Whether or not logging is on."""
    for logging in (False, True):
        for wrong in ({"token": "{other}"}, {"resources": Path("/nowhere/at/all")}):
            i = fmu.instance(logging=logging, **wrong)
            assert i.c is None
            assert len(i.log) == 1, i.log
            assert i.log[0][0] == ERROR
            assert len(i.log[0][-1]) > 20


def zero_step(fmu):
    """FMI 3, 4.2.1: "communicationStepSize must be > 0.0", 2.2.4: "illegal arguments" are Error.  FMI
    2.0 asks masters for the same and FMUs for nothing: such a step does nothing."""
    if fmu.use == "me":
        return
    i = fmu.instance().start()
    before = i.bytes()
    assert i.step(0.0, 0.0)[0] == (OK if fmu.version == "2" else ERROR)
    assert i.bytes() == before
    assert i.step(0.0, H)[0] == OK


def escapes(fmu):
    """FMI 2, 2.1.5, FMI 3, 2.3.1: "If the character # shall be included in the message, it has to be
    prefixed with #"; FMI 2.0 formats messages like printf."""
    i = fmu.instance(logging=True)
    assert i.set_string("mode", "a#1# %d") != OK
    shown = b"a##1## %%d" if fmu.version == "2" else b"a##1## %d"
    assert shown in i.log[-1][-1], i.log


def ranges(fmu):
    """FMI 2, 2.2.7: where min is violated "on a fixed or tunable parameter fmi2Status = fmi2Discard is
    returned"; FMI 3, 2.2.4: Discard for "handling of min/max violation"."""
    i = fmu.instance()
    for phase in ("instantiated", "initialising"):
        for name, bad in (
            ("joint[2].stiffness", -1.0),
            ("joint[2].stiffness", 0.0),
            ("joint[1].tilt[1].stiffness", -math.inf),
            ("joint[3].damping", -1.0),
            ("joint[4].backlash", -1e-9),
        ):
            before = i.bytes()
            assert i.set({"gravity.z": -1.0, name: bad}) == DISCARD, (phase, name)
            assert i.bytes() == before, (phase, name)
        assert phase == "initialising" or i.enter() == OK
    for name in ("joint[3].damping", "joint[4].backlash"):
        assert i.set({name: 0.0}) == OK


def discarded_values(fmu):
    """FMI 2, 2.1.3: setters "could check whether the input arguments are in their validity range. If
    not, these functions could return with fmi2Discard"; what no value mends is Error."""
    i = fmu.instance(logging=True)
    before = i.bytes()
    for status, call in (
        (DISCARD, lambda: i.set({"force.x": 1.0, "force.z": math.nan})),
        (DISCARD, lambda: i.set({"joint[2].stiffness": math.inf})),
        (DISCARD, lambda: i.set_string("mode", "statick")),
        (DISCARD, lambda: i.set_string("trajectory", "x" * 2000)),
        (ERROR, lambda: i.set({"force.x": 1.0, "tcp.x": 1.0})),
        (ERROR, lambda: i.set_string("force.x", "1")),
    ):
        i.log.clear()
        assert call() == status
        assert i.bytes() == before
        assert [entry[0] for entry in i.log] == [status]
        assert i.log[0][1] == (b"logStatusDiscard" if status == DISCARD else b"logStatusError")


def discarded_steps(fmu):
    """FMI 3, 4.2.1: DoStep "can return with fmi3Discard, if the FMU is in the same state as before the
    call"; FMI 2, 4.2.2: "the master should retry the simulation with a shorter communication step
    size", 4.2.3: fmi2LastSuccessfulTime is "the end time of the last successfully completed step"."""
    if fmu.use == "me":
        return
    i, twin = fmu.instance(logging=True).start(), fmu.instance().start()
    for one in (i, twin):
        assert one.step(0.0, H)[0] == OK
    for wrong in (
        {"force.x": 1e12},
        {"anchor.kzz": -1e6},
        {"gravity.z": -1e12, "force.x": 1e13},
    ):
        right = {name: i.get(name)[1][0] for name in wrong}
        assert i.set(wrong) == OK
        before = i.bytes()
        status, last = i.step(H, H)
        assert status == DISCARD, wrong
        assert i.bytes() == before, wrong
        assert i.log[-1][:2] == (DISCARD, b"logStatusDiscard")
        if fmu.version == "2":
            assert i.last_time() == (OK, H)
            terminated = c_int(7)
            assert i.call("GetBooleanStatus", 3, byref(terminated)) == OK
            assert terminated.value == 0
        else:
            assert last == H
        assert i.set(right) == OK
        assert i.get("compliance.zz") == twin.get("compliance.zz")
    for one in (i, twin):
        assert one.step(H, H)[0] == OK
    assert i.get("tcp.x", "tcp.y", "tcp.z") == twin.get("tcp.x", "tcp.y", "tcp.z")
    for time, size in ((5.0, H), (2 * H, -H), (2 * H, math.nan)):
        assert i.step(time, size)[0] == ERROR


def statuses(fmu):
    """FMI 2, 4.2.3: a status that is not there is Discard, and 2.1.3: "the FMU must call the function
    logger"; both are functions of co-simulation (4.2.4), as derivatives of inputs are."""
    if fmu.version == "3":
        return
    i = fmu.instance(logging=True).start()
    if fmu.use == "me":
        value = c_double(7.0)
        reference, order = (c_uint * 1)(fmu.reference["force.x"]), (c_int * 1)(1)
        assert i.call("GetRealStatus", 2, byref(value)) == ERROR
        given = (reference, c_size_t(1), order, doubles([1e3]))
        assert i.call("SetRealInputDerivatives", *given) == ERROR
        assert i.get("force_rate.x")[1] == [0.0]
        return
    assert i.step(0.0, H)[0] == OK
    told, value = len(i.log), c_int(7)
    assert i.call("GetStatus", 0, byref(value)) == DISCARD
    assert i.log[told][:2] == (DISCARD, b"logStatusDiscard")


def discarded_evaluations(fmu):
    """FMI 2, 2.1.3, for model exchange: "recommended to perform a smaller step size and evaluate the
    model equations again"; FMI 3, 3.2.1: Discard "if the FMU was not able to compute the
    derivatives"."""
    if fmu.use != "me":
        return
    i = fmu.instance(logging=True).start()
    m = i.count("deflection")
    _, states = i.vector("GetContinuousStates", 2 * m)
    _, derivatives = i.vector("GetDerivatives", 2 * m)
    assert i.set_states([math.nan, *states[1:]]) == DISCARD
    assert i.vector("GetContinuousStates", 2 * m) == (OK, states)
    assert i.set_states(states[1:]) == ERROR
    assert i.set_time(math.nan) == ERROR
    assert i.set_states([1e200] * (2 * m)) == OK
    before = i.bytes()
    assert i.vector("GetDerivatives", 2 * m)[0] == DISCARD
    assert i.get("der(deflection_rate[1])")[0] == DISCARD
    assert i.bytes() == before
    assert i.log[-1][:2] == (DISCARD, b"logStatusDiscard")
    assert i.set_states(states) == OK
    assert i.vector("GetDerivatives", 2 * m) == (OK, derivatives)
    assert i.set({"anchor.kxx": -1e5}) == OK
    assert i.vector("GetDerivatives", 2 * m)[0] == DISCARD
    assert i.set({"anchor.kxx": 0.0}) == OK
    assert i.vector("GetDerivatives", 2 * m) == (OK, derivatives)
    assert i.get("mode")[0] == ERROR


def event_mode_twice(fmu):
    """FMI 3, 3.2.1: fmi3EnterEventMode is among the calls of continuous-time mode alone; the table of
    FMI 2, 3.2.3, has fmi2EnterEventMode in event mode as well."""
    if fmu.use != "me":
        return
    i = fmu.instance().start()
    assert i.call("EnterEventMode") == OK
    before = i.bytes()
    assert i.call("EnterEventMode") == (OK if fmu.version == "2" else ERROR)
    assert i.bytes() == before


def null_results(fmu):
    """FMI 3, 2.2.4: for "illegal arguments ... the FMU must return fmi3Error"; nothing is written to
    NULL, and nothing has changed."""
    i = fmu.instance().start()
    before = i.bytes()
    if fmu.use == "cs":
        if fmu.version == "2":
            for name in ("Real", "Boolean", "Integer", "String", ""):
                assert i.call(f"Get{name}Status", 2, None) == ERROR
        else:
            given = (c_double(0.0), c_double(H), c_bool(True))
            for k in range(4):
                places = [byref(c_bool()) for _ in range(3)] + [byref(c_double())]
                places[k] = None
                assert i.call("DoStep", *given, *places) == ERROR
        assert i.bytes() == before
        return
    m = 2 * i.count("deflection")
    for name in ("GetContinuousStates", "GetEventIndicators", "GetNominalsOfContinuousStates"):
        assert i.call(name, None, c_size_t(m)) == ERROR
    flag = c_int if fmu.version == "2" else c_bool
    for places in ((None, byref(flag())), (byref(flag()), None)):
        assert i.call("CompletedIntegratorStep", flag(True), *places) == ERROR
    assert i.bytes() == before
    assert i.call("EnterEventMode") == OK
    before = i.bytes()
    if fmu.version == "2":
        assert i.call("NewDiscreteStates", None) == ERROR
    else:
        for k in range(6):
            places = [byref(c_bool()) for _ in range(5)] + [byref(c_double())]
            places[k] = None
            assert i.call("UpdateDiscreteStates", *places) == ERROR
        for name in ("GetNumberOfContinuousStates", "GetNumberOfEventIndicators"):
            assert i.call(name, None) == ERROR
    assert i.bytes() == before


CLAUSES = {
    f.__name__: f
    for f in (
        stop_time,
        failed_instantiation,
        zero_step,
        null_results,
        escapes,
        ranges,
        discarded_values,
        discarded_steps,
        statuses,
        halved_steps,
        discarded_evaluations,
        input_derivatives,
        limits,
        events,
        quaternion,
        tolerance,
        event_mode_twice,
        versions,
        absent_variables,
        absent_clocks,
        absent_modes,
        absent_results,
        debug_lists,
        state_numbers,
    )
}

if __name__ == "__main__":
    fmu, wrong = Fmu(sys.argv[1], sys.argv[2]), {}
    for name in sys.argv[4:] or CLAUSES:
        try:
            CLAUSES[name](fmu)
        except AssertionError:
            wrong[name] = traceback.format_exc()
        Path(sys.argv[3]).write_text(json.dumps(wrong))
