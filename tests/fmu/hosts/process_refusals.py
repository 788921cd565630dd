"""An exported process refuses a pose many times and loses no references: process_refusals.py FMU."""

import gc
import sys

from fmpy.fmi1 import FMICallException
from fmu import Fmu


def references():
    found = [o for o in gc.get_objects() if isinstance(o, type) and o.__name__ == "ProcessSlave"]
    return sum(map(sys.getrefcount, found))


process = Fmu(sys.argv[1]).instance().start()
before = references()
assert before > 0
for _ in range(50):
    try:
        process.set({"tcp.y": float("nan")})
    except FMICallException:
        continue
    raise AssertionError("it was taken")
assert references() == before
process.free()
