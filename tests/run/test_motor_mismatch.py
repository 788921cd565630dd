"""Friction and gains that are not those of the file: rows of a run, plant, study."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from line_case import moving_line
from motor_file import with_motors

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.case.plant import StudyTable
from coupling.errors import CaseError
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.path.deviation import measure
from coupling.report.run_report import run_report
from coupling.robot.differences import RobotDifference
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.execute import run_compensation
from coupling.run.folder import write_run
from coupling.run.plant import in_words
from coupling.run.stored_run import StoredRobot, read_run
from coupling.run.uncertain_parameters import UncertainParameters
from coupling.study.conduct import _work
from coupling.study.robot_pool import RobotPool
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.gear_parts import KinematicError

MOTORS = {
    "friction +30 %": (1.3, 1.0),
    "friction -30 %": (0.7, 1.0),
    "servo gain +20 %": (1.0, 1.2),
    "servo gain -20 %": (1.0, 0.8),
}
PHASE_UNKNOWN = "kinematic error, phase unknown"


def case_of(folder: Path, keys: str = "", more: str = "") -> Case:
    with_motors(folder, friction=150.0)
    file = folder / "line.toml"
    text = moving_line(('"icme2008"', f'"servo.toml"\n{keys}'))
    file.write_text(f"{text}\n{more}\n")
    return load_case(file)


def changed_by_hand(robot: Robot, friction: float, gain: float) -> Robot:
    """Every drive's F, b, Kv, Kp and Ki, joint by joint."""
    joints = []
    for joint in robot.joints:
        d = joint.drive
        if d is not None:
            d = replace(d, friction=friction * d.friction, viscous=friction * d.viscous)
            d = replace(d, position_gain=gain * d.position_gain, rate_gain=gain * d.rate_gain)
            d = replace(d, integral_gain=gain * d.integral_gain)
        joints.append(replace(joint, drive=d))
    return replace(robot, joints=tuple(joints))


def left(robot: Robot, stored: StoredRobot, folder: Path) -> float:
    """Largest deviation of the files of a run on the FMU of a robot with servos [m]."""
    file = build_fmu(robot, folder / "own.fmu", BuildOptions("native"))
    with RobotFmu(file, "backlash", drive="servo") as fmu:
        path = fmu.simulate(stored.joints, stored.wrench, "dynamic")
    return measure(path, stored.desired).maximum


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> tuple[Case, StoredRobot, Path]:
    folder = tmp_path_factory.mktemp("mismatch")
    case = case_of(folder)
    run = run_compensation(case)
    assert run.correction.converged
    (folder / "out").mkdir()
    write_run(folder / "out", case, run)
    return case, read_run(folder / "out").first, folder / "out"


def test_factors_of_motors_are_those_of_their_description():
    """One number or one a joint; rotors, feed-forward and what is no motor stay as they are."""
    robot = load_robot(find_robot("icme2008"))
    every = RobotDifference({"friction": (1.3,), "servo_gain": (0.8,)})
    assert every.applied(robot, "backlash") == robot
    drive = Drive(10.0, 20.0, 500.0, 100.0, 0.9, friction=5.0, viscous=3.0, torque_limit=900.0)
    moved = replace(robot, joints=tuple(replace(j, drive=drive) for j in robot.joints[:5]))
    assert every.applied(moved, "backlash", "servo") == changed_by_hand(moved, 1.3, 0.8)
    one = RobotDifference({"friction": (1.0, 1.0, 2.0, 1.0, 1.0)}).applied(moved, "backlash")
    assert one.joints[2].drive == replace(drive, friction=10.0, viscous=6.0)
    assert [j.drive for k, j in enumerate(one.joints) if k != 2] == [drive] * 4
    for name in ("friction", "servo_gain"):
        difference = RobotDifference({name: (1.3,)})
        assert difference.values(moved, "backlash", "servo")
        assert not difference.values(moved, "backlash", "ideal")
        assert not difference.values(robot, "backlash", "servo")
    with pytest.raises(ValueError, match="servo_gain: expected finite factors > 0"):
        RobotDifference({"servo_gain": (0.0,)})


