"""An exported process along a path, without the project: process_path.py FMU PATH WRENCH."""

import sys

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import POSE, Fmu

# None of these can be imported from here on.
scipy = [name for name in sys.modules if name.partition(".")[0] == "scipy"]
sys.modules |= dict.fromkeys(["coupling", "elastic_robot", "process_slave.forces", "scipy", *scipy])
path = np.load(sys.argv[2])
process = Fmu(sys.argv[1]).instance("process").start()
wrench = []
for start, end, pose in zip(path["time"], path["time"][1:], path["pose"], strict=False):
    process.set(dict(zip(POSE, pose, strict=True)))
    process.slave.doStep(start, end - start)
    wrench.append(process.get())
np.save(sys.argv[3], wrench)
try:
    process.set({"tcp.y": float("nan")})
except FMICallException:
    process.free()
else:
    raise AssertionError("it was taken")
