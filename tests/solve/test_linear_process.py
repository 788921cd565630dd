"""Robots against a process that goes on as it has answered; a gear that its spring alone holds."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from spring_robot import SpringPlanner, SpringRobot, upright

from coupling.errors import SimulationError
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.process import ElasticWall, ProcessResponse
from coupling.robot.cell import Cell, Member
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Loop, unloaded_path
from coupling.solve.local_stabilisation import LocalStabilisation
from coupling.solve.robin import Robin
from elastic_robot.fmi.interface import Mode

SAMPLES = 40
TRUE = 2e4  # -dF/dx of the process [N/m]


@dataclass(frozen=True)
class Sheet:
    """F = -K x of two tools, K of any kind but in what a tool feels of its own displacement."""

    stiffness: np.ndarray  # (6, 6) [N/m]
    across: bool = True  # whether what one tool does to the other is stated
    identity: str = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        every = np.concatenate(list(path.position), axis=1)
        force = (-every @ self.stiffness.T).reshape(-1, 2, 3).swapaxes(0, 1)
        told = self.stiffness.copy()
        if not self.across:
            told[:3, 3:] = told[3:, :3] = 0.0
        known = np.tile(told, (len(path.time), 1, 1))
        return ProcessResponse(WrenchHistory.of_forces(path.time, force), stiffness=known)


def pinched(rng: np.random.Generator) -> np.ndarray:
    """Return a sheet's stiffness: a spring between both tools, their own, and one that is one-sided."""
    normal = rng.normal(size=3)
    between = np.outer(normal, normal)
    own = [root @ root.T for root in rng.normal(size=(2, 3, 3))]
    stiffness = np.block([[between + 0.2 * own[0], -between], [-between, between + 0.2 * own[1]]])
    stiffness[3:, :3] += 0.3 * rng.normal(size=(3, 3))
    return 1e6 * stiffness


def cell_of_springs(rng: np.random.Generator, gain: float, stiffness: np.ndarray) -> Cell:
    """Return two tools on springs that stand and are turned anyhow; the gain is that of both."""
    roots = rng.normal(size=(2, 3, 3))
    compliances = roots @ roots.swapaxes(-1, -2) + 0.1 * np.eye(3)
    whole = np.block([[compliances[0], np.zeros((3, 3))], [np.zeros((3, 3)), compliances[1]]])
    size = gain / np.abs(np.linalg.eigvals(whole @ stiffness)).max()
    members = []
    for name, compliance in zip(("first", "second"), compliances, strict=True):
        at = Frame(rng.normal(size=3), Rotation.from_rotvec(rng.normal(size=3)))
        turn = at.rotation.as_matrix()
        robot = SpringRobot(size * turn.T @ compliance @ turn)
        members.append(Member(name, at, robot, SpringPlanner()))
    return Cell(tuple(members))


