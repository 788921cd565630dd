"""The robot as PythonFMU's own examples would have it: what the FMU's checks must refuse."""

import random

import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Real, String

from elastic_robot.robot import ElasticRobot
from elastic_robot.robot_file import load_robot, shipped_robots
from elastic_robot.trajectory import HeldCommand


class StockRobot(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.force_z = 0.0
        self.x, self.y, self.z = 0.0, 0.0, 0.0
        self.stiffness = 1.0 / 3.0
        self.mode = "dynamic"
        self.register_variable(Real("force_z", causality=Fmi2Causality.input))
        for name in ("x", "y", "z"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        self.register_variable(Real("stiffness", causality=Fmi2Causality.parameter))
        self.register_variable(String("mode", causality=Fmi2Causality.parameter))
        self.noise = random.random()
        self.robot = None

    def exit_initialization_mode(self):
        self.robot = ElasticRobot(load_robot(shipped_robots()["icme2008"]))
        self.drives = HeldCommand(0.0, np.zeros(6), np.zeros(6), np.zeros(6))
        self.robot.reset(0.0, self.drives, np.zeros(6))

    def do_step(self, current_time, step_size):
        wrench = np.array([0.0, 0.0, self.force_z, 0.0, 0.0, 0.0])
        self.robot.step(current_time + step_size, self.drives, wrench)
        self.x, self.y, self.z = self.robot.tcp()[:3].tolist()
        return True
