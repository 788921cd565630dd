"""PythonFMU's own library runs the slave; its status of an error is 4: alone.py FMU."""

import os
import sys

from fmpy.fmi1 import FMICallException
from fmu import POSE, Fmu, require_error

instance = Fmu(sys.argv[1]).instance().start()
instance.step(0.01)
before = instance.get(POSE)
try:
    instance.step(-0.01)
except FMICallException as error:
    require_error(error, 4)
else:
    raise AssertionError("a negative step was taken")
assert (instance.get(POSE) == before).all()
os._exit(0)  # past its destructors, which use what is freed