def test_rows_of_a_run_are_its_files_on_robots_with_other_motors(finished, tmp_path):
    case, stored, folder = finished
    rows = {row.name: row.deviation.maximum for row in stored.figures.robustness}
    assert [name for name in rows if name in MOTORS] == list(MOTORS)
    for name, factors in MOTORS.items():
        other = changed_by_hand(case.robots[0].description, *factors)
        assert rows[name] == pytest.approx(left(other, stored, tmp_path), abs=1e-12)
        assert rows[name] > 3.0 * stored.figures.deviation_after_m.maximum
    text = " ".join(str(part) for s in run_report(read_run(folder)).content for part in s.parts)
    assert re.search(r"in all motors [0-9.]+ (um|mm) would remain", text)
    assert stored.figures.outlook.deviation == max(rows.values())


def test_ideal_drives_have_no_rows_of_motors_and_gears_without_sines_none_of_them(tmp_path):
    run = run_compensation(case_of(tmp_path, 'drive = "ideal"'))
    assert not {row.name for row in run.robustness} & {*MOTORS, PHASE_UNKNOWN}


def test_a_plant_has_other_motors(finished, tmp_path):
    """As built by hand; a factor that ideal drives do not know is refused."""
    factors = "friction_factor = 0.8\nservo_gain_factor = [0.9, 1.0, 1.0, 1.0, 1.0, 1.0]"
    case = case_of(tmp_path, "", f"[plant]\n{factors}")
    own = replace(case.robots[0].description)
    hand = changed_by_hand(own, 0.8, 1.0)
    first = changed_by_hand(own, 0.8, 0.9).joints[0]
    (robot,) = case.plant.robots
    assert robot.description == own
    assert robot.robot == replace(hand, joints=(first, *hand.joints[1:]))
    assert in_words(case.plant, case.robots) == (
        "friction x 0.8",
        "servo gain x 0.9, 1, 1, 1, 1, 1",
    )
    with pytest.raises(CaseError, match='plant: friction_factor: expected drive = "servo" beside'):
        case_of(tmp_path, 'drive = "ideal"', "[plant]\nfriction_factor = 0.8")
    with pytest.raises(CaseError, match=r"servo_gain_factor 1: expected a number greater than 0"):
        case_of(tmp_path, "", "[plant]\nservo_gain_factor = 0.0")


def test_a_study_samples_motors_where_they_move(finished, tmp_path):
    """Samples are robots by hand; a factor of what an ideal drive has not changes nothing."""
    case, stored, folder = finished
    both = {"friction_factor": [0.7, 1.3], "servo_gain_factor": [0.8, 1.2]}
    case = replace(case, study=StudyTable.model_validate(both))
    each = UncertainParameters.chosen(
        case_of(tmp_path, "", "[study]\nfriction_factor = [0.5, 1.5]\njoints = 'each'"), False
    )
    assert each.names == tuple(f"friction_factor[{i}]" for i in range(1, 6))
    given = case_of(tmp_path, 'drive = "ideal"', "[study]\nfriction_factor = [0.5, 1.5]")
    assert UncertainParameters.chosen(given, loaded=False).silent == ("friction_factor",)
    work = _work(case, read_run(folder), folder, couple=False)
    values = {"friction_factor": 0.75, "servo_gain_factor": 1.1}
    with RobotPool(work) as pool:
        same = pool.sample(0, [1.0] * len(work.parameters.names))
        other = pool.sample(1, [values.get(name, 1.0) for name in work.parameters.names])
    after = stored.figures.deviation_after_m.maximum
    assert same.deviation.maximum == pytest.approx(after, abs=1e-12)
    robot = changed_by_hand(case.robots[0].description, 0.75, 1.1)
    assert other.deviation.maximum == pytest.approx(left(robot, stored, tmp_path), abs=1e-12)


SINES = (KinematicError(3e-5, 1.0, 0.4), KinematicError(2e-5, 120.0))


def turned_by_hand(robot: Robot, factor: float, shift: float) -> Robot:
    """Every gear's sines as complex amplitudes a e^(ip), times factor e^(i shift)."""
    joints = []
    for joint in robot.joints:
        sines = []
        for e in joint.kinematic_error:
            phasor = factor * e.amplitude * np.exp(1j * (e.phase + shift))
            sines.append(KinematicError(abs(phasor), e.order, float(np.angle(phasor))))
        joints.append(replace(joint, kinematic_error=tuple(sines)))
    return replace(robot, joints=tuple(joints))


def with_sines(folder: Path, more: str = "") -> Case:
    case = case_of(folder, 'drive = "ideal"', more)
    (placed,) = case.robots
    joints = [replace(j, kinematic_error=SINES) for j in placed.description.joints]
    own = replace(placed.description, joints=tuple(joints))
    return replace(case, robots=(replace(placed, description=own),))


