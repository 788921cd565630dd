"""What every call answers in every phase, and after refusals: life_cycle.py FMU OUT.

OUT gets, as JSON, which calls are taken in which phase, and what was taken though it may not be.
Whatever is refused must leave the serialised state as it was.
"""

import json
import math
import random
import sys
from ctypes import (
    byref,
    c_bool,
    c_char_p,
    c_double,
    c_int,
    c_size_t,
    c_void_p,
    create_string_buffer,
)
from pathlib import Path

from standard import DISCARD, ERROR, OK, Fmu

fmu = Fmu(sys.argv[1])
TWO = fmu.version == "2"
PHASES = ("instantiated", "initialising", "running", "terminated")


def values_call(i, verb, names, values):
    """GetReal, SetString, ... of names, with the values that are given, or NULL."""
    counted = () if TWO else (c_size_t(len(names)),)
    return i.call(verb, *i.vrs(names), values, *counted)


def set_strings(i, texts):
    given = [None if text is None else text.encode() for text in texts.values()]
    return values_call(i, "SetString", list(texts), (c_char_p * len(given))(*given))


def log(i, *categories, on=0):
    names = (c_char_p * len(categories))(*[name and name.encode() for name in categories])
    flag = c_int(on) if TWO else c_bool(on)
    return i.call("SetDebugLogging", flag, c_size_t(len(categories)), names if categories else None)


def free_state(i, state):
    return i.call(i.state_call("FreeFMUstate"), byref(state))


def unpack(i, data, state):
    given = create_string_buffer(data, max(len(data), 1))
    name = i.state_call("DeSerializeFMUstate")
    return i.call(name, given, c_size_t(len(data)), byref(state))


def set_present_state(i):
    state = i.save()
    status = i.restore(state)
    free_state(i, state)
    return status


def there_and_back(i):
    other = c_void_p()
    status = unpack(i, i.bytes(), other)
    free_state(i, other)
    return status


CALLS = {
    "SetDebugLogging": log,
    "EnterInitializationMode": lambda i: i.call("EnterInitializationMode", *entered()),
    "ExitInitializationMode": lambda i: i.exit(),
    "Terminate": lambda i: i.call("Terminate"),
    "Reset": lambda i: i.call("Reset"),
    "Get of an output": lambda i: i.get("tcp.z")[0],
    "Get of an input": lambda i: i.get("force.z")[0],
    "GetString": lambda i: values_call(i, "GetString", ["mode"], (c_char_p * 1)(None)),
    "Set of an input": lambda i: i.set({"force.z": 1.0}),
    "Set of a tunable parameter": lambda i: i.set({"joint[2].stiffness": 1e6}),
    "SetString of a fixed parameter": lambda i: i.set_string("mode", "quasistatic"),
    "Set of an output": lambda i: i.set({"tcp.z": 1.0}),
    "GetFMUstate": lambda i: free_state(i, i.save()),
    "SetFMUstate": set_present_state,
    "DeSerializeFMUstate": there_and_back,
    "GetDirectionalDerivative": lambda i: i.derive(["tcp.z"], ["force.z"], [1.0])[0],
    "DoStep": lambda i: i.step(0.0, 0.01)[0],
}
if TWO:
    numbers = (0, c_double(0.0), c_double(0.0), 0, c_double(0.0))
    CALLS["SetupExperiment"] = lambda i: i.call("SetupExperiment", *numbers)
    CALLS["GetRealStatus"] = lambda i: i.last_time()[0]


def entered():
    return () if TWO else (c_bool(False), c_double(0), c_double(0), c_bool(False), c_double(0))


def in_phase(phase):
    i = fmu.instance()
    advances = ("EnterInitializationMode", "ExitInitializationMode", "Terminate")
    for name in advances[: PHASES.index(phase)]:
        assert CALLS[name](i) == OK
    return i


def is_taken(i, act):
    """Whether a call is; a refusal changes nothing."""
    before = i.bytes()
    status = act(i)
    assert status in (OK, DISCARD, ERROR), status
    assert status == OK or i.bytes() == before
    i.call("FreeInstance")
    return status == OK


