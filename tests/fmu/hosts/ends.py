"""Instances err, are reset, freed and unloaded or not; then the process ends: ends.py FMU COUNT."""

import gc
import sys

from fmpy.fmi1 import FMICallException
from fmu import Fmu

fmu = Fmu(sys.argv[1])
kept = []
for k in range(int(sys.argv[2])):
    instance = fmu.instance().start()
    instance.step(0.01)
    try:
        instance.step(-0.01)
    except FMICallException:
        instance.slave.reset()
    if k % 4 == 3:
        kept.append(instance)
    else:
        instance.free()
    if k % 10 == 9:
        gc.collect()
print("the end", file=sys.stderr)
