"""The inverse of robots whose gears have hysteresis, on a plain simulation; and who refuses them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from slipping_robot import replayed, with_hysteresis

from coupling.files.robot_file import load_robot, shipped_robots
from coupling.inverse.diagnosis import GearLoads, diagnosed
from coupling.inverse.inversion import DesiredMotion, MovingRobot, joint_path
from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.link_task import LinkMotion
from coupling.inverse.response import AlongMotion
from coupling.path.controller import Controller
from coupling.path.histories import ToolPath, WrenchHistory, poses
from coupling.path.joint_path import JointPath
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.inverter import Inverter
from coupling.run.exact_command import exact_command

HOME = np.array([0.0, -0.2, 0.4, 0.1, 0.7, 0.0])
TORQUES = (120.0, 120.0, 90.0, 25.0, 20.0, 0.0)  # [N m]
END = 1.0  # [s]


@pytest.fixture(scope="module")
def plain():
    return load_robot(shipped_robots()["icme2008"])


@pytest.fixture(scope="module")
def robot(plain):
    return with_hysteresis(plain, TORQUES)


@pytest.fixture(scope="module")
def wanted(robot):
    """To and fro along a line under a force that comes and goes."""
    model = MovingRobot(robot, "linear").model
    (middle,), (axes,) = model.desk.placements(model.chain.theta(HOME)[None])
    time = np.linspace(0.0, END, 251)
    u = np.clip(time / (0.9 * END), 0.0, 1.0)
    along = np.sin(np.pi * u) ** 5
    position = middle + np.outer(along, [0.02, 0.05, -0.04])
    path = ToolPath(time, poses(position, Rotation.from_matrix(np.tile(axes, (251, 1, 1)))))
    loads = np.zeros((251, 6))
    loads[:, :3] = np.outer(np.sin(np.pi * time / END) ** 4, [150.0, -90.0, 300.0])
    rigid = InverseKinematics(robot, HOME).plan(path)
    return DesiredMotion(path, rigid, WrenchHistory(time, loads))


def run(robot, curve, wanted, command, theta, step=5e-4, end=END):
    """Path and deflections of the robot from rest in the pose of links theta, (angles,)."""
    chain = MovingRobot(robot, curve).model.chain
    rest = (theta - chain.theta(command.q[0][0]))[chain.elastic]

    def wrench(time):
        return wanted.wrench.at(np.minimum(time, END))[0]

    return replayed(robot, curve, command, wrench, rest, step, end)


def missed(robot, curve, wanted, command, links: LinkMotion):
    """Largest distance of the simulated tool from the path [m]."""
    path, _ = run(robot, curve, wanted, command, links.theta.at(np.zeros(1))[0])
    (found,) = path.position
    seen = np.searchsorted(path.time, wanted.path.time - 1e-9)
    return np.linalg.norm(found[seen] - wanted.path.position[0], axis=1).max()


def inverted(robot, curve, wanted, controller=Controller()):  # noqa: B008
    inverse = MovingRobot(robot, curve).invert(
        wanted, controller, JointLimits.of(robot, None), lambda what, done, total: None
    )
    return joint_path(inverse.command), inverse


@pytest.mark.parametrize("curve", ["linear", "backlash", "spline"])
def test_the_tool_stays_on_its_path_though_gears_slip(robot, plain, wanted, curve):
    """Within 0.1 um; the command of the robot without elements leaves more than 20."""
    command, inverse = inverted(robot, curve, wanted)
    assert missed(robot, curve, wanted, command, inverse.links) < 1e-7
    other, _ = inverted(plain, curve, wanted)
    assert missed(robot, curve, wanted, other, inverse.links) > 2e-5


def test_the_exact_drive_keeps_the_tool_on_its_path(robot, wanted):
    """Its rows are a millisecond apart."""
    _, inverse = inverted(robot, "backlash", wanted)
    exact = exact_command(MovingRobot(robot, "backlash"), wanted)
    assert missed(robot, "backlash", wanted, exact, inverse.links) < 5e-8


def test_the_tool_answers_a_change_of_the_command_as_gears_that_stick_and_slip_let_it(
    robot, wanted
):
    """The response of the polish, beside the difference of two simulations."""
    moving = MovingRobot(robot, "backlash")
    command, inverse = inverted(robot, "backlash", wanted)
    theta = inverse.links.theta
    begin, joint, change = 60, 0, 1e-8
    turned = inverse.command.coefficients.copy()
    turned[begin, joint] += change
    other = joint_path(replace(inverse.command, coefficients=turned))
    first = theta.at(np.zeros(1))[0]
    here = slice(16 * (begin - 5), 16 * (begin + 20) + 1, 16)
    (path, x), (pushed, _) = (
        run(robot, "backlash", wanted, own, first, 2.5e-4, 2.5e-4 * (here.stop - 1))
        for own in (command, other)
    )
    seen = (pushed.position[0][here] - path.position[0][here]) / change

    def told(elements):
        along = AlongMotion(moving.model, moving.curve, theta, inverse.wrench, elements)
        times, free = path.time[here], range(begin, begin + 1)
        answer = along.response(inverse.command, free, times, x[here], x[: here.start + 1 : 16])
        return answer[:, :3, 0, joint]

    size = np.abs(seen).max()
    assert np.abs(told(moving.elements) - seen).max() < 0.02 * size
    none = tuple(replace(own, slip_torque=0.0 * own.slip_torque) for own in moving.elements)
    assert np.abs(told(none) - seen).max() > 0.05 * size


class Simulated:
    """The plain simulation in the place of a robot's FMU."""

    def __init__(self, robot, wanted, theta):
        self._robot, self._wanted, self._theta = robot, wanted, theta

    def deflected(self, command: JointPath, wrench: WrenchHistory, coordinates: int):
        path, x = run(self._robot, "backlash", self._wanted, command, self._theta)
        assert x.shape[1] == coordinates
        seen = np.searchsorted(path.time, wrench.time - 1e-9)
        return path.at_rows(seen), x[seen]


