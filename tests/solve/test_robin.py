"""Scheme robin: springs that change no answer, Newton's method where the stiffness is right."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from places import EXAMPLES
from spring_robot import SpringRobot

from coupling.case.file import load_case
from coupling.path.contact_spring import ContactSpring
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.linear import interpolate_rows
from coupling.process import ElasticWall, ProcessResponse
from coupling.run.execute import Run, run_compensation
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.folder import write_run
from coupling.run.stored_run import read_run
from coupling.solve.correction import Uncorrected
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Loop, Tolerance
from coupling.solve.robin import ProcessStiffness, Robin
from coupling.solve.scheme import Outcome, Scheme

TIGHT = Tolerance(path=1e-10, rms=1e-10, force=1e-8)
GAINS = (0.1, 1.0, 5.0, 10.0, 100.0)
STIFFNESS = 1e6  # [N/m]


def oblique_wall() -> ElasticWall:
    return ElasticWall(np.zeros(3), np.array([0.36, 0.48, 0.8]), STIFFNESS)


def pressing(n: int = 60) -> JointPath:
    """Along a wall, 1 to 3 mm inside it and out of it for a third of the way."""
    time = np.linspace(0.0, 1.0, n)
    depth = -2e-3 - 3e-3 * np.sin(2 * np.pi * time)
    return JointPath(time, (np.column_stack([0.1 * time, -0.05 * time, depth]),))


def soft_robot(gain: float, seed: int = 0) -> SpringRobot:
    """Return a robot whose compliance along the wall's normal is gain over the wall's stiffness."""
    root = np.random.default_rng(seed).normal(size=(3, 3))
    compliance, normal = root @ root.T + 0.1 * np.eye(3), oblique_wall().normal
    return SpringRobot(compliance * gain / (STIFFNESS * (normal @ compliance @ normal)))


def closed_form(robot: SpringRobot, command: JointPath) -> np.ndarray:
    """x = u + C n k p, p the penetration: p = p_u / (1 + gain) where the tool is inside."""
    wall, free = oblique_wall(), command.q[0]
    along = robot.compliance @ wall.normal
    pressed = np.maximum(-free @ wall.normal, 0.0) / (1.0 + STIFFNESS * wall.normal @ along)
    return free + STIFFNESS * pressed[:, None] * along


@dataclass(frozen=True)
class Untold:
    """A process that does not tell its stiffness, or another one."""

    process: ElasticWall
    factor: float | None = None
    identity: str = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        response = self.process.evaluate(path)
        told = None if self.factor is None else self.factor * response.stiffness
        return replace(response, stiffness=told)


def coupled(
    robot, process, tolerance: Tolerance = TIGHT, most: int = 60, scheme: Scheme | None = None
):
    return couple(
        Loop(robot, process, "quasistatic", scheme or Robin(), tolerance, most), pressing()
    )


@pytest.mark.parametrize("gain", GAINS)
def test_a_wall_that_tells_its_stiffness_takes_two_evaluations(gain):
    """Newton's method on a problem that is linear while contact lasts."""
    robot = soft_robot(gain)
    result = coupled(robot, oblique_wall())
    assert result.converged, result.reason
    assert len(result.evaluations) == 2
    expected = closed_form(robot, pressing())
    np.testing.assert_allclose(result.path.position[0], expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("gain", GAINS)
@pytest.mark.parametrize("seed", range(3))
def test_a_wall_that_does_not_takes_at_most_four(gain, seed):
    """The secant between two evaluations is the stiffness; where contact ends, one more is needed."""
    robot = soft_robot(gain, seed)
    result = coupled(robot, Untold(oblique_wall()), Tolerance())
    assert result.converged, result.reason
    assert len(result.evaluations) <= 4
    expected = closed_form(robot, pressing())
    np.testing.assert_allclose(result.path.position[0], expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize("factor", [0.8, 3.0, 10.0])
def test_a_wrong_stiffness_contracts_at_the_rate_of_theory(factor):
    """e_{k+1} / e_k = (s - 1) g / (1 + s g) for a stiffness that is s times the true one."""
    gain = 4.0
    robot, command = SpringRobot(gain / STIFFNESS * np.eye(3)), pressing()
    command = JointPath(command.time, (command.q[0] - np.array([0.0, 0.0, 0.02]),))  # never off
    loop = Loop(robot, Untold(oblique_wall(), factor), "quasistatic", Robin(), TIGHT, 6)
    changes = [entry.path_change for entry in couple(loop, command).evaluations]
    rate = abs(factor - 1.0) * gain / (1.0 + factor * gain)
    np.testing.assert_allclose(np.divide(changes[1:], changes[:-1]), rate, rtol=1e-6)


def test_a_stiffness_ten_times_too_large_is_not_called_converged_too_early():
    """Small changes are then no small errors; the verdict must know."""
    robot = soft_robot(5.0)
    result = coupled(robot, Untold(oblique_wall(), 10.0), Tolerance(force=1.0), most=400)
    assert result.converged, result.reason
    assert result.evaluations[-1].path_change < 2e-7
    expected = closed_form(robot, pressing())
    np.testing.assert_allclose(result.path.position[0], expected, rtol=0, atol=1.5e-6)


@pytest.mark.parametrize("factor", [0.05, 0.1, 0.2, 0.3, 0.4])
def test_where_a_stiffness_is_stated_far_too_small_the_tool_is_held(factor):
    robot = soft_robot(10.0)
    result = coupled(robot, Untold(oblique_wall(), factor), Tolerance())
    assert result.converged, result.reason
    expected = closed_form(robot, pressing())
    np.testing.assert_allclose(result.path.position[0], expected, rtol=0, atol=2e-6)


def test_a_stiffness_far_too_small_for_a_moving_robot_is_told_as_a_failure():
    loop = Loop(soft_robot(10.0), Untold(oblique_wall(), 0.2), "dynamic", Robin())
    assert couple(loop, pressing()).outcome is not Outcome.CONVERGED


@pytest.mark.parametrize("seed", range(5))
def test_the_answer_does_not_depend_on_the_stiffness(seed):
    """Any spring whose iteration converges leads to the same path and force."""
    rng = np.random.default_rng(seed)
    robot, wall = soft_robot(2.0, seed), oblique_wall()
    root = rng.normal(size=(60, 3, 3))
    more = 3e5 * root @ root.swapaxes(-1, -2)

    class Other(Robin):
        def move_robot(self, robot, command, iterate, mode):
            stiffer = replace(iterate.response, stiffness=iterate.response.stiffness + more)
            return super().move_robot(robot, command, replace(iterate, response=stiffer), mode)

    result = coupled(robot, wall, most=2000, scheme=Other())
    assert result.converged, result.reason
    expected = closed_form(robot, pressing())
    np.testing.assert_allclose(result.path.position[0], expected, rtol=0, atol=1e-8)
    acting = result.response.wrench.on(result.path).force
    np.testing.assert_allclose(acting, wall.evaluate(result.path).wrench.force, rtol=0, atol=1e-2)


def test_a_force_that_asks_for_no_position_is_no_obstacle():
    """Stiffness 0 is known exactly: the second evaluation confirms the first answer."""

    class Constant:
        identity = ""

        def evaluate(self, path: ToolPath) -> ProcessResponse:
            force = np.tile([0.0, 0.0, 700.0], (len(path.time), 1))
            still = np.zeros((len(path.time), 3, 3))
            return ProcessResponse(WrenchHistory.of_forces(path.time, [force]), stiffness=still)

    result = coupled(soft_robot(1.0), Constant())
    assert result.converged
    assert len(result.evaluations) == 2


@pytest.mark.parametrize("name", ["cone", "two_robots"])
def test_the_stiffness_that_a_law_tells_is_its_derivative(name):
    """Central differences of the forces on all tools by all positions, on random paths.

    Where a supporting tool has lifted off, the reaction is not symmetric and the law's own is told.
    """
    case = load_case(EXAMPLES / "cases" / f"{name}.toml")
    rng = np.random.default_rng(1)
    rows = np.sort(rng.choice(len(case.desired.time), 300, replace=False))
    thin = replace(case.desired.at_rows(rows))
    path = thin.displaced(2e-4 * rng.normal(size=(*thin.pose.shape[:2], 6)))
    response = case.process.evaluate(path)
    told, pressed = response.stiffness, np.any(response.wrench.force[-1], axis=1)
    assert np.count_nonzero(pressed) > 100
    assert np.count_nonzero(np.trace(told, axis1=1, axis2=2)) > 100
    step, count = 1e-8, len(path.pose)
    for tool in range(count):
        for axis in range(3):
            shift = np.zeros((count, len(path.time), 6))
            shift[tool, :, axis] = step
            ahead, behind = (
                np.concatenate(
                    list(case.process.evaluate(path.displaced(sign * shift)).wrench.force), axis=1
                )
                for sign in (1.0, -1.0)
            )
            found = (behind - ahead) / (2.0 * step)
            expected = told[:, :, 3 * tool + axis]
            np.testing.assert_allclose(
                found[pressed], expected[pressed], rtol=0, atol=30.0
            )  # of 1e5


@pytest.mark.parametrize("tools", [1, 2])
def test_the_smallest_stiffness_that_explains_a_change_of_force(tools):
    """K dx = -df, symmetric, not negative; kept where the force grows along the motion."""
    rng = np.random.default_rng(3)
    position, force = rng.normal(size=(2, tools, 50, 3))
    root = rng.normal(size=(50, 3 * tools, 3 * tools))
    true = root @ root.swapaxes(-1, -2)
    step = 1e-3 * rng.normal(size=(tools, 50, 3))

    def explained(stiffness):
        answers = np.einsum("nij,nj->ni", stiffness, np.concatenate(list(step), axis=1))
        return answers.reshape(50, tools, 3).swapaxes(0, 1)

    change = -explained(true)
    before = ProcessStiffness.first(position, force)
    found = before.then(position + step, force + change).matrices
    kept = np.all(found == before.matrices, axis=(-1, -2))
    assert np.count_nonzero(kept) < 5
    np.testing.assert_allclose(explained(found)[:, ~kept], -change[:, ~kept], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found, found.swapaxes(-1, -2))
    assert np.linalg.eigvalsh(found).min() > -1e-9
    grown = before.then(position + step, force - change).matrices
    np.testing.assert_array_equal(grown, before.matrices)


def test_noise_says_nothing_of_a_stiffness():
    """Forces that change by less than the band of their noise leave it; by more they do not."""
    rng = np.random.default_rng(5)
    position, force = rng.normal(size=(2, 1, 400, 3))
    before = ProcessStiffness.first(position, force)
    away, noise = -1e-7 * force, 2.0  # [m], [N]
    change = noise * np.sqrt(2.0) * rng.normal(size=force.shape)
    quiet = before.then(position + away, force + change, noise=noise).matrices
    changed = np.any(quiet != before.matrices, axis=(-1, -2))
    assert np.count_nonzero(changed) <= 2  # one in a thousand is expected, half of them fall back
    loud = before.then(position + away, force - 100.0 * away / 1e-7, noise=noise).matrices
    assert np.all(np.any(loud != before.matrices, axis=(-1, -2)))


class _Unrepeatable:
    """A wall whose answers differ by white noise [N], and the largest force that it has answered."""

    def __init__(self, noise: float) -> None:
        self.rng, self.noise, self.largest = np.random.default_rng(1), noise, 0.0

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        wrench = oblique_wall().evaluate(path).wrench
        force = wrench.force[0] + self.noise * self.rng.normal(size=wrench.force[0].shape)
        answer = ProcessResponse(WrenchHistory.of_forces(path.time, [force]), noise=self.noise)
        self.largest = max(self.largest, answer.wrench.peak_force)
        return answer


def test_a_coupling_that_does_not_end_has_forces_that_the_process_has_answered():
    """Springs estimated from noise carried thousands of newtons; none of them is the process's."""
    process = _Unrepeatable(noise=20.0)
    result = coupled(soft_robot(gain=0.3), process)
    assert not result.converged
    assert result.response.wrench.on(result.path).peak_force <= process.largest
    reached = closed_form(soft_robot(gain=0.3), pressing())
    off = np.linalg.norm(result.path.position[0] - reached, axis=1).max()
    compliance = np.linalg.norm(soft_robot(gain=0.3).compliance, 2)
    assert off < 10.0 * 20.0 * compliance  # some standard deviations of what noise moves


PRESSED_LINE = """
[robot]
description = "{robot}"
home_deg = {home}

[part]
position_m = {position}

[tool_path]
kind = "line"
points_m = [
    [0.0, 0.0, 0.003], [0.0, 0.0, -0.0005], [0.05, 0.0, -0.0005], [0.05, 0.05, -0.0005],
    [0.0, 0.0, 0.003],
]
feed_m_s = 0.05

[process]
model = "elastic-wall"
stiffness_N_m = {stiffness}
"""
UR10 = ("ur10", [-11.0, -47.0, 65.6, 71.4, -90.0, -11.0], [0.86, 0.0, 0.15])
KR210 = ("kuka_kr210", [0.0, 32.6, 3.7, 0.0, 53.7, 0.0], [2.2, 0.0, 0.34])


@dataclass(frozen=True)
class Damped(Untold):
    """Such a process that also damps: c = k times 20 ms, by differences between its samples."""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        wrench = self.process.evaluate(path).wrench
        rate = np.gradient(path.position[0], path.time, axis=0) @ self.process.normal
        pressed = np.any(wrench.force[0], axis=1)
        damping = -0.02 * self.process.stiffness * np.minimum(rate, 0.0) * pressed
        force = wrench.force[0] + damping[:, None] * self.process.normal
        return ProcessResponse(WrenchHistory.of_forces(path.time, [force]))


def pressed(folder: Path, robot: tuple, stiffness: float, process):
    """Return the coupling of a shipped robot that moves on a wall at samples 20 ms apart."""
    file = folder / "case.toml"
    name, home, position = robot
    text = PRESSED_LINE.format(robot=name, home=home, position=position, stiffness=stiffness)
    file.write_text(text)
    case = load_case(file)
    with FmuPool("native") as fmus:
        cell, _ = cell_of(case.robots, fmus)
        loop = replace(case, process=process(case.process)).loop(cell)
        return Uncorrected().correct(loop, case.motion)


@pytest.mark.parametrize("stiffness", [1e5, 1e6])
@pytest.mark.parametrize("robot", [UR10, KR210], ids=["ur10", "kr210"])
def test_a_moving_robot_on_a_wall_that_does_not_tell_is_where_it_is_on_one_that_does(
    tmp_path, robot, stiffness
):
    """Straight forces between the samples shook it off the wall, whatever the iteration did."""
    told = pressed(tmp_path, robot, stiffness, lambda wall: wall)
    untold = pressed(tmp_path, robot, stiffness, Untold)
    assert told.converged
    assert untold.converged, untold.reason
    assert untold.evaluations <= 6
    off = np.linalg.norm(told.achieved.position - untold.achieved.position, axis=-1).max()
    assert off < 1e-6


def test_what_springs_cannot_give_is_solved_for_by_mixing(tmp_path):
    """A process that damps as well: its forces follow the rate, of which K knows nothing."""
    result = pressed(tmp_path, UR10, 1e5, Damped)
    assert result.converged, result.reason


def test_loads_given_at_more_times_keep_their_springs():
    """The place moves straight on, the stiffness acts over the step that ends at its row."""
    time, fine = np.array([0.0, 1.0, 2.0]), np.linspace(0.0, 2.0, 9)
    anchor = np.array([[[0.0, 0, 0], [1.0, 0, 0], [3.0, 0, 0]]])
    stiffness = np.arange(3.0)[None, :, None, None] * np.eye(3)
    load = WrenchHistory(time, np.zeros((1, 3, 6)), ContactSpring(anchor, stiffness)).refined(fine)
    expected = np.interp(fine, time, anchor[0, :, 0])
    np.testing.assert_allclose(load.spring.anchor[0, :, 0], expected, atol=1e-15)
    held = [0, 1, 1, 1, 1, 2, 2, 2, 2]
    np.testing.assert_array_equal(load.spring.stiffness[0, :, 0, 0], held)


def test_straight_keeps_its_rows():
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.1, 1.0, 20))
    values = rng.normal(size=(2, 20, 3, 3))
    more = np.sort(np.concatenate([time, rng.uniform(time[0], time[-1], 50)]))
    found = interpolate_rows(more, time, values, axis=1)
    np.testing.assert_array_equal(found[:, np.searchsorted(more, time)], values)
    expected = np.interp(more, time, values[1, :, 2, 0])
    np.testing.assert_allclose(found[1, :, 2, 0], expected, atol=1e-12)


