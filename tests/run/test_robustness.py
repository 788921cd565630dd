"""What a run says of its command: on other robots, at the gears' backlash, of the drives; its curves."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from math import degrees
from pathlib import Path

import numpy as np
import pytest
from line_case import line_case
from scipy.integrate import trapezoid
from scipy.interpolate import BPoly
from tuned_fmu import simulate_tuned

from coupling.case.case import Case
from coupling.cli.console import console
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.inverse.joint_limits import JointLimits
from coupling.path.deviation import measure
from coupling.path.frame import AT_THE_ORIGIN
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.length_text import in_unit, in_words, length_unit
from coupling.report.run_figures import deviation
from coupling.report.run_report import run_report
from coupling.report.stored_result import write_report
from coupling.report.terminal import print_sections
from coupling.report.thinning import extremes
from coupling.robot.cell import Cell, Member
from coupling.robot.differences import RobotDifference
from coupling.robot.robot_fmu import RobotFmu
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.console import RunView
from coupling.run.drive_motion import drive_motions
from coupling.run.execute import Run, run_compensation
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.folder import write_run
from coupling.run.gear_check import GEAR_LOADS
from coupling.run.gear_loads import diagnose_robots
from coupling.run.replayed_command import ReplayedCommand
from coupling.run.robustness import VARIATIONS, replayed
from coupling.run.stored_run import read_run
from elastic_robot.description import Robot
from elastic_robot.gear_parts import StopElement

# No gear of the example robot has elements, or a motor.
NAMES = [
    variation.name
    for variation in VARIATIONS
    if variation.difference.values(load_robot(find_robot("icme2008")), "backlash", "ideal")
    or variation.force != 1.0
]


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> tuple[Case, Run, Path, str]:
    """Case, run, run folder and what the terminal showed."""
    folder = tmp_path_factory.mktemp("robustness")
    case = line_case(folder, "native")
    out = folder / "out"
    out.mkdir()
    with console.capture() as said:
        with RunView(console) as view:
            run = run_compensation(case, view.watch)
        write_run(out, case, run)
        write_report(out)
        print_sections(console, run_report(read_run(out)).content)
    return case, run, out, said.get()


def changed_by_hand(robot: Robot, key: str, factor: float) -> dict[str, float]:
    """Parameters of all gears and tilts, counted joint by joint."""
    changed = {}
    for i, joint in enumerate(robot.joints, start=1):
        if joint.stiffness is not None:
            changed[f"joint[{i}].{key}"] = factor * getattr(joint, key)
        if key != "backlash":
            for k, tilt in enumerate(joint.tilt, start=1):
                changed[f"joint[{i}].tilt[{k}].{key}"] = factor * getattr(tilt, key)
    return changed


def test_replays_are_those_of_the_files_on_robots_changed_by_hand(finished, example, tmp_path):
    """Command and wrench as written, the largest distance over all samples; to 1e-12 m.

    Without any change the same loop gives the achieved path.
    """
    case, _, out, _ = finished
    stored = read_run(out).first
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions(case.fmu))
    changes = {name: (*name.split()[:1], 1.0 + float(name.split()[1]) / 100.0) for name in NAMES}
    with RobotFmu(file, "backlash") as fmu:

        def left(wrench: WrenchHistory, changed: dict[str, float]) -> tuple[float, float]:
            path = simulate_tuned(fmu, stored.joints, wrench, "dynamic", changed)
            distance = np.linalg.norm(path.position[0] - stored.desired.position[0], axis=1)
            mean = trapezoid(distance**2, path.time) / (path.time[-1] - path.time[0])
            return distance.max(), np.sqrt(mean)

        after = stored.figures.deviation_after_m
        assert left(stored.wrench, {}) == pytest.approx((after.maximum, after.rms), abs=1e-12)
        *rows, sampling = stored.figures.robustness
        for row in rows:
            key, factor = changes[row.name]
            if key == "force":
                wrench = WrenchHistory(stored.wrench.time, factor * stored.wrench.wrench)
                found = left(wrench, {})
            else:
                found = left(stored.wrench, changed_by_hand(example, key, factor))
            told = row.deviation
            assert found == pytest.approx((told.maximum, told.rms), abs=1e-12), row.name
            assert found[0] > 5.0 * after.maximum
    assert [row.name for row in rows] == NAMES
    assert sampling.name == "sampling"


def test_what_means_nothing_is_left_out(tmp_path, example):
    linear = line_case(
        tmp_path,
        "native",
        ('"backlash"', '"linear"'),
        ("[0.0, 0.0, 0.002], [0.0, 0.0, -0.002], ", ""),  # a path that stays above the wall
        ("[[0.06, 0.0, -0.002], [0.06, 0.0, 0.002]]", "[[0.0, 0.0, 0.02], [0.06, 0.0, 0.02]]"),
    )
    run = run_compensation(linear)
    assert run.correction.response.wrench.peak_force == 0.0
    assert [row.name for row in run.robustness] == [
        name for name in NAMES if "backlash" not in name and "force" not in name
    ]
    tight = replace(example, joints=tuple(replace(joint, backlash=0.0) for joint in example.joints))
    more = RobotDifference({"backlash": (1.2,)})
    assert len(more.values(example, "backlash")) == 5
    assert more.values(tight, "backlash") == more.values(example, "linear") == {}
    assert RobotDifference().values(example, "backlash") == {}


def test_a_torque_table_is_not_changed_where_the_curve_follows_it():
    robot = load_robot(find_robot("icme2008"))
    points = ((-2e-3, -100.0), (-1e-3, -40.0), (0.0, 0.0), (1e-3, 40.0), (2e-3, 100.0))
    first = replace(robot.joints[0], torque_table=points)
    own = replace(robot, joints=(first, *robot.joints[1:]))
    stiffer = RobotDifference({"stiffness": (1.02,)})
    assert "joint[1].stiffness" not in stiffer.values(own, "spline")
    assert "joint[1].tilt[1].stiffness" in stiffer.values(own, "spline")
    assert "joint[1].stiffness" in stiffer.values(own, "backlash")


def with_elements(robot: Robot, *numbers: int) -> Robot:
    """Return a robot of whose joints some have elements of 120 N m together."""
    elements = (StopElement(40.0, 2e-5), StopElement(80.0, 1e-4))
    joints = tuple(
        replace(joint, hysteresis=elements) if number in numbers else joint
        for number, joint in enumerate(robot.joints, start=1)
    )
    return replace(robot, joints=joints)


def test_a_factor_of_the_hysteresis_is_one_of_all_slip_torques_of_a_gear(example):
    """Whatever its torque curve, beside a table too; nothing where there are no elements."""
    slipping, own = with_elements(example, 2, 4), RobotDifference({"hysteresis": (1.3,)})
    points = ((-2e-3, -100.0), (-1e-3, -40.0), (0.0, 0.0), (1e-3, 40.0), (2e-3, 100.0))
    second = replace(slipping.joints[1], torque_table=points)
    tabled = replace(slipping, joints=(slipping.joints[0], second, *slipping.joints[2:]))
    for robot in (slipping, tabled):
        for curve in ("linear", "backlash", "spline"):
            assert own.values(robot, curve) == {
                "joint[2].hysteresis": pytest.approx(156.0, rel=1e-15),
                "joint[4].hysteresis": pytest.approx(156.0, rel=1e-15),
            }
    assert own.values(example, "backlash") == {}
    none = RobotDifference({"hysteresis": (1.0, 0.0, 1.0, 1.0, 1.0, 1.0)})
    assert none.values(slipping, "backlash") == {"joint[2].hysteresis": 0.0}
    others = RobotDifference(dict.fromkeys(("stiffness", "damping", "backlash"), (1.1,)))
    assert "hysteresis" not in str(others.values(slipping, "linear"))
    with pytest.raises(ValueError, match=r"hysteresis: expected finite factors >= 0, got \[-0.3\]"):
        RobotDifference({"hysteresis": (-0.3,)})


class Recorder:
    """An FMU that notes the slip torques of gears and moves as it was told."""

    def __init__(self, path: ToolPath) -> None:
        self.path, self.slip_torques = path, {}

    def simulate(self, command, wrench, mode, robot, what) -> ToolPath:
        whole = {i: sum(e.slip_torque for e in j.hysteresis) for i, j in enumerate(robot.joints, 1)}
        self.slip_torques[what] = {i: torque for i, torque in whole.items() if torque}
        return self.path


def test_a_command_is_replayed_with_other_slip_torques_where_gears_have_elements(finished, example):
    """Thirty percent to both sides, between backlash and force; else as without elements."""
    _, run, _, _ = finished
    found = run.correction
    cell = Cell((Member("one", AT_THE_ORIGIN, None, None),))
    replays = {}
    for robot in (example, with_elements(example, 3)):
        fmu = Recorder(found.achieved)
        rows = replayed(
            ReplayedCommand(
                cell,
                (SimulatedModel(robot, "backlash", fmu),),
                found.joints,
                found.response.wrench,
                found.desired,
            )
        )
        replays[robot] = [row.name for row in rows], fmu.slip_torques
    (names, before), (more, after) = replays.values()
    assert names == NAMES
    assert more == [*NAMES[:-1], "hysteresis +30 %", "hysteresis -30 %", NAMES[-1]]
    assert after.pop("hysteresis +30 %") == {3: pytest.approx(156.0, rel=1e-15)}
    assert after.pop("hysteresis -30 %") == {3: pytest.approx(84.0, rel=1e-15)}
    assert before == {name: {} for name in NAMES}
    assert list(after.values()) == [{3: 120.0}] * len(NAMES)


def test_a_robot_is_told_what_remains_on_it_uncorrected(finished, tmp_path):
    """By superposition where that is much more; else as its FMU has it, here built of that robot."""
    case, run, _, _ = finished
    before = run.correction.before
    stiff, soft = (RobotDifference({"stiffness": (factor,)}) for factor in (4.0, 0.7))
    with FmuPool("native") as fmus:
        cell, (model,) = cell_of(case.robots, fmus)
        command = ReplayedCommand(
            cell,
            (model,),
            run.correction.joints,
            run.correction.response.wrench,
            run.desired,
            run.correction,
        )
        replays = [
            command.replay(name, [model.differing(difference, name)], 1.2)[0]
            for name, difference in (("stiff", stiff), ("soft", soft))
        ]
    expected = []
    for difference in (stiff, soft):
        robot = difference.applied(case.robots[0].description, "backlash")
        with RobotFmu(build_fmu(robot, tmp_path / "robot.fmu"), "backlash") as fmu:
            other = cell.with_robots([SimulatedModel(robot, "backlash", fmu)])
            path = other.simulate(before.joints, before.wrench.scaled(1.2), "dynamic")
            expected.append(measure(path, run.desired).maximum)
    simulated, superposed = (replay.uncorrected.maximum for replay in replays)
    assert simulated == pytest.approx(expected[0], rel=1e-9)
    assert replays[0].deviation.maximum > simulated, "the command takes off too much"
    assert superposed == pytest.approx(expected[1], rel=0.05)
    assert superposed != pytest.approx(expected[1], rel=1e-9)


def test_terminal_names_each_figure_once_and_speaks_of_the_inverse_only(finished):
    _, run, _, said = finished
    assert "largest step of the correction" not in said
    assert "Before compensation: under the wrench on the desired path" in said
    assert "on dynamic robots of which one parameter differs from the model" in said
    _, unit = length_unit(*(replay.deviation.maximum for replay in run.robustness))
    for replay in run.robustness:
        left = in_unit(replay.deviation.maximum, unit)
        assert re.search(rf"{re.escape(replay.name)} +{re.escape(left)} ", said)


def test_passages_through_the_backlash_are_counted_and_named(finished):
    _, run, out, said = finished
    changes = run.correction.backlash_reversals
    told = json.loads((out / "result.json").read_text())["backlash_reversals"]
    assert [(c["joint"], c["begins_s"], c["after"]) for c in told] == [
        (c.joint, c.begins, c.after) for c in changes
    ]
    assert {c["robot"] for c in told} == {"forming"}
    assert f"Gears enter their backlash {len(changes)} times" in said
    left = [own.deviation.maximum for own in run.robustness if own.name.startswith("backlash")]
    assert f"there, of up to {in_words(max(left))} if all are wrong by 20 %." in said
    first = sum(c.joint == 1 for c in changes)
    assert re.search(rf"joint 1 +{first} ", said)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert f"<td>joint 1</td>\n<td>{first}</td>" in page
    drawn = deviation(read_run(out).first).data
    ends = sorted(c.ends for c in changes if c.after)
    assert sorted(t for trace in drawn if "flank" in trace.name for t in trace.x) == ends


def test_what_the_gears_go_through_is_told_without_a_command(finished):
    """Their backlash reversals are the passages from flank to flank that the inverse finds."""
    case, run, out, said = finished
    told = json.loads((out / "result.json").read_text())
    passed = [c["joint"] for c in told["backlash_reversals"] if c["before"] * c["after"] < 0]
    for gear in told["gears"]:
        assert gear["backlash_reversals"] == passed.count(gear["joint"])
    answer = case.process.evaluate(case.desired)
    (alone,) = diagnose_robots(case.robots, case.desired, answer.wrench)
    assert [g.reversals for g in alone] == [g["backlash_reversals"] for g in told["gears"]]
    at_risk = [gear for gear in run.finding_of(GEAR_LOADS)[0] if gear.at_risk]
    assert at_risk
    for gear in at_risk:
        assert re.search(rf"joint {gear.joint} +{gear.reversals} +{gear.in_backlash:.2f} ", said)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Torques and reversals of the gears" in page


def test_drives_of_a_sine_move_as_fast_as_it_does():
    """Its rate and acceleration, also where no row is; limits are given where there are any."""
    time, omega = np.arange(0.0, 1.0, 0.011), 2.0 * np.pi
    q, qd, qdd = (
        (a * np.stack([f(omega * time), np.zeros(len(time))], axis=1),)
        for a, f in ((0.1, np.sin), (0.1 * omega, np.cos), (-0.1 * omega**2, np.sin))
    )
    wide = np.full(2, np.inf)
    limits = JointLimits(-wide, wide, np.array([2.0, np.inf]), np.array([np.inf, 7.0]))
    moving, still = drive_motions(JointPath(time, q, qd, qdd), limits)
    assert moving.rate_rad_s == pytest.approx(0.1 * omega, rel=1e-9)
    assert moving.acceleration_rad_s2 == pytest.approx(0.1 * omega**2, rel=1e-5)
    assert min(abs(moving.acceleration_time_s - t) for t in (0.25, 0.75)) < 0.002
    assert moving.range_rad == pytest.approx((-0.1, 0.1), rel=1e-4)
    assert (moving.rate_limit_rad_s, moving.acceleration_limit_rad_s2) == (2.0, None)
    assert (still.joint, still.rate_rad_s, still.acceleration_rad_s2) == (2, 0.0, 0.0)
    assert (still.rate_limit_rad_s, still.acceleration_limit_rad_s2) == (None, 7.0)


def test_drives_of_the_written_command_are_in_result_and_report(finished):
    """Against SciPy's polynomials through the rows of command.csv, at other times."""
    _, _, out, _ = finished
    stored = read_run(out).first
    joints = stored.joints
    rows = np.stack([joints.q[0], joints.qd[0], joints.qdd[0]], axis=1)
    motion = BPoly.from_derivatives(joints.time, rows)
    dense = np.linspace(joints.time[0], joints.time[-1], 30_011)
    rates, accelerations = (np.abs(motion(dense, nu=order)).max(axis=0) for order in (1, 2))
    page = (out / "report.html").read_text(encoding="utf-8")
    for i, drive in enumerate(stored.figures.command.drives):
        assert drive.rate_rad_s == pytest.approx(rates[i], rel=1e-2)
        assert drive.acceleration_rad_s2 == pytest.approx(accelerations[i], rel=3e-2)
        assert f"<td>{degrees(drive.acceleration_rad_s2):.3g}</td>" in page
    assert stored.figures.command.rows == len(stored.joints.time)


def test_extremes_of_every_part_survive():
    rng = np.random.default_rng(5)
    time = np.cumsum(rng.uniform(0.5, 1.5, 20_000))
    values = rng.normal(size=len(time))
    rows = extremes(time, values, parts=100)
    assert len(rows) <= 202
    assert np.all(np.diff(rows) > 0)
    part = np.minimum(100 * (time - time[0]) / np.ptp(time), 99).astype(int)
    for number in range(100):
        inside, kept = values[part == number], values[rows][part[rows] == number]
        assert (kept.min(), kept.max()) == (inside.min(), inside.max())
    assert np.array_equal(extremes(time[:200], values[:200], parts=100), np.arange(200))
