"""What every call answers in every phase, and after refusals: life_cycle.py FMU OUT.

By the standard's functions themselves, of FMI 2.0 and 3.0; OUT gets, as JSON, the statuses.  Whatever is
refused must leave the serialised state as it was.
"""

import json
import random
import sys
from ctypes import CDLL, byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from ctypes import create_string_buffer as buffer
from pathlib import Path

import fmpy

description = fmpy.read_model_description(sys.argv[1], validate=False)
folder = Path(fmpy.extract(sys.argv[1]))
references = {v.name: v.valueReference for v in description.modelVariables}
(library,) = (file for file in folder.glob("binaries/*linux*/*.so") if "pythonfmu" not in file.name)
functions = CDLL(str(library))
VERSION = description.fmiVersion[0]
FREE = getattr(functions, f"fmi{VERSION}FreeInstance")
PHASES = ("instantiated", "initialising", "running", "terminated")
OK, DISCARD, ERROR = 0, 2, 3


def array(kind, values):
    return (kind * len(values))(*values)


def call(name, c, *arguments):
    function = getattr(functions, f"fmi{VERSION}{name}")
    function.argtypes = None
    return function(c, *arguments)


def new():
    guid = description.guid.encode()
    if VERSION == "2":
        callbacks = array(c_void_p, [None] * 5)
        make = functions.fmi2Instantiate
        arguments = (b"robot", 1, guid, (folder / "resources").as_uri().encode(), callbacks, 0, 0)
    else:
        make = functions.fmi3InstantiateCoSimulation
        resources = f"{folder / 'resources'}/".encode()
        switches = [c_bool(False)] * 4
        arguments = (b"robot", guid, resources, *switches, None, c_size_t(0), None, None, None)
    make.restype = c_void_p
    instance = make(*arguments)
    assert instance
    return c_void_p(instance)


def vrs(names):
    return array(c_uint, [references[name] for name in names]), c_size_t(len(names))


def counted(values):
    return () if VERSION == "2" else (c_size_t(values),)


def set_reals(c, names, values):
    name = "SetReal" if VERSION == "2" else "SetFloat64"
    return call(name, c, *vrs(names), array(c_double, values), *counted(len(values)))


def get_reals(c, names, count):
    name = "GetReal" if VERSION == "2" else "GetFloat64"
    return call(name, c, *vrs(names), array(c_double, [0.0] * count), *counted(count))


def set_strings(c, values):
    texts = array(c_char_p, [None if v is None else v.encode() for v in values.values()])
    return call("SetString", c, *vrs(list(values)), texts, *counted(len(values)))


def get_string(c):
    return call("GetString", c, *vrs(["mode"]), array(c_char_p, [None]), *counted(1))


def step(c, time=0.0, size=0.01):
    arguments = [c_double(time), c_double(size), c_int(1)]
    if VERSION == "3":
        arguments[2:] = [c_bool(True), *(byref(c_bool()) for _ in range(3)), byref(c_double())]
    return call("DoStep", c, *arguments)


def enter(c):
    arguments = (c_bool(False), c_double(0), c_double(0), c_bool(False), c_double(0))
    return call("EnterInitializationMode", c, *(arguments if VERSION == "3" else ()))


def setup(c):
    return call("SetupExperiment", c, 0, c_double(0.0), c_double(0.0), 0, c_double(0.0))


def log(c, *categories, on=0):
    names = array(c_char_p, [name and name.encode() for name in categories])
    on = c_int(on) if VERSION == "2" else c_bool(on)
    return call("SetDebugLogging", c, on, c_size_t(len(categories)), names if categories else None)


def state_call(name):
    return name if VERSION == "2" else name.replace("FMUstate", "FMUState").replace("DeS", "Des")


def save(c):
    state = c_void_p()
    assert call(state_call("GetFMUstate"), c, byref(state)) == OK
    return state


def bytes_of(c, state):
    size = c_size_t()
    assert call(state_call("SerializedFMUstateSize"), c, state, byref(size)) == OK
    data = buffer(size.value)
    assert call(state_call("SerializeFMUstate"), c, state, data, size) == OK
    return data.raw


def everything(c):
    state = save(c)
    data = bytes_of(c, state)
    free_state(c, state)
    return data


def free_state(c, state):
    return call(state_call("FreeFMUstate"), c, byref(state))


def unpack(c, data, state):
    given = buffer(data, max(len(data), 1))
    return call(state_call("DeSerializeFMUstate"), c, given, c_size_t(len(data)), byref(state))


def save_and_free(c):
    return free_state(c, save(c))


def set_present_state(c):
    state = save(c)
    status = call(state_call("SetFMUstate"), c, state)
    free_state(c, state)
    return status


def there_and_back(c):
    state, other = save(c), c_void_p()
    status = unpack(c, bytes_of(c, state), other)
    free_state(c, state)
    free_state(c, other)
    return status


FORCE, TCP = ("force.z", "tcp.z") if VERSION == "2" else ("force", "tcp.position")
WIDTH = 1 if VERSION == "2" else 3


def derive(c):
    seed, along = array(c_double, [1.0] * WIDTH), array(c_double, [0.0] * WIDTH)
    size = () if VERSION == "2" else (c_size_t(WIDTH),)
    return call(
        "GetDirectionalDerivative", c, *vrs([TCP]), *vrs([FORCE]), seed, *size, along, *size
    )


def end(c):
    return call("Terminate", c)


