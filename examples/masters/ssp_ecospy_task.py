"""An SSP archive, system.ssp, in Ecos."""

import ctypes
import sys
from pathlib import Path

import numpy as np

if sys.platform == "linux":
    ctypes.CDLL(str(Path(sys.prefix, "lib", "libtbb.so.12")))
from ecospy import EcosSimulation

STEP, STOP = 0.01, 1.1
TCP = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]
WRENCH = ["force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z"]

simulation = EcosSimulation(STEP, ssp_path="system.ssp")
simulation.init()
rows = []
for _ in range(round(STOP / STEP)):
    simulation.step()
    pose = [simulation.get_real(f"robot::{name}") for name in TCP]
    wrench = [simulation.get_real(f"process::{name}") for name in WRENCH]
    rows.append([simulation.get_time(), *pose, *wrench])
np.savetxt("tcp.csv", rows, delimiter=",", fmt="%.17g")
