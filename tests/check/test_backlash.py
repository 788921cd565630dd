"""What check says that a wrong backlash leaves: closed form, and the replays of whole runs."""

from types import SimpleNamespace

import numpy as np
import pytest
from line_case import line_case

from coupling.case.case import Case
from coupling.check.robot_findings import examine_robots
from coupling.files.robot_file import find_robot
from coupling.inverse.diagnosis import gear_loads
from coupling.inverse.inversion import MovingRobot
from coupling.path.deviation import measure
from coupling.path.interpolation import SampledPath
from coupling.results.replay import Replay
from coupling.run import robustness
from coupling.run.exact_command import exact_command
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.gear_loads import wanted_of
from coupling.run.replayed_command import ReplayedCommand
from docs.scripts.robots_with_backlash import (
    EVEN,
    FANUC_HOME,
    KUKA,
    KUKA_HOME,
    MIXED,
    with_backlash,
)
from docs.scripts.runs import example

CONTOUR = {"depth_m": 0.0005, "radius_m": 0.02}
SLOT = {
    "points_m": [[0.0, 0.0, 0.001], [0.03, 0.0, -0.003], [0.07, 0.0, -0.003], [0.1, 0.0, 0.001]]
}


def cone(robot: str, home: list[float], place: list[float]) -> Case:
    """One contour of the cone by another robot."""
    tables = {"robot": {"description": robot, "home_deg": home}, "part": {"position_m": place}}
    return example("cone", tool_path=CONTOUR, **tables)


CASES = {
    "a wall along a line": lambda folder: line_case(folder, "native"),
    "cone": lambda _: example("cone", tool_path=CONTOUR),
    "ISO 9283 at 1 m/s": lambda _: example("iso9283", tool_path={"feed_m_s": 1.0, "size_m": 0.15}),
    "slot, milled": lambda _: example("milling_20000", tool_path=SLOT),
    "FANUC": lambda _: cone(
        with_backlash(find_robot("fanuc_r2000ic"), MIXED), FANUC_HOME, [1.6, 0.3, 0.6]
    ),
    "KUKA": lambda _: cone(with_backlash(KUKA, EVEN), KUKA_HOME, [1.9, 0.1, 0.9]),
}


@pytest.fixture(scope="module", autouse=True)
def no_clearance():
    """What is said of a backlash asks nothing of the room around the path."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("coupling.check.robot_findings.clearance_around", lambda *_: None)
        yield


@pytest.fixture
def replays(monkeypatch):
    """Function that returns what a run's own command leaves with another backlash, by name."""
    only = tuple(own for own in robustness.VARIATIONS if own.name.startswith("backlash"))
    monkeypatch.setattr(robustness, "VARIATIONS", only)

    def run(case: Case) -> dict[str, Replay]:
        with FmuPool(case.fmu) as models:
            cell, simulated = cell_of(case.robots, models)
            found = case.method.correct(case.loop(cell), case.motion)
            replays = robustness.replayed(
                ReplayedCommand(cell, simulated, found.joints, found.response.wrench, found.desired)
            )
        return {own.name: own for own in replays}

    return run


AS_AT_REST = ("a wall along a line", "slot, milled")


@pytest.mark.parametrize("name", CASES)
def test_what_is_said_without_a_run_is_what_its_replays_show(name, tmp_path, replays):
    """Within a factor of 1.5, absolute and less a constant; a formula of each gear at rest is not."""
    case = CASES[name](tmp_path)
    (robot,) = examine_robots(case, case.process.evaluate(case.desired).wrench)
    found = {name: own.deviation for name, own in replays(case).items()}
    for figure in ("maximum", "maximum_less_constant"):
        said = max(getattr(own.deviation, figure) for own in robot.backlash)
        shown = max(getattr(found[own.name], figure) for own in robot.backlash)
        assert 1.0 / 1.5 < said / shown < 1.5, figure
    at_rest = max(gear.backlash_error for gear in robot.gears)
    assert name in AS_AT_REST or at_rest < max(own.maximum for own in found.values()) / 1.5


@pytest.fixture(scope="module")
def kept():
    """The cone, placed so that no gear reverses: robot, what it is to do and its loads."""
    case = example("cone_robust", tool_path=CONTOUR)
    wrench = case.process.evaluate(case.desired).wrench
    (wanted,) = wanted_of(case.robots, case.desired, wrench)
    placed = case.robots[0]
    moving = MovingRobot(placed.description, placed.torque_curve)
    (robot,) = examine_robots(case, wrench)
    return SimpleNamespace(case=case, wanted=wanted, moving=moving, robot=robot)


def test_gears_that_keep_their_flank_are_off_by_a_fifth_of_their_half_width(kept):
    """The tool by the sum of J_i 0.2 B_i sign T_i, to the other side with less; to 1 %."""
    assert not any(gear.reversals for gear in kept.robot.gears)
    model, loads = kept.moving.model, gear_loads(kept.moving, kept.wanted)
    theta = kept.moving.task(kept.wanted).guess[:: len(loads.time) // 100]
    rest = np.zeros((len(theta), model.size))
    theta = model.chain.theta(theta)
    linear = model.desk.linearised(theta, rest, rest, np.zeros((len(theta), 6)))
    off = 0.2 * kept.moving.backlash * np.sign(loads.torque[0])
    most = np.linalg.norm(linear.jacobian[:, :3, model.gears] @ off, axis=1).max()
    for own in kept.robot.backlash:
        assert own.deviation.maximum == pytest.approx(most, rel=1e-2)
        assert own.deviation.maximum_less_constant < 0.1 * most


def test_the_command_that_is_taken_for_right_is_right_for_the_robot_of_the_file():
    """To a micrometre along a pass whose wrong backlash leaves hundreds."""
    case = example("iso9283", tool_path={"feed_m_s": 0.25, "size_m": 0.2})
    wrench = case.process.evaluate(case.desired).wrench
    (wanted,) = wanted_of(case.robots, case.desired, wrench)
    placed = case.robots[0]
    moving = MovingRobot(placed.description, placed.torque_curve)
    fine = SampledPath.of(wanted.path).refined(0.004).path
    with FmuPool("native") as models:
        fmu = models.of(placed.description, placed.torque_curve).fmu
        command = exact_command(moving, wanted)
        path = fmu.simulate(command, wanted.wrench.refined(fine.time), "dynamic")
    assert measure(path, fine).maximum < 1e-6


def test_what_is_said_of_each_robot_of_a_cell_is_what_its_own_replays_show(replays):
    """A cell of two: what is simulated is each robot's own tool, in its own base."""
    case = example("two_robots", tool_path=CONTOUR)
    robots = examine_robots(case, case.process.evaluate(case.desired).wrench)
    found = replays(case)
    for tool, robot in enumerate(robots):
        said = max(own.deviation.maximum for own in robot.backlash)
        shown = max(found[own.name].of_tool(tool).deviation.maximum for own in robot.backlash)
        assert 1.0 / 1.5 < said / shown < 1.5
