"""What python_host passes on to the library behind it: passing_on.py LIBRARY INNER RESOURCES LOG."""

import ctypes
import sys
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path

library, log = ctypes.CDLL(sys.argv[1]), Path(sys.argv[4])
LOGGER = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
heard = []


class Callbacks(ctypes.Structure):
    _fields_ = [
        ("logger", LOGGER),
        ("allocate", c_void_p),
        ("free", c_void_p),
        ("finished", c_void_p),
        ("environment", c_void_p),
    ]


callbacks = Callbacks(
    LOGGER(lambda env, name, status, category, text: heard.append((env, status, category, text))),
    environment=77,
)
library.fmi2Instantiate.restype = c_void_p


RESOURCES = sys.argv[3].encode()


def instantiate(resources=RESOURCES, guid=b"{right}", kind=1, logging=1):
    found = library.fmi2Instantiate(
        b"robot", kind, guid, resources, byref(callbacks), c_int(0), c_int(logging)
    )
    return c_void_p(found) if found else None


def reached():
    lines = log.read_text().splitlines() if log.exists() else []
    log.write_text("")
    return lines


def new(kind, value):
    return (kind * 1)(value)


def twice_decoded():
    folder = Path(sys.argv[2]).parent / "a%20b"
    folder.mkdir()
    (folder / "slavemodule.txt").write_text("slave\n")
    return folder.as_uri().encode()


# Refused before PythonFMU's library is asked.
for wrong, told in (
    ({"kind": 0}, b"co-simulation only"),
    ({"guid": b"{wrong}"}, b"GUID: expected that of modelDescription.xml, got '{wrong}'"),
    ({"guid": None}, b"GUID: expected that of modelDescription.xml, got ''"),
    ({"resources": b"file:///nowhere"}, b"slavemodule.txt, got 'file:///nowhere'"),
    ({"resources": None}, b"slavemodule.txt, got ''"),
    ({"resources": twice_decoded()}, b"resources: expected a folder without %%20 in its name"),
):
    assert instantiate(**wrong) is None, wrong
    env, status, _, text = heard.pop()
    assert (env, status) == (77, 3)
    assert told in text, text
assert not heard
assert reached() == []

robot = instantiate()
(first,) = reached()
folder = Path(first.split()[4])
assert folder.samefile(Path(sys.argv[2]).parent / "resources"), first
assert first == f"fmi2Instantiate robot 1 {{right}} {folder} 0 1", first
inner = ctypes.CDLL(sys.argv[2])
answer = c_int.in_dll(inner, "inner_answer")
message_status = c_int.in_dll(inner, "inner_message_status")
message = (ctypes.c_char * 300).in_dll(inner, "inner_message")

two, real, text = c_size_t(2), new(c_double, 0.5), new(c_char_p, b"text")
vrs, others = new(c_uint, 7), new(c_uint, 8)
number = new(c_int, 6)
CALLS = {
    "fmi2SetupExperiment 1 0.25 3 1 4": (1, c_double(0.25), c_double(3), 1, c_double(4)),
    "fmi2EnterInitializationMode": (),
    "fmi2ExitInitializationMode": (),
    "fmi2Terminate": (),
    "fmi2GetReal 7 2 0.5": (vrs, two, real),
    "fmi2SetReal 7 2 0.5": (vrs, two, real),
    "fmi2GetInteger 7 2 6": (vrs, two, number),
    "fmi2SetInteger 7 2 6": (vrs, two, number),
    "fmi2GetBoolean 7 2 6": (vrs, two, number),
    "fmi2SetBoolean 7 2 6": (vrs, two, number),
    "fmi2GetString 7 2 text": (vrs, two, text),
    "fmi2SetString 7 2 text": (vrs, two, text),
    "fmi2GetDirectionalDerivative 7 2 8 3 0.5 0.5": (vrs, two, others, c_size_t(3), real, real),
    "fmi2SetRealInputDerivatives 7 2 6 0.5": (vrs, two, number, real),
    "fmi2GetRealOutputDerivatives 7 2 6 0.5": (vrs, two, number, real),
    "fmi2DoStep 1.5 0.25 1": (c_double(1.5), c_double(0.25), 1),
    "fmi2CancelStep": (),
    "fmi2GetRealStatus 1 0.5": (1, real),
    "fmi2GetIntegerStatus 2 6": (2, number),
    "fmi2GetBooleanStatus 2 6": (2, number),
    "fmi2GetStringStatus 2 text": (2, text),
    "fmi2Reset": (),
}
# A status of a step under way is not PythonFMU's to tell.
assert library.fmi2GetStatus(robot, 0, byref(c_int(7))) == 2
assert heard.pop()[1:3] == (2, b"logStatusDiscard")
EXCEPTION = b"Fatal py exception encountered: [doStep]\nError('100 %s')"
for line, arguments in CALLS.items():
    function = getattr(library, line.split()[0])
    message.value = b""
    # OK, warning, discard, error, fatal (a Python exception), pending.
    for answer.value, expected in ((0, 0), (1, 1), (2, 2), (3, 3), (4, 3), (5, 5)):
        if line == "fmi2Reset" and answer.value == 4:
            continue
        assert function(robot, *arguments) == expected, (line, answer.value)
        assert reached() == [line], line
        assert not heard
    # An exception that nobody has told yet is told as an error, safe for printf.
    answer.value, message_status.value, message.value = 4, 4, EXCEPTION
    if line != "fmi2Reset":
        assert function(robot, *arguments) == 3
        assert heard == [(77, 3, b"logStatusError", b"Error('100 %%s')")], heard
        heard.clear()
    reached()