def test_the_polish_lowers_what_limited_drives_leave(robot, wanted):
    free, inverse = inverted(robot, "backlash", wanted)
    chain = MovingRobot(robot, "backlash").model.chain
    cap = 1.05 * np.abs(inverse.links.theta.at(free.time, 2)[:, chain.drive]).max()
    controller = Controller(max_acceleration=cap)
    limited = MovingRobot(robot, "backlash").invert(
        wanted, controller, JointLimits.of(robot, cap), lambda what, done, total: None
    )
    simulated = Simulated(robot, wanted, inverse.links.theta.at(np.zeros(1))[0])
    inverter = Inverter(MovingRobot(robot, "backlash"), simulated, 12)
    polished = inverter.invert(wanted, controller, 1e-7, lambda event: None).joints
    before = missed(robot, "backlash", wanted, joint_path(limited.command), inverse.links)
    after = missed(robot, "backlash", wanted, polished, inverse.links)
    assert after < 0.6 * before


def test_elements_hold_a_gear_in_its_backlash(robot, plain):
    """A torque that changes sign eight times, within what they take: no reversal, always inside."""
    time = np.linspace(0.0, 8.0, 2001)
    for torque, reversals in ((30.0, 0), (500.0, 8)):
        swing = torque * np.cos(np.pi * time)[:, None] * np.ones(5)
        none = np.zeros((len(time), 5, 3))
        loads = GearLoads(time, swing, swing, swing, none, np.ones((len(time), 5)))
        (first, *_) = diagnosed(MovingRobot(robot, "backlash"), loads)
        assert first.reversals == reversals
        assert first.in_backlash == pytest.approx(8.0 if torque < 50.0 else 1.3, abs=0.5)
        assert diagnosed(MovingRobot(plain, "backlash"), loads)[0].reversals == 8
