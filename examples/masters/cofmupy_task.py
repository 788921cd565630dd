"""The task by CoFMUPy, which sets reals only and labels a step's end with the time of its start."""

import json

import numpy as np
import pandas
from cofmupy import Coordinator

STEP = 1 / 128
TCP = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]

motion = pandas.read_csv("motion.csv", float_precision="round_trip")
inputs = pandas.DataFrame({"t": motion["time"], "force.z": -1000.0 * motion["time"]})
for i in range(1, 7):
    for name in ("q", "qd", "qdd"):
        inputs[f"{name}_cmd[{i}]"] = motion[f"{name}{i}"]
inputs.to_csv("inputs.csv", index=False)

names = inputs.columns[1:]
system = {
    "fmus": [
        {
            "id": "robot",
            "name": "robot",
            "path": "ElasticRobot.fmu",
            "initialization": dict(inputs.loc[0, names]),
        }
    ],
    "connections": [
        {
            "source": {"type": "csv", "path": "inputs.csv", "variable": name},
            "target": {"type": "fmu", "id": "robot", "variable": name},
        }
        for name in names
    ],
}
with open("system.json", "w") as file:
    json.dump(system, file)

coordinator = Coordinator()
coordinator.start("system.json")
coordinator.run_simulation(STEP, 1.0)
values = coordinator.get_results()
end_of_step = np.array(values["time"]) + STEP
rows = np.column_stack([end_of_step, *(values["robot", name] for name in TCP)])
np.savetxt("tcp.csv", rows, delimiter=",", fmt="%.17g")