@pytest.mark.parametrize("gain", [0.1, 1.0, 5.0])
@pytest.mark.parametrize("seed", range(3))
def test_two_tools_that_press_on_each_other_take_three_evaluations(gain, seed):
    """Against the linear solution; a sheet that keeps what goes across to itself takes more."""
    rng = np.random.default_rng(seed)
    sheet = Sheet(pinched(rng))
    cell = cell_of_springs(rng, gain, sheet.stiffness)
    time = np.linspace(0.0, 1.0, SAMPLES)
    wanted = ToolPath.of_tools(
        [ToolPath(time, upright(1e-3 * rng.normal(size=(SAMPLES, 3)))) for _ in range(2)]
    )
    command = cell.plan(wanted)
    found = couple(Loop(cell, sheet, "quasistatic", Robin()), command)
    assert found.converged, found.reason
    assert len(found.evaluations) <= 3

    turns = [member.world_from_base.rotation.as_matrix() for member in cell.members]
    soft = np.zeros((6, 6))
    for k, (turn, member) in enumerate(zip(turns, cell.members, strict=True)):
        soft[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = turn @ member.robot.compliance @ turn.T
    free = np.concatenate(list(wanted.position), axis=1)
    expected = np.linalg.solve(np.eye(6) + soft @ sheet.stiffness, free.T).T
    own = np.concatenate(list(found.path.position), axis=1)
    np.testing.assert_allclose(own, expected, rtol=0, atol=1e-6)

    alone = couple(Loop(cell, replace(sheet, across=False), "quasistatic", Robin()), command)
    assert gain < 1.0 or len(alone.evaluations) > 3


@pytest.mark.parametrize("gain", [1.0, 5.0])
def test_a_contact_of_few_samples_pushes_back_between_them_by_its_stated_stiffness(gain):
    """A tool that swings between samples 20 ms apart meets the wall as at samples everywhere."""
    wall = ElasticWall(np.zeros(3), np.array([0.0, 0.0, 1.0]), 1e6)
    robot = SpringRobot(gain / wall.stiffness * np.eye(3))
    time = np.linspace(0.0, 1.0, 2001)
    swinging = -5e-3 - 1e-3 * np.sin(2.0 * np.pi * 31.0 * time)
    drives = np.column_stack([0.1 * time, 0.0 * time, swinging])
    command = JointPath(time, (drives,))
    samples = np.linspace(0.0, 1.0, 51)
    sampled = ToolPath(samples, upright(drives[::40]))
    fine = SampledPath.of(sampled).refined(0.004)
    told, rows = fine.path, fine.sample_rows
    loop = Loop(robot, wall, "quasistatic", Robin())
    unloaded = unloaded_path(loop, command, told.time)
    found = couple(loop, command, unloaded, rows)
    assert found.converged, found.reason
    assert len(found.evaluations) <= 3
    expected = unloaded.position[0, :, 2] / (1.0 + gain)
    np.testing.assert_allclose(found.path.position[0, :, 2], expected, rtol=0, atol=1e-6)
    force = found.response.wrench.before[0, :, 2]
    np.testing.assert_allclose(force, -wall.stiffness * expected, rtol=0, atol=1.0)


class Breaking:
    """Two tools on springs of which one breaks at a certain simulation."""

    def __init__(self, cell: Cell, breaks_at: int) -> None:
        self.cell, self.left = cell, breaks_at

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        self.left -= 1
        if self.left == 0:
            raise SimulationError("a joint is too soft")
        return self.cell.simulate(command, wrench, mode)


def test_robots_that_cannot_be_simulated_again_cost_no_more_than_evaluations():
    """The second simulation of an evaluation only refines the first; the first is needed."""
    rng = np.random.default_rng(0)
    sheet = Sheet(pinched(rng))
    cell = cell_of_springs(rng, 1.0, sheet.stiffness)
    time = np.linspace(0.0, 1.0, SAMPLES)
    path = ToolPath.of_tools([ToolPath(time, upright(np.zeros((SAMPLES, 3)))) for _ in range(2)])
    path = path.displaced(1e-3 * rng.normal(size=(2, SAMPLES, 6)))
    command = cell.plan(path)
    start = cell.simulate(command, WrenchHistory.none(time, 2), "quasistatic")

    whole = couple(Loop(Breaking(cell, 0), sheet, "quasistatic", Robin()), command, start)
    second = couple(Loop(Breaking(cell, 2), sheet, "quasistatic", Robin()), command, start)
    assert whole.converged
    assert second.converged
    np.testing.assert_allclose(second.path.position, whole.path.position, rtol=0, atol=1e-6)
    with pytest.raises(SimulationError, match="too soft"):
        couple(Loop(Breaking(cell, 1), sheet, "quasistatic", Robin()), command, start)


def places(stated: float, hold: float, most: int = 40, hard: float = 0.0) -> np.ndarray:
    """Return where a tool without stiffness of its own stands in every evaluation [m], from 0.1 mm on.

    The process pushes it to 0, but states another stiffness.

    Args:
        stated: Stiffness that the process states [N/m].
        hold: What holds the tool beyond that to begin with [N/m].
        most: Number of evaluations.
        hard: Within this distance [m] the process is ten times as stiff.
    """
    x, settling = np.array([1e-4, 0.0, 0.0]), LocalStabilisation.initial(np.array([[hold]]))
    found = []
    for _ in range(most):
        found.append(x[0])
        force = -TRUE * (x + 9.0 * np.clip(x, -hard, hard))
        move = force / (stated + settling.hold[0, 0])
        settling = settling.after(move[None, None], usual=TRUE)
        x = x + settling.factor[0, 0] * move
    return np.abs(found)


def test_a_gear_that_jumps_too_far_is_held_until_it_settles():
    """At 0.4 of the true stiffness it would go 1.5 times as far every time, for ever."""
    loose = places(0.4 * TRUE, 0.0)
    assert loose[3] > 3.0 * loose[0]
    assert loose[-1] < 1e-9


@pytest.mark.parametrize("times", [3.0, 30.0, 1e3, 1e5])
def test_a_gear_that_is_held_too_tightly_does_not_creep(times):
    """At n times the true stiffness 1 - 1/n of the way is left, every time; hundredfold takes 4.6 n.

    The secant of two moves of a linear process is exact; its factor, which is n, grows fourfold at most.
    """
    path = places(0.1 * TRUE, times * TRUE)
    slow = 1.0 - 1.0 / (0.1 + times)
    np.testing.assert_allclose(path[:3], path[0] * slow ** np.arange(3), rtol=1e-9)
    reached = 2 + int(np.ceil(np.log(0.1 + times) / np.log(4.0)))
    assert path[reached - 1] > 1e-3 * path[0]
    assert path[reached] < 1e-6 * path[0]


def test_a_gear_that_settles_is_left_alone():
    """At 1.25 times the true stiffness a fifth of the way is left every time: nothing to improve."""
    path = places(1.25 * TRUE, 0.0, most=8)
    np.testing.assert_allclose(path[1:] / path[:-1], 0.2, rtol=1e-9)


@pytest.mark.parametrize("hard", [1e-6, 1e-5, 3e-5, 9e-5])
def test_a_gear_that_was_carried_too_far_comes_back(hard):
    """Near its place the process is ten times as stiff as its last moves told."""
    path = places(0.1 * TRUE, 100.0 * TRUE, most=25, hard=hard)
    assert path[-1] < 1e-9


def test_a_gear_that_turns_off_its_way_is_carried_no_farther():
    """Two moves along one axis, then one at a right angle: nothing is known of that direction."""
    settling = LocalStabilisation.initial(np.array([[TRUE]]))
    for move in ([1e-5, 0, 0], [1e-5, 0, 0], [9e-6, 0, 0], [8e-6, 0, 0]):
        settling = settling.after(np.array([[move]]), usual=TRUE)
    assert settling.factor > 1.0
    turned = settling.after(np.array([[[0.0, 8e-6, 0.0]]]), usual=TRUE)
    assert turned.factor == 1.0
    assert turned.most < settling.factor
    assert turned.hold == TRUE


def test_another_coupling_begins_with_what_is_held():
    """What hung in one pass hangs in the next; how far it was from its place is another matter."""
    settling = LocalStabilisation.initial(np.array([[TRUE]]))
    for move in (1e-5, 1e-5, 9e-6, 8e-6):
        settling = settling.after(np.array([[[move, 0.0, 0.0]]]), usual=TRUE)
    again = settling.restarted()
    assert (again.hold, again.factor, again.evaluations) == (TRUE, 1.0, 0)
