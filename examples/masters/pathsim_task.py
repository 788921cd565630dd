"""The task by PathSim, which writes every input and shows a step's result from its start on."""

import numpy as np
from pathsim import Connection, Simulation
from pathsim.blocks import Scope, Source
from pathsim_fmi import CoSimulationFMU

STEP = 1 / 128
TCP = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]

motion = np.genfromtxt("motion.csv", delimiter=",", names=True)
inputs = {"force.z": -1000.0 * motion["time"]}
for i in range(1, 7):
    for name in ("q", "qd", "qdd"):
        inputs[f"{name}_cmd[{i}]"] = motion[f"{name}{i}"]

start_values = {name: values[0] for name, values in inputs.items()}
robot = CoSimulationFMU("ElasticRobot.fmu", start_values=start_values, dt=STEP)
scope = Scope()
blocks, connections = [robot, scope], []
for name, values in inputs.items():
    source = Source(lambda t, values=values: np.interp(t, motion["time"], values))
    blocks.append(source)
    connections.append(Connection(source, robot[name]))
for k, name in enumerate(TCP):
    connections.append(Connection(robot[name], scope[k]))
Simulation(blocks, connections, dt=STEP, log=False).run(1.0)

recorded, values = scope.read()
rows = np.column_stack([recorded + STEP, *values])[:128]
np.savetxt("tcp.csv", rows, delimiter=",", fmt="%.17g")