# What the slave has formatted like printf already is told as it is.
message.value = b"Fatal py exception encountered: [doStep]\nrobot: 100 %%"
assert library.fmi2Terminate(robot) == 3
assert heard.pop() == (77, 3, b"logStatusError", b"robot: 100 %%")
# The log is the host's to turn on and off.
off, on = c_int(0), c_int(1)
for names, status, told in (
    ((), 0, 0),
    ((b"logStatusError",), 0, 1),
    ((b"logStatusWarning",), 0, 0),
    ((b"logAll", b"logStatusWarning"), 0, 1),
    ((b"logStatusDiscard", b"logNothing"), 3, 2),
    ((None,), 3, 2),
):
    categories = (c_char_p * len(names))(*names)
    assert (
        library.fmi2SetDebugLogging(robot, c_int(bool(names)), c_size_t(len(names)), categories)
        == status
    )
    library.fmi2Terminate(robot)
    assert len(heard) == told, (names, heard)
    heard.clear()
assert library.fmi2SetDebugLogging(robot, off, c_size_t(0), None) == 0
assert library.fmi2SetDebugLogging(robot, on, c_size_t(0), None) == 0
reached()
# Texts that Python would not read are not passed on.
for bad in (b"\xff", b"mot\xc3", b"\xc0\x80", b"\xed\xa0\x80", b"\xf5\x80\x80\x80"):
    assert library.fmi2SetString(robot, vrs, c_size_t(1), new(c_char_p, bad)) == 3
    assert heard.pop()[3] == b"string: expected UTF-8, got other bytes"
# A reference that is taken for the last time is none of the FMU's.
answer.value, message.value = 0, b""
assert library.fmi2SetReal(robot, new(c_uint, 1 << 30), c_size_t(1), real) == 3
assert heard.pop()[3] == (
    b"value reference of a real variable: expected one of this FMU, got 1073741824"
)
assert reached() == []
# Other messages come through as they are; those without a category get one.
answer.value, message_status.value, message.value = 0, 3, b"100 %%"
assert library.fmi2Terminate(robot) == 0
assert heard.pop() == (77, 3, b"logAll", b"100 %%")
message.value = b""
reached()

# States: a state that is replaced or freed is freed once, and its place emptied.
state, other, size = c_void_p(), c_void_p(), c_size_t()
assert library.fmi2GetFMUstate(robot, byref(state)) == 0
assert library.fmi2GetFMUstate(robot, byref(state)) == 0
assert library.fmi2SetFMUstate(robot, state) == 0
assert library.fmi2SerializedFMUstateSize(robot, state, byref(size)) == 0
buffer = ctypes.create_string_buffer(size.value + 20)
assert library.fmi2SerializeFMUstate(robot, state, buffer, c_size_t(size.value + 20)) == 0
assert buffer.raw == b"state" + bytes(20)
assert library.fmi2DeSerializeFMUstate(robot, b"state", size, byref(other)) == 0  # tried as well
assert library.fmi2FreeFMUstate(robot, byref(state)) == 0
assert state.value is None
assert library.fmi2FreeFMUstate(robot, byref(state)) == 0
assert reached() == [
    "fmi2GetFMUstate",
    "fmi2GetFMUstate",
    "fmi2FreeFMUstate 1",
    "fmi2SetFMUstate 2",
    "fmi2SerializedFMUstateSize 2",
    "fmi2SerializedFMUstateSize 2",
    "fmi2SerializeFMUstate 2 5",
    "fmi2DeSerializeFMUstate state",
    "fmi2GetFMUstate",
    "fmi2SetFMUstate 3",
    "fmi2SetFMUstate 4",
    "fmi2FreeFMUstate 4",
    "fmi2FreeFMUstate 2",
]
assert library.fmi2SetFMUstate(robot, None) == 3
assert library.fmi2SerializedFMUstateSize(robot, None, byref(size)) == 3
assert library.fmi2SerializeFMUstate(robot, other, buffer, c_size_t(4)) == 3
assert [text for _, _, _, text in heard] == [
    b"state: expected one that this FMU has saved, got none",
    b"state: expected one that this FMU has saved, got none",
    b"buffer: expected at least the state's size, got less",
]
heard.clear()
for failing in (library.fmi2GetFMUstate, library.fmi2DeSerializeFMUstate):
    answer.value, kept = 4, other.value
    middle = (b"state", size) if failing is library.fmi2DeSerializeFMUstate else ()
    assert failing(robot, *middle, byref(other)) == 3
    assert other.value == kept
reached()

# A reset that fails leaves nothing behind: PythonFMU's instance is not touched again.
answer.value, message_status.value, message.value = 4, 4, EXCEPTION
assert library.fmi2Reset(robot) == 4
assert heard.pop()[1:] == (4, b"logStatusFatal", b"Error('100 %%s')")
answer.value, message.value = 0, b""
assert library.fmi2Reset(robot) == 4
assert library.fmi2DoStep(robot, c_double(0), c_double(1), 1) == 4
assert library.fmi2GetFMUstate(robot, byref(state)) == 4
library.fmi2FreeInstance(robot)
assert reached() == ["fmi2Reset"]

# A failure in there has its reason told also where the log is off; an ordinary instance is freed.
answer.value, message.value = 4, b"Fatal py exception encountered: [ctor]\nError('no numpy')"
assert instantiate(logging=0) is None
assert heard.pop()[1:] == (3, b"logStatusError", b"Error('no numpy')")
answer.value, message.value = 0, b""
robot = instantiate(logging=0)
library.fmi2FreeInstance(robot)
library.fmi2FreeInstance(None)
assert library.fmi2Terminate(None) == 3
assert reached()[-1] == "fmi2FreeInstance 1"
