"""The task by a container of the FMU Manipulation Toolbox, run in FMPy."""

from pathlib import Path

import numpy as np
from fmpy import simulate_fmu
from fmu_manipulation_toolbox.assembly import AssemblyNode

STEP = 1 / 128
TCP = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]

cell = AssemblyNode("Cell.fmu", step_size=STEP)
cell.add_fmu("ElasticRobot.fmu")
cell.add_start_value("ElasticRobot.fmu", "trajectory", str(Path("motion.csv").resolve()))
cell.make_fmu(Path("."))

result = simulate_fmu(
    "Cell.fmu",
    stop_time=1.0,
    step_size=STEP,
    output_interval=STEP,
    input=np.array([(0.0, 0.0), (1.0, -1000.0)], dtype=[("time", float), ("force.z", float)]),
    output=TCP,
)
np.savetxt("tcp.csv", np.array(result.tolist()), delimiter=",", fmt="%.17g")
