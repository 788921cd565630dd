"""Placing a case whose tool's tilt is measured from its path."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomlkit
from scipy.spatial.transform import Rotation

from coupling.case.file import load_case
from coupling.errors import CaseError, PlanningError
from coupling.files.csv_table import POSE_COLUMNS, write_table
from coupling.path.deviation import measure
from coupling.place.coarse_screen import CoarseScreen
from coupling.place.moved_path import MovedPath
from coupling.place.place import best_of
from coupling.place.placing import placing
from coupling.place.search import fill_box, refine_settings
from coupling.place.settings import NAMES
from coupling.process.isf_force_law import IsfForceLawTable
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.execute import run_compensation
from coupling.toolpaths.instants import NO_CORNERS
from docs.scripts.runs import example

FREE = {"settings": 128, "cases": 1, "optimise": "stiffness"}
KINDS = {
    "cone": {"depth_m": 0.0005, "radius_m": 0.02},
    "pyramid": {"kind": "pyramid", "depth_m": 0.0005, "radius_m": 0.01, "turn_s": 2.0},
}


def task_of(name: str, tool_path: dict | None = None, **place_keys: object):
    path = KINDS[name] | {"tilt_frame": "path", "lean_deg": 45.0} | (tool_path or {})
    case = example("cone", tool_path=path, place=FREE | place_keys)
    return placing(case, case.process)


def written(task, setting: np.ndarray, folder: Path):
    file = folder / "case.toml"
    file.write_text(tomlkit.dumps(task.content(setting, task.case.robots[0].home)))
    return load_case(file)


def require_as_in_cases(task, folder: Path) -> None:
    """Poses to rounding, angular rates and accelerations to differences of the cases' own paths."""
    rows = np.linspace(5, task.stations.count - 6, 40).astype(int)
    settings = task.ranges.sampled(4, seed=3)
    placed = task.cell.placed(settings)
    moved = MovedPath(placed, task.cell.sphere_radius, task.stations.chosen(rows))
    places, all_ = np.arange(len(rows)), np.arange(len(settings))
    targets, motion = moved.targets(places, all_), moved.motion(places, all_)
    shape = (3, len(rows), len(settings))
    for k, setting in enumerate(settings):
        case = written(task, setting, folder)
        base_from_world = case.robots[0].world_from_base.rotation.inv()
        held = base_from_world * case.desired.rotations[0]
        matrix = held[rows].as_matrix()
        for column in range(3):
            own = targets.tool[column].reshape(shape)[:, :, k].T
            np.testing.assert_allclose(own, matrix[:, :, column], atol=1e-9)
        at = base_from_world.apply(case.desired.position[0][rows])
        np.testing.assert_allclose(targets.position.reshape(shape)[:, :, k].T, at, atol=1e-9)
        ahead, behind = (np.diff(case.desired.time)[rows - k][:, None] for k in (0, 1))
        forth = (held[rows + 1] * held[rows].inv()).as_rotvec() / ahead
        back = (held[rows] * held[rows - 1].inv()).as_rotvec() / behind
        spin = (behind * forth + ahead * back) / (ahead + behind)
        rate = 2.0 * (forth - back) / (ahead + behind)
        for got, expected, allowed in ((motion.spin, spin, 2e-3), (motion.spin_rate, rate, 5e-3)):
            own = got.reshape(shape)[:, :, k].T
            np.testing.assert_allclose(own, expected, atol=allowed * np.abs(expected).max())
        shift = task.cell.sphere_radius * np.array([-1.0, 0.0, 0.0])
        np.testing.assert_array_equal(targets.tcp_shift, np.repeat(shift[:, None], shape[1] * 4, 1))


@pytest.mark.parametrize("name", KINDS)
def test_many_settings_move_the_tool_as_their_cases_do(name, tmp_path):
    require_as_in_cases(task_of(name, tool_path={"sample_s": 0.005}), tmp_path)


def test_where_the_tool_goes_round_a_setting_comes_to_the_same_by_itself():
    """Alone, many places are looked at at once; beside many others, place by place."""
    task = task_of("cone", tool_path={"radius_m": 0.06}, lean_deg=[20.0, 70.0])
    every = task.stations.strongest()
    screen = task.screen(every.chosen(np.linspace(0, every.count - 1, 24).astype(int)))
    many = task.ranges.sampled(256, seed=5)
    together = screen.batch(many).q[:, :, :24]
    alone = np.concatenate([screen.batch(own[None]).q for own in many[:24]], axis=2)
    assert np.isfinite(together).all(axis=(0, 1)).sum() >= 20
    np.testing.assert_allclose(alone, together, atol=1e-6)


def test_the_best_keep_to_what_is_demanded_between_the_few_places():
    """They lie on the edge of the singular postures, and that runs between the places, too."""
    free = {"lean_deg": [20.0, 70.0], "x_m": [1.1, 2.1], "z_m": [0.3, 1.3]}
    task = task_of("cone", optimise="backlash", **free)
    goal, ranges = task.goal, task.ranges
    screen = CoarseScreen(task.screen, task.stations, ranges, goal.demands, seed=1)
    found = fill_box(screen, ranges, goal, 256, 1, lambda done, total: None)
    found = refine_settings(screen, goal, ranges, found, 1, lambda done, total: None)
    whole = task.screen(task.stations.strongest()).figures(ranges.rounded(found.settings))
    assert goal.demands.admits(whole).all()
    np.testing.assert_allclose(goal.cost(whole), found.cost, rtol=1e-6)
    assert 0.03 <= whole.conditioning.min() < 0.0305


