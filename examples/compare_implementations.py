"""Two implementations of one elastic robot: this project's, and MuJoCo's of the same description.

Section 3.3 of the source paper compares the same model in ADAMS and SimMechanics: (a) kinematics, (b)
rest under load, (c) the motion along an ISO 9283 path with each torque curve.  Here again, with
`elastic_robot` and `examples.mujoco_robot`; docs/comparison.md has the figures.
"""

from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastic_robot.coupling.files.robot_file import find_robot, load_robot
from elastic_robot.coupling.path.frame import Frame
from elastic_robot.coupling.path.histories import ToolPath
from elastic_robot.coupling.path.interpolation import InterpolatedPath
from elastic_robot.coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.coupling.toolpaths import Iso9283
from elastic_robot.description import Robot
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import Drives, HeldCommand, Trajectory
from examples.mujoco_robot import MujocoSimulation

robot = load_robot(find_robot("icme2008"))

# What is compared, and the time steps [s] MuJoCo needs for it; the smooth curve is a Python callback.
CURVES = {
    "linear": "no backlash",
    "backlash": "backlash",
    "spline": "backlash as a smooth spline",
}
STEPS = {"linear": 1.25e-4, "backlash": 1.25e-4, "spline": 2.5e-4}
TOLERANCE = 1e-8  # [m], of our stepper

# (a), (b): ten postures [rad], and a load at the tool [N, N m].
POSTURES = np.loadtxt(
    Path(__file__).parent.parent / "tests" / "reference" / "poses.csv", delimiter=",", skiprows=1
)[:, 1:]
NO_LOAD = np.zeros(6)
LOAD = np.array([200.0, -150.0, -1000.0, 10.0, 20.0, -5.0])

# (c): squares, diagonal and circles in a plane inclined by 45 degrees.
SIZE, FEED, BLEND = 0.4, 0.2, 0.15  # [m], [m/s], [s]
SAMPLE = 0.005  # [s]
part = Frame(np.array([1.7, 0.0, 1.0]), Rotation.from_euler("y", 45.0, degrees=True))
HOME = np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])
INSTANT = np.array([0.0, 1e-3])  # [s], of a robot at rest
RELEASE_TIME = 10.0  # [s], in which the robot let go undeflected comes to rest


@dataclass(frozen=True)
class Both:
    """The same experiment in both implementations: tool poses over time, or over cases."""

    ours: ToolPath
    mujoco: ToolPath

    @property
    def distance(self) -> np.ndarray:
        """Distances between the two tools [m], (n,)."""
        return self.ours.distance_to(self.mujoco)

    @property
    def angle(self) -> np.ndarray:
        """Angles between the two tools [rad], (n,)."""
        turned: np.ndarray = np.linalg.norm(self.ours.deviation_from(self.mujoco)[0, :, 3:], axis=1)
        return turned


def still(q: np.ndarray) -> HeldCommand:
    """Return drives that stand."""
    return HeldCommand(0.0, q, np.zeros_like(q), np.zeros_like(q))


@dataclass(frozen=True)
class Experiment:
    """Drives over time under a constant wrench; the first pose is that of the start."""

    curve: str
    drives: Drives
    times: np.ndarray
    model: Robot = robot
    wrench: np.ndarray = field(default_factory=lambda: NO_LOAD)
    undeflected: bool = False

    def ours(self) -> ToolPath:
        """Simulate with this project's implementation."""
        model = ElasticRobot(self.model, self.curve, tolerance=TOLERANCE)
        model.reset(self.times[0], self.drives, Load(self.wrench), self.undeflected)
        poses = [model.tcp()]
        for end in self.times[1:]:
            model.step(end, self.drives, Load(self.wrench))
            poses.append(model.tcp())
        return ToolPath(self.times, np.array(poses))

    def mujoco(self, step: float) -> ToolPath:
        """Simulate with MuJoCo, time step [s]."""
        load = np.tile(self.wrench, (len(self.times), 1))
        simulation = MujocoSimulation(
            self.model, self.curve, self.drives, self.times, "RK4", step, load, self.undeflected
        )
        return ToolPath(self.times, simulation.motion(simulation.run()).pose)

    def both(self) -> Both:
        """Simulate with both."""
        return Both(self.ours(), self.mujoco(STEPS[self.curve]))