REFUSED = {
    "one bad text of three": lambda i: set_strings(
        i, {"initial_state": "undeflected", "mode": "nonsense", "torque_curve": "linear"}
    ),
    "a bad text behind good ones": lambda i: set_strings(
        i, {"initial_state": "undeflected", "trajectory": "x" * 2000}
    ),
    "a text that is no choice": lambda i: i.set_string("mode", "nonsense"),
    "a curve that is no choice": lambda i: i.set_string("torque_curve", "Linear"),
    "no text": lambda i: set_strings(i, {"initial_state": "undeflected", "mode": None}),
    "a real as a text": lambda i: set_strings(i, {"mode": "quasistatic", "force.z": "0"}),
    "one bad number of two": lambda i: i.set(
        {"joint[2].stiffness": 1e6, "joint[3].damping": math.inf}
    ),
    "an output behind an input": lambda i: i.set({"force.z": 1.0, "tcp.z": 1.0}),
    "a text as a real": lambda i: i.set({"joint[2].stiffness": 1e6, "mode": 0.0}),
    "no values": lambda i: values_call(i, "SetReal" if TWO else "SetFloat64", ["force.z"], None),
    "no place for values": lambda i: values_call(
        i, "GetReal" if TWO else "GetFloat64", ["tcp.z"], None
    ),
    "an output and what is not there": lambda i: i.get("tcp.z", "mode")[0],
    "an unknown category of messages": lambda i: log(i, "logStatusError", "logEverything", on=1),
    "no category of messages": lambda i: log(i, None, on=1),
    "no place for a state": lambda i: i.call(i.state_call("GetFMUstate"), None),
    "no state": lambda i: i.restore(None),
    "no bytes": lambda i: i.call(
        i.state_call("DeSerializeFMUstate"), None, c_size_t(9), byref(c_void_p())
    ),
}


def damaged(data):
    """Bytes cut, lengthened, and with one bit or byte other than it was."""
    draw = random.Random(15)
    yield from (b"", data[:1], data[: len(data) // 2], data[:-1], data + b"\0", b"\0" * len(data))
    places = {*range(60), *range(len(data) - 60, len(data)), *draw.choices(range(len(data)), k=300)}
    for k in sorted(places):
        for other in (data[k] ^ 1 << draw.randrange(8), data[k] ^ 0xFF):
            yield data[:k] + bytes([other]) + data[k + 1 :]


def damaged_states():
    """Damaged bytes are refused into a new place and into a state that is there, which stays.

    Whole ones go on in another instance to the same bytes; a reset is a new instance."""
    i = in_phase("running")
    i.step(0.0, 0.01)
    i.set({"force.z": -300.0})
    i.step(0.01, 0.01)
    kept, data = i.save(), i.bytes()
    i.step(0.02, 0.01)
    present = i.bytes()
    taken = []
    for k, bad in enumerate(damaged(data)):
        place = kept.value
        if unpack(i, bad, kept if k % 2 else c_void_p()) == OK or kept.value != place:
            taken.append(k)
    assert i.bytes() == present
    assert i.restore(kept) == OK
    assert i.bytes() == data
    i.step(0.02, 0.01)
    assert i.bytes() == present
    assert unpack(i, data, kept) == OK
    other = fmu.instance()
    for state in (kept, copy := c_void_p()):  # of the first instance, and from bytes
        assert state is kept or unpack(other, data, copy) == OK
        assert other.restore(state) == OK
        assert other.step(0.02, 0.01)[0] == OK
        assert other.bytes() == present
    assert i.call("Reset") == OK
    assert i.bytes() == fmu.instance().bytes()
    return taken


found = {
    "pairs": {
        name: [phase for phase in PHASES if is_taken(in_phase(phase), act)]
        for name, act in CALLS.items()
    },
    "refused calls that were taken": [
        name for name, act in REFUSED.items() if is_taken(in_phase("initialising"), act)
    ],
    "damaged states that were taken": damaged_states(),
}
Path(sys.argv[2]).write_text(json.dumps(found))