def sines_of(robot: Robot) -> np.ndarray:
    return np.array(
        [
            (e.amplitude, e.order, np.exp(1j * e.phase))
            for j in robot.joints
            for e in j.kinematic_error
        ]
    )


def test_other_kinematic_errors_are_those_of_turned_phasors(tmp_path):
    """Factors and phases for all joints or one each; 0 leaves none; they show under any drives."""
    robot = with_sines(tmp_path).robots[0].description
    own = RobotDifference({"kinematic_error": (1.5,), "kinematic_error_phase": (0.7,)})
    hand = turned_by_hand(robot, 1.5, 0.7)
    for drive in ("ideal", "servo"):
        found = sines_of(own.applied(robot, "backlash", drive))
        np.testing.assert_allclose(found, sines_of(hand), rtol=1e-14)
    none = RobotDifference({"kinematic_error": (0.0,)}).applied(robot, "backlash")
    assert not any(j.kinematic_error for j in none.joints)
    shifts = {"kinematic_error_phase": (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)}
    one = RobotDifference(shifts).applied(robot, "backlash")
    assert [a == b for a, b in zip(one.joints, robot.joints, strict=True)] == [
        i != 2 for i in range(6)
    ]
    bare = load_robot(find_robot("icme2008"))
    assert not own.values(bare, "backlash", "servo")
    with pytest.raises(ValueError, match="kinematic_error_phase: expected finite"):
        RobotDifference({"kinematic_error_phase": (np.nan,)})
    with pytest.raises(ValueError, match="kinematic_error_phase: expected one number, or 6"):
        RobotDifference({"kinematic_error_phase": (0.1, 0.2)}).applied(robot, "backlash")


def test_a_run_has_a_row_of_kinematic_errors_with_an_unknown_phase(tmp_path):
    """It is its command on a robot whose sines are a quarter turn on."""
    case = with_sines(tmp_path)
    run = run_compensation(case)
    (tmp_path / "out").mkdir()
    write_run(tmp_path / "out", case, run)
    rows = {row.name: row.deviation.maximum for row in run.robustness}
    other = turned_by_hand(case.robots[0].description, 1.0, 0.5 * np.pi)
    file = build_fmu(other, tmp_path / "own.fmu", BuildOptions("native"))
    with RobotFmu(file, "backlash") as fmu:
        path = fmu.simulate(run.correction.joints, run.correction.response.wrench, "dynamic")
    found = measure(path, run.correction.desired).maximum
    assert rows[PHASE_UNKNOWN] == pytest.approx(found, abs=1e-12)
    assert rows[PHASE_UNKNOWN] > 20e-6


def test_plants_and_studies_have_other_kinematic_errors(tmp_path):
    """Degrees become radians; what changes nothing is no parameter; errors of no gear are refused."""
    keys = "kinematic_error_factor = 0.5\nkinematic_error_phase_deg = [90.0, 0.0, 0.0, 0.0, 0.0, -30.0]"
    case = case_of(tmp_path, 'drive = "ideal"', f"[plant]\n{keys}")
    (plant,) = case.plant.robots
    assert plant.difference.amounts["kinematic_error"] == (0.5,)
    assert plant.difference.amounts["kinematic_error_phase"] == pytest.approx(
        [0.5 * np.pi, 0.0, 0.0, 0.0, 0.0, -np.pi / 6.0], rel=1e-15
    )
    assert in_words(case.plant, case.robots) == (
        "kinematic error x 0.5",
        "kinematic error's phase + 90, 0, 0, 0, 0, -30 deg",
    )
    with pytest.raises(CaseError, match="kinematic_error_phase_deg: expected one number, or 6"):
        case_of(tmp_path, "", "[plant]\nkinematic_error_phase_deg = [1.0, 2.0]")
    table = "[study]\nkinematic_error_phase_deg = [-90.0, 90.0]\njoints = 'each'"
    each = UncertainParameters.chosen(with_sines(tmp_path, more=table), loaded=False)
    assert each.names == tuple(f"kinematic_error_phase_deg[{i}]" for i in range(1, 7))
    (sampled,) = each.sampled([0.0, 45.0, 0.0, 0.0, 0.0, 0.0]).differences
    assert sampled.amounts == {
        "kinematic_error_phase": pytest.approx((0.0, np.pi / 4.0, 0.0, 0.0, 0.0, 0.0))
    }