def at_rest(model: Robot, curve: str, wrench: np.ndarray) -> Both:
    """Return the tool at rest in all postures: each implementation's own equilibrium."""
    starts = [Experiment(curve, still(q), INSTANT, model, wrench).both() for q in POSTURES]
    number = np.arange(len(POSTURES), dtype=float)
    ours = np.array([both.ours.pose[0, 0] for both in starts])
    return Both(
        ToolPath(number, ours),
        ToolPath(number, np.array([both.mujoco.pose[0, 0] for both in starts])),
    )


def kinematics() -> Both:
    """(a): without gravity and load the elastic robot is the rigid one."""
    return at_rest(replace(robot, gravity=(0.0, 0.0, 0.0)), "backlash", NO_LOAD)


@cache
def desired(blend: float = BLEND) -> ToolPath:
    """Return the ISO 9283 path at even times, until it rests."""
    shape = Iso9283(kind="iso9283", size_m=SIZE, feed_m_s=FEED, blend_s=blend, sample_s=SAMPLE)
    told = shape.path(part)
    times = SAMPLE * np.arange(np.ceil(told.time[-1] / SAMPLE) + 1)
    return ToolPath(times, InterpolatedPath(told).at(np.minimum(times, told.time[-1])).pose)


@cache
def planned(blend: float = BLEND) -> Trajectory:
    """Return the drives that lead the rigid robot along the path."""
    joints = InverseKinematics(robot, HOME).plan(desired(blend))
    return Trajectory(joints.time, joints.q[0])


def iso_path(curve: str, end: float = np.inf, blend: float = BLEND) -> Experiment:
    """(c): the ISO 9283 path up to a time [s], from rest."""
    times = desired(blend).time
    return Experiment(curve, planned(blend), times[times <= end + 1e-9])


def release(curve: str) -> Experiment:
    """Let the robot go undeflected at the path's start; gravity bends it until it rests."""
    times = np.arange(round(RELEASE_TIME / SAMPLE) + 1) * SAMPLE
    return Experiment(curve, still(start_posture()), times, undeflected=True)


def rest_at_start(curve: str) -> Both:
    """Return the tool at rest at the path's start."""
    return Experiment(curve, still(start_posture()), INSTANT).both()


def start_posture() -> np.ndarray:
    """Return the drive angles at the path's start [rad], (6,)."""
    return planned().at(np.zeros(1))[0][0]


def settling_time(path: ToolPath, share: float = 0.05) -> float:
    """Return when the tool stays nearer than a share of its first distance to where it ends [s]."""
    distance = np.linalg.norm(path.position[0] - path.position[0, -1], axis=1)
    return float(path.time[np.flatnonzero(distance > share * distance[0])[-1] + 1])


def rms(values: np.ndarray) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    both = kinematics()
    print(f"(a) kinematics: {both.distance.max():.1e} m, {both.angle.max():.1e} rad apart")
    for curve, name in CURVES.items():
        for load, text in ((NO_LOAD, "gravity"), (LOAD, "gravity and load")):
            both = at_rest(robot, curve, load)
            print(f"(b) rest {name}, {text}: {both.distance.max():.1e} m apart")
    for curve, name in CURVES.items():
        rest = rest_at_start(curve).ours.position[0, 0] - desired().position[0, 0]
        print(f"sag {name}: {1e3 * rest[2]:.3f} mm")
        both = release(curve).both()
        times = settling_time(both.ours), settling_time(both.mujoco)
        print(f"released {name}: settles in {times[0]:.3f} s (MuJoCo {times[1]:.3f} s)")
    for curve, name in CURVES.items():
        both = iso_path(curve).both()
        off = both.ours.distance_to(desired())
        print(
            f"(c) path {name}: at most {1e3 * off.max():.2f} mm from the rigid path;"
            f" implementations {both.distance.max():.1e} m apart, rms {rms(both.distance):.1e} m"
        )
