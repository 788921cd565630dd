"""Damaged and foreign states are refused, and the instance goes on: foreign_states.py FMU OTHER."""

import sys

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import Fmu

fmu, other = Fmu(sys.argv[1]), Fmu(sys.argv[2])
instance, stranger = fmu.instance().start(), other.instance().start()
state = instance.slave.getFMUState()
data = instance.slave.serializeFMUstate(state)
instance.step(0.01)
expected = instance.get()


def refused(bad):
    try:
        instance.slave.setFMUState(bad())
    except FMICallException:
        np.testing.assert_array_equal(instance.get(), expected)
    else:
        raise AssertionError("a wrong state was taken")


def bytes_of(bad):
    return lambda: instance.slave.deSerializeFMUstate(bad)


middle = len(data) // 2
refused(bytes_of(b""))
refused(bytes_of(b"\x80\x04K\x01."))  # a pickle
refused(bytes_of(data[:middle]))
refused(bytes_of(data + b"\0"))
for k in range(0, len(data), 997):
    refused(bytes_of(data[:k] + bytes([data[k] ^ 1]) + data[k + 1 :]))
refused(bytes_of(stranger.slave.serializeFMUstate(stranger.slave.getFMUState())))
refused(stranger.slave.getFMUState)
instance.slave.setFMUState(bytes_of(data)())
instance.time = 0.0
instance.step(0.01)
np.testing.assert_array_equal(instance.get(), expected)