CALLS = {
    "SetDebugLogging": log,
    "SetupExperiment": setup,
    "EnterInitializationMode": enter,
    "ExitInitializationMode": lambda c: call("ExitInitializationMode", c),
    "Terminate": end,
    "Reset": lambda c: call("Reset", c),
    "Get of an output": lambda c: get_reals(c, [TCP], WIDTH),
    "Get of an input": lambda c: get_reals(c, [FORCE], WIDTH),
    "GetString": get_string,
    "Set of an input": lambda c: set_reals(c, [FORCE], [1.0] * WIDTH),
    "Set of a tunable parameter": lambda c: set_reals(c, ["joint[2].stiffness"], [1e6]),
    "SetString of a fixed parameter": lambda c: set_strings(c, {"mode": "quasistatic"}),
    "Set of an output": lambda c: set_reals(c, [TCP], [1.0] * WIDTH),
    "GetFMUstate": save_and_free,
    "SetFMUstate": set_present_state,
    "DeSerializeFMUstate": there_and_back,
    "GetDirectionalDerivative": derive,
    "DoStep": step,
}
if VERSION == "2":
    CALLS["GetRealStatus"] = lambda c: call("GetRealStatus", c, 2, byref(c_double()))
else:
    del CALLS["SetupExperiment"]


def in_phase(phase):
    c = new()
    number = PHASES.index(phase)
    for k, advance in enumerate((enter, CALLS["ExitInitializationMode"], end)):
        if number > k:
            assert advance(c) == OK
    return c


def answered(c, act):
    """Status of a call; a refusal changes nothing."""
    before = everything(c)
    status = act(c)
    assert status in (OK, DISCARD, ERROR), status
    assert status == OK or everything(c) == before
    return status == OK


def pairs():
    found = {}
    for name, act in CALLS.items():
        found[name] = []
        for phase in PHASES:
            c = in_phase(phase)
            if answered(c, act):
                found[name].append(phase)
            FREE(c)
    return found


HUGE = 1e300 * 1e300
REFUSED = {
    "one bad text of three": lambda c: set_strings(
        c, {"initial_state": "undeflected", "mode": "nonsense", "torque_curve": "linear"}
    ),
    "a bad text behind good ones": lambda c: set_strings(
        c, {"initial_state": "undeflected", "trajectory": "x" * 2000}
    ),
    "a text that is no choice": lambda c: set_strings(c, {"mode": "nonsense"}),
    "a curve that is no choice": lambda c: set_strings(c, {"torque_curve": "Linear"}),
    "no text": lambda c: set_strings(c, {"initial_state": "undeflected", "mode": None}),
    "a real as a text": lambda c: set_strings(c, {"mode": "quasistatic", FORCE: "0"}),
    "one bad number of two": lambda c: set_reals(
        c, ["joint[2].stiffness", "joint[3].damping"], [1e6, HUGE]
    ),
    "an output behind an input": lambda c: set_reals(c, [FORCE, TCP], [1.0] * 2 * WIDTH),
    "a text as a real": lambda c: set_reals(c, ["joint[2].stiffness", "mode"], [1e6, 0.0]),
    "no arrays": lambda c: call(
        "SetReal" if VERSION == "2" else "SetFloat64", c, None, c_size_t(1), None, *counted(1)
    ),
    "no place for values": lambda c: call(
        "GetReal" if VERSION == "2" else "GetFloat64", c, *vrs([TCP]), None, *counted(WIDTH)
    ),
    "an output and what is not there": lambda c: get_reals(c, [TCP, "mode"], WIDTH + 1),
    "an unknown category of messages": lambda c: log(c, "logStatusError", "logEverything", on=1),
    "no category of messages": lambda c: log(c, None, on=1),
    "no place for a state": lambda c: call(state_call("GetFMUstate"), c, None),
    "no state": lambda c: call(state_call("SetFMUstate"), c, None),
    "no bytes": lambda c: call(
        state_call("DeSerializeFMUstate"), c, None, c_size_t(9), byref(c_void_p())
    ),
}


def refusals():
    taken = []
    for name, act in REFUSED.items():
        c = in_phase("initialising")
        if answered(c, act):
            taken.append(name)
        FREE(c)
    return taken


def damaged(data):
    """Bytes cut, lengthened, and with one bit or byte other than it was."""
    draw = random.Random(15)
    yield from (b"", data[:1], data[: len(data) // 2], data[:-1], data + b"\0", b"\0" * len(data))
    places = {*range(60), *range(len(data) - 60, len(data)), *draw.choices(range(len(data)), k=300)}
    for k in sorted(places):
        for other in (data[k] ^ 1 << draw.randrange(8), data[k] ^ 0xFF):
            yield data[:k] + bytes([other]) + data[k + 1 :]


def states():
    """Damaged bytes are refused into a new place and into a state that is there, which stays."""
    c = in_phase("running")
    step(c)
    set_reals(c, [FORCE], [-300.0] * WIDTH)
    step(c, 0.01)
    kept = save(c)
    data = bytes_of(c, kept)
    step(c, 0.02)
    present = everything(c)
    taken = []
    for k, bad in enumerate(damaged(data)):
        place = kept.value
        if unpack(c, bad, kept if k % 2 else c_void_p()) == OK or kept.value != place:
            taken.append(k)
    assert everything(c) == present
    assert bytes_of(c, kept) == data
    assert call(state_call("SetFMUstate"), c, kept) == OK
    step(c, 0.02)
    assert everything(c) == present
    assert unpack(c, data, kept) == OK
    free_state(c, kept)
    FREE(c)
    return taken


def without_instance():
    return [name for name, act in CALLS.items() if "state" not in name and act(None) != ERROR]


found = {
    "pairs": pairs(),
    "refused calls that were taken": refusals(),
    "damaged states that were taken": states(),
    "calls without an instance that were taken": without_instance(),
}
Path(sys.argv[2]).write_text(json.dumps(found))