def test_joints_that_wind_up_are_as_far_from_their_limits_as_along_the_planned_path(tmp_path):
    """The tool's axis goes round that of joint 4: another turn of it and of joint 6 on every contour."""
    task = task_of("cone", lean_deg=[20.0, 70.0])
    joints = tuple(replace(joint, limits=(-9.0, 9.0)) for joint in task.robot.joints)
    task = replace(task, robot=replace(task.robot, joints=joints))
    every = task.stations.strongest()
    screen, tried = task.screen(every), task.ranges.sampled(48, seed=5)
    batch = screen.batch(tried)
    jumps = np.abs(np.diff(batch.q, axis=0)).max(axis=(0, 1))
    wound = np.flatnonzero((jumps > np.pi) & (batch.conditioning.min(axis=0) > 0.03))
    assert len(wound)
    figures = screen.figures(tried[wound])
    for number, k in enumerate(wound):
        placed = written(task, tried[k], tmp_path)
        robot = placed.robots[0]
        path = placed.desired.transformed(robot.world_from_base.inverse())
        (q,) = InverseKinematics(robot.description, batch.q[0, :, k]).plan(path).q
        assert figures.limit_margin[number] == pytest.approx(9.0 - np.abs(q).max(), abs=0.02)


def test_ranges_of_a_lean_from_the_wall_are_about_the_upright_tool():
    low, high = (np.rad2deg(ends) for ends in vars(task_of("cone").ranges).values())
    lean = NAMES.index("lean")
    assert (low[lean], high[lean]) == (pytest.approx(15.0), pytest.approx(75.0))
    with pytest.raises(CaseError, match="place: lean_deg: expected at least -44 from the wall's"):
        task_of("cone", lean_deg=[-60.0, 0.0])


def test_a_case_that_is_placed_so_is_an_ordinary_one(tmp_path):
    """Its command takes the tool along its path; a process of a tool held otherwise is asked anew."""
    task = task_of("cone")
    setting = task.present.copy()
    setting[NAMES.index("lean")] = np.deg2rad(30.0)
    asked = []

    def process_of(case):
        asked.append(case.tool_path.lean_deg)
        return case.process

    (best,) = best_of(task, setting[None], process_of)
    assert asked == [30.0]
    file = tmp_path / "placed.toml"
    file.write_text(best.content)
    case = load_case(file)
    assert case.tool_path.tilt_frame == "path"
    again = placing(case, case.process)
    np.testing.assert_allclose(again.present, setting, atol=1e-9)
    figures = again.screen(again.stations.strongest()).figures(setting[None])
    np.testing.assert_allclose(figures.deviation, best.result.moved_m, rtol=1e-6)
    run = run_compensation(case)
    assert run.correction.converged
    assert measure(run.correction.achieved, run.desired).maximum < 1e-5


def test_a_setting_that_turns_the_tool_too_fast_is_none():
    task = task_of("pyramid", tool_path={"turn_s": 0.4})
    setting = task.present.copy()
    setting[NAMES.index("lean")] = np.deg2rad(16.0)
    with pytest.raises(PlanningError, match="turns its tool by at most 180 deg/s"):
        best_of(task, setting[None], lambda case: case.process)


@pytest.mark.parametrize("frame", ["path", "part"])
def test_a_file_whose_rows_turn_the_tool_can_be_placed(frame, tmp_path, monkeypatch):
    """With tilts from its path or from the part: the TCP is the centre of the sphere."""
    # A tool that is tilted meets the sheet at other times: all are compared at the rows of the file.
    monkeypatch.setattr(IsfForceLawTable, "corners", lambda table, task: NO_CORNERS)
    u = np.linspace(0.0, 1.0, 401)
    part = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    upright = Rotation.from_euler("y", 90.0, degrees=True)
    turns = Rotation.from_rotvec(part[:, None] * [0.3, -0.4, 0.5])
    held = Rotation.from_rotvec(0.3 * np.outer(np.sin(3.0 * part), [1, 0, 0])) * turns * upright
    position = 0.1 * np.column_stack([part, 0.3 * part**2, -0.1 * part])
    file = tmp_path / "line.csv"
    rows = np.column_stack([2.0 * u, position, held.as_quat()])
    write_table(file, ("time", *POSE_COLUMNS), rows)
    own = dict(example("cone").resolved)
    own["tool_path"] = {"kind": "csv", "file": str(file), "tilt_frame": frame}
    own["process"] = own["process"] | {"wall_angle_deg": 45.0, "step_down_m": 0.0005}
    own["place"] = FREE
    text = tmp_path / "placed.toml"
    text.write_text(tomlkit.dumps(own))
    case = load_case(text)
    task = placing(case, case.process)
    assert task.stations.centered
    require_as_in_cases(task, tmp_path)
    # And the robot's joints are those of the planned case.
    tried = task.ranges.sampled(6, seed=2)
    batch = task.screen(task.stations.chosen(np.arange(0, 401, 40))).batch(tried)
    reached = np.flatnonzero(np.isfinite(batch.q[0, 0]))
    assert len(reached)
    for k in reached:
        placed = written(task, tried[k], tmp_path)
        robot = placed.robots[0]
        planner = InverseKinematics(robot.description, batch.q[0, :, k])
        (exact,) = planner.plan(placed.desired.transformed(robot.world_from_base.inverse())).q
        np.testing.assert_allclose(batch.q[:, :, k], exact[::40], atol=1e-6)
