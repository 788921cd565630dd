"""The task by FMPy's CVODE, model exchange; the force is held over a step by two rows where it jumps."""

import numpy as np
from fmpy import simulate_fmu

STEP = 1 / 128
TCP = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]

steps = np.arange(128)
time = np.ravel([steps * STEP, (steps + 1) * STEP], order="F")
force = np.zeros(256, dtype=[("time", float), ("force.z", float)])
force["time"], force["force.z"] = time, -1000.0 * np.repeat(steps, 2) * STEP
result = simulate_fmu(
    "ElasticRobot.fmu",
    fmi_type="ModelExchange",
    solver="CVode",
    stop_time=1.0,
    output_interval=STEP,
    relative_tolerance=1e-8,
    start_values={"trajectory": "motion.csv"},
    input=force,
    output=TCP,
    record_events=False,
)
np.savetxt("tcp.csv", np.array(result.tolist()), delimiter=",", fmt="%.17g")
