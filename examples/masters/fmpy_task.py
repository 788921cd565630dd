"""The task by FMPy's `simulate_fmu`, with an input file and a plot."""

from pathlib import Path

import numpy as np
from fmpy import simulate_fmu
from fmpy.util import create_plotly_figure, read_csv

STEP = 1 / 128
TCP = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]

Path("force.csv").write_text("time,force.z\n0,0\n1,-1000\n")
result = simulate_fmu(
    "ElasticRobot.fmu",
    stop_time=1.0,
    step_size=STEP,
    output_interval=STEP,
    start_values={"trajectory": "motion.csv"},
    input=read_csv("force.csv"),  # linear between its rows
    output=TCP,
)
create_plotly_figure(result, names=["tcp.x", "tcp.z"]).write_html("tcp.html")
np.savetxt("tcp.csv", np.array(result.tolist()), delimiter=",", fmt="%.17g")
