"""The robot as PythonFMU's own examples would have it: what the FMU's checks must refuse."""

import random

import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real, String

from coupling.files.robot_file import load_robot, shipped_robots
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand


class StockRobot(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.values = {"force.z": 0.0, "tcp.x": 0.0, "tcp.y": 0.0, "tcp.z": 0.0}
        self.values |= {"joint[2].stiffness": 1.0 / 3.0, "mode": "dynamic"}
        causalities = ["input", "output", "output", "output", "parameter"]
        for name, causality in zip(self.values, causalities, strict=False):
            kind = "tunable" if causality == "parameter" else "continuous"
            real = Real(
                name,
                causality=Fmi2Causality[causality],
                variability=Fmi2Variability[kind],
                **self.access(name),
            )
            self.register_variable(real, nested=False)
        self.register_variable(
            String(
                "mode",
                causality=Fmi2Causality.parameter,
                variability=Fmi2Variability.fixed,
                **self.access("mode"),
            ),
            nested=False,
        )
        self.noise = random.random()
        self.time, self.robot = 0.0, None

    def access(self, name):
        return {
            "getter": lambda: self.values[name],
            "setter": lambda value: self.values.update({name: value}),
        }

    def exit_initialization_mode(self):
        self.robot = ElasticRobot(load_robot(shipped_robots()["icme2008"]))
        self.drives = HeldCommand(0.0, np.zeros(6), np.zeros(6), np.zeros(6))
        self.robot.reset(0.0, self.drives, Load())

    def do_step(self, current_time, step_size):
        wrench = np.array([0.0, 0.0, self.values["force.z"], 0.0, 0.0, 0.0])
        self.time += step_size
        self.robot.step(self.time, self.drives, Load(wrench))
        for axis, value in zip("xyz", self.robot.tcp()[:3].tolist(), strict=True):
            self.values[f"tcp.{axis}"] = value
        return True
