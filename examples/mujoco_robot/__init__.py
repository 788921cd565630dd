"""A second implementation of the elastic robot: MuJoCo, from the same robot description.

It shares the description and the prescribed motion of the drives with `elastic_robot`, and nothing
else: kinematics, dynamics, torque curves, equilibrium and integration are MuJoCo's or written anew.
"""

from examples.mujoco_robot.elastic_model import ElasticModel
from examples.mujoco_robot.integrators import INTEGRATORS
from examples.mujoco_robot.multibody import MujocoRobot
from examples.mujoco_robot.simulation import Motion, MujocoSimulation

__all__ = ["INTEGRATORS", "ElasticModel", "Motion", "MujocoRobot", "MujocoSimulation"]
