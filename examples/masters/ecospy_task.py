"""The task by Ecos, whose library needs libtbb.so.12, which the package `tbb` installs beside it."""

import ctypes
import sys
from pathlib import Path

import numpy as np

if sys.platform == "linux":
    ctypes.CDLL(str(Path(sys.prefix, "lib", "libtbb.so.12")))
from ecospy import EcosSimulation, EcosSimulationStructure

STEP = 1 / 128
TCP = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]

structure = EcosSimulationStructure()
structure.add_model("robot", "ElasticRobot.fmu")
structure.add_parameter_set("start", {"robot::trajectory": "motion.csv"})
simulation = EcosSimulation(STEP, structure=structure)
simulation.init(parameter_set="start")

rows = []
for k in range(128):
    simulation.set_real("robot::force.z", -1000.0 * k * STEP)
    simulation.step()
    rows.append([simulation.get_time(), *(simulation.get_real(f"robot::{name}") for name in TCP)])
np.savetxt("tcp.csv", rows, delimiter=",", fmt="%.17g")
