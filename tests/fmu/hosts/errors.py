"""Each wrong call is an error with a sentence, the instance is reset and right again: errors.py FMU."""

import sys

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import Fmu, require_error

fmu = Fmu(sys.argv[1])
REAL, STRING = fmu.references["force.x"], fmu.references["mode"]
nan, inf = float("nan"), float("inf")


def real(**values):
    return lambda i: i.set({name.replace("__", "."): value for name, value in values.items()})


WRONG = {
    "NaN": real(force__x=nan),
    "infinite": real(moment__y=inf),
    "output": real(tcp__x=1.0),
    "negative stiffness": lambda i: (i.set({"joint[2].stiffness": -1.0}), i.step(0.01)),
    "zero stiffness": lambda i: (i.set({"joint[1].tilt[1].stiffness": 0.0}), i.step(0.01)),
    "negative damping": lambda i: (i.set({"joint[3].damping": -1.0}), i.step(0.01)),
    "negative backlash": lambda i: (i.set({"joint[4].backlash": -1e-9}), i.step(0.01)),
    "unknown real": lambda i: i.slave.setReal([5000], [1.0]),
    "unknown real read": lambda i: i.slave.getReal([5000]),
    "huge reference": lambda i: i.slave.getReal([4294967295]),
    "string as real": lambda i: i.slave.getReal([STRING]),
    "real as string": lambda i: i.slave.getString([REAL]),
    "integer": lambda i: i.slave.getInteger([REAL]),
    "set integer": lambda i: i.slave.setInteger([REAL], [1]),
    "boolean": lambda i: i.slave.getBoolean([REAL]),
    "set boolean": lambda i: i.slave.setBoolean([REAL], [True]),
    "string too late": lambda i: i.slave.setString([STRING], ["quasistatic"]),
    "negative step": lambda i: i.slave.doStep(0.0, -0.01),
    "NaN step": lambda i: i.slave.doStep(0.0, nan),
    "infinite step": lambda i: i.slave.doStep(0.0, inf),
    "step elsewhere": lambda i: i.slave.doStep(3.0, 0.01),
    "step at NaN": lambda i: i.slave.doStep(nan, 0.01),
}
expected = fmu.instance().start()
expected.step(0.01)
for _ in range(3):
    instance = fmu.instance()
    for name, wrong in WRONG.items():
        instance.start()
        before = instance.get()
        print(f"## {name}", file=sys.stderr, flush=True)
        try:
            wrong(instance)
        except FMICallException as error:
            require_error(error)
        else:
            raise AssertionError(f"{name}: no error")
        np.testing.assert_array_equal(instance.get(), before, err_msg=name)
        instance.slave.reset()
    instance.start()
    instance.step(0.01)
    np.testing.assert_array_equal(instance.get(), expected.get())
    instance.free()
# Outputs computed when they are read, as the compliance is, are still those of the old gravity.
before = fmu.instance().start(strings={"mode": "quasistatic"}).get()
instance = fmu.instance().start(strings={"mode": "quasistatic"})  # which has not read them yet
instance.set({"gravity.z": -1e9})
try:
    instance.step(0.01)
except FMICallException as error:
    require_error(error)
else:
    raise AssertionError("gravity: no error")
instance.set({"gravity.z": -9.81})
np.testing.assert_array_equal(instance.get(), before)