def test_a_spring_of_the_wrong_size_is_refused():
    with pytest.raises(ValueError, match=r"stiffnesses \(tools, n, 3, 3\), got shapes"):
        ContactSpring(np.zeros((1, 4, 3)), np.zeros((1, 4, 3)))
    with pytest.raises(ValueError, match="not finite"):
        ContactSpring(np.full((1, 4, 3), np.nan), np.zeros((1, 4, 3, 3)))


@pytest.fixture(scope="module")
def mirrored(tmp_path_factory) -> tuple[Path, Run]:
    """Return two robots with backlash, mirrored on a shallow cone: the gears of axis 1 hang."""
    folder = tmp_path_factory.mktemp("cell")
    text = (EXAMPLES / "cases" / "two_robots.toml").read_text()
    text = text.replace("depth_m        = 0.005", "depth_m        = 0.001")
    text = text.replace("radius_m       = 0.06", "radius_m       = 0.03")
    text = text.replace("[robot]", '[robot]\nmode = "quasistatic"')
    file = folder / "cell.toml"
    file.write_text(text + '\n[compensation]\nmethod = "mirror"\nmax_passes = 2\n')
    case = load_case(file)
    run = run_compensation(case)
    write_run(folder, case, run)
    return folder, run


def test_robots_whose_gears_hang_once_they_are_corrected_couple_in_few_evaluations(mirrored):
    _, run = mirrored
    assert len(run.correction.iterations) == 3
    for entry in run.correction.iterations:
        assert len(entry.evaluations) <= 6
        assert entry.evaluations[-1].path_change <= 1e-6


def test_a_run_folder_replays_with_its_springs_and_only_with_them(mirrored):
    """Under the wrench alone, unloaded gears take another position in their backlash."""
    folder, _ = mirrored
    case, stored = load_case(folder / "cell.toml"), read_run(folder)
    robot = stored.robots["support"]
    wrench = robot.wrench.transformed(case.robots[1].world_from_base.inverse())
    with FmuPool(case.fmu) as models:
        placed = case.robots[1]
        fmu = models.of(placed.description, placed.torque_curve).fmu
        path = fmu.simulate(robot.joints, wrench, "quasistatic").transformed(placed.world_from_base)
        alone = fmu.simulate(robot.joints, replace(wrench, spring=None), "quasistatic")
        alone = alone.transformed(placed.world_from_base)
    assert path.distance_to(robot.achieved).max() < 1e-8
    assert alone.distance_to(robot.achieved).max() > 5e-5
