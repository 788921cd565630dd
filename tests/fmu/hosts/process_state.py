"""An exported process is taken back to saved states, by handle and by bytes: process_state.py FMU."""

import sys

import numpy as np
from fmu import Fmu

fmu = Fmu(sys.argv[1])
process, other = fmu.instance().start(), fmu.instance().start()
flags = fmu.description.coSimulation
assert flags.canGetAndSetFMUstate
assert flags.canSerializeFMUstate


def pressed(instance, time, depth):
    """Values after a step of 10 ms at a depth of the tool [m]."""
    instance.set({"tcp.z": -depth})
    instance.slave.doStep(time, 0.01)
    return instance.get()


start = process.slave.getFMUState()
first = pressed(process, 0.0, 1e-3)
state = process.slave.getFMUState()
data = process.slave.serializeFMUstate(state)
second = pressed(process, 0.01, 2e-3)
assert not np.array_equal(first, second)

process.slave.setFMUState(state)
np.testing.assert_array_equal(process.get(), first)
np.testing.assert_array_equal(pressed(process, 0.01, 2e-3), second)
process.slave.setFMUState(start)  # before the first step the wrench follows the pose at once
process.set({"tcp.z": -1e-3})
np.testing.assert_array_equal(process.get()[:6], first[:6])

other.slave.setFMUState(other.slave.deSerializeFMUstate(data))
np.testing.assert_array_equal(other.get(), first)
assert other.slave.serializeFMUstate(other.slave.getFMUState()) == data
np.testing.assert_array_equal(pressed(other, 0.01, 2e-3), second)
process.free()
other.free()
