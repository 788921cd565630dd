"""`drive` of a case's robots: what they are by default, and that all commands take it from there."""

import tomllib
from dataclasses import replace
from pathlib import Path
from zipfile import ZipFile

import fmpy
import numpy as np
import pytest
from line_case import moving_line
from motor_file import with_motors
from places import CASES
from tuned_fmu import simulate_tuned

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.check.new_case import new_case, write_case
from coupling.errors import CaseError, LearnError
from coupling.export.commands import command_of_table, commands_of_run
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.ssp import SspSystem
from coupling.identification.runs.measurement import Measurement
from coupling.identification.runs.source import read_source, require_comparable
from coupling.path.deviation import measure
from coupling.report.run_report import run_report
from coupling.report.verdict import sentence
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.execute import run_compensation, run_coupling
from coupling.run.folder import write_run
from coupling.run.plant import PLANT_REPLAY
from coupling.run.plausibility import remarks
from coupling.run.stored_run import read_run

SERVO, WITHOUT = "servo.toml", "icme2008"


def case_of(folder: Path, robot: str, keys: str = "", more: str = "") -> Case:
    with_motors(folder)
    file = folder / "line.toml"
    text = moving_line(('"icme2008"', f'"{robot}"\n{keys}'))
    file.write_text(f"{text}\n{more}\n")
    return load_case(file)


@pytest.mark.parametrize(
    ("robot", "keys", "drive"),
    [
        (WITHOUT, "", "ideal"),
        (WITHOUT, 'drive = "ideal"', "ideal"),
        (WITHOUT, 'fmu = "python"', "ideal"),
        (SERVO, "", "servo"),
        (SERVO, 'drive = "servo"', "servo"),
        (SERVO, 'drive = "ideal"', "ideal"),
        (SERVO, 'drive = "ideal"\nfmu = "python"', "ideal"),
        (
            WITHOUT,
            'drive = "servo"',
            r"robot: drive: expected a \[joint.drive\] in the file of icme",
        ),
        (SERVO, 'fmu = "python"', "servo"),
        (SERVO, 'drive = "torque"', "robot: drive: expected 'ideal' or 'servo', got 'torque'"),
    ],
)
def test_drives_are_servos_where_the_file_has_motors_unless_the_case_says(
    tmp_path, robot, keys, drive
):
    if drive not in ("ideal", "servo"):
        with pytest.raises(CaseError, match=drive):
            case_of(tmp_path, robot, keys)
        return
    case = case_of(tmp_path, robot, keys)
    assert case.robots[0].drive == case.resolved["robot"]["drive"] == drive
    said = any("its drives are ideal" in remark for remark in remarks(case))
    assert said == (robot == SERVO and drive == "ideal")


@pytest.mark.parametrize(
    ("model", "plant", "drive"),
    [
        ("", "stiffness_factor = 1.0", "servo"),
        ('drive = "ideal"', "stiffness_factor = 1.0", "ideal"),
        ("", 'drive = "ideal"', "ideal"),
        ('drive = "ideal"', 'drive = "servo"', "servo"),
        ("", f'description = "{WITHOUT}"', "ideal"),
        ('drive = "ideal"', f'description = "{SERVO}"', "servo"),
    ],
)
def test_a_plant_has_the_models_drives_or_those_of_its_own_file(tmp_path, model, plant, drive):
    case = case_of(tmp_path, SERVO, model, f"[plant]\n{plant}")
    assert case.plant.robots[0].drive == drive


def test_the_supporting_robot_has_drives_of_its_own(tmp_path):
    """In the cell of the examples, one robot with motors and one without."""
    with_motors(tmp_path)
    text = (CASES / "two_robots.toml").read_text()
    first, _, second = text.partition("[support]")
    name = '"icme2008"'
    assert name in first
    assert name in second
    (tmp_path / "cell.toml").write_text(first + "[support]" + second.replace(name, '"servo.toml"'))
    case = load_case(tmp_path / "cell.toml")
    assert [own.drive for own in case.robots] == ["ideal", "servo"]
    assert [case.resolved[table]["drive"] for table in ("robot", "support")] == ["ideal", "servo"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> tuple[Case, object, Path]:
    folder = tmp_path_factory.mktemp("servo")
    case = case_of(folder, SERVO, more='[plant]\ndrive = "ideal"')
    run = run_compensation(case)
    (folder / "out").mkdir()
    write_run(folder / "out", case, run)
    return case, run, folder / "out"


def simulated(case: Case, stored, folder: Path, drive: str):
    """The files of a run on an FMU built by hand: largest distance from the desired path [m]."""
    file = build_fmu(case.robots[0].description, folder / "own.fmu", BuildOptions("native"))
    with RobotFmu(file, "backlash") as fmu:
        path = simulate_tuned(fmu, stored.joints, stored.wrench, "dynamic", {"drive": drive})
    return path, measure(path, stored.desired).maximum


def test_a_case_asks_for_the_command_of_a_robot_with_servos(finished, tmp_path):
    """Achieved is what the FMU does with drive = servo set by hand; ideal drives do something else."""
    case, run, folder = finished
    stored = read_run(folder).first
    assert run.correction.converged
    path, left = simulated(case, stored, tmp_path, "servo")
    np.testing.assert_allclose(stored.achieved.pose, path.pose, rtol=0, atol=1e-12)
    assert left < case.method.tolerance_m
    path, other = simulated(case, stored, tmp_path, "ideal")
    np.testing.assert_allclose(stored.plant.pose, path.pose, rtol=0, atol=1e-12)
    assert other > 3.0 * case.method.tolerance_m
    assert run.finding_of(PLANT_REPLAY).differences == ('drive = "ideal"',)
    (robot,) = stored.figures.robots
    assert robot.drive == "servo"
    text = "\n".join(str(part) for s in run_report(read_run(folder)).content for part in s.parts)
    assert "torque curve backlash, motors under their servos)" in text
    assert "its drives are ideal" not in text
    without_inertia = stored.figures.model_copy(update={"mode": "quasistatic"})
    assert "servos" not in sentence(without_inertia, "wall")
    again = load_case(folder / "case.toml")
    assert again.robots[0].drive == "servo"


def test_coupling_moves_the_motors_as_well(tmp_path):
    """The path of the uncorrected command, of the FMU with its drive set by hand."""
    case = case_of(tmp_path, SERVO)
    run = run_coupling(case)
    file = build_fmu(case.robots[0].description, tmp_path / "own.fmu", BuildOptions("native"))
    wrench = run.correction.response.wrench
    with RobotFmu(file, "backlash") as fmu:
        paths = {
            drive: simulate_tuned(fmu, run.correction.joints, wrench, "dynamic", {"drive": drive})
            for drive in ("servo", "ideal")
        }
    off = {drive: path.distance_to(run.correction.achieved).max() for drive, path in paths.items()}
    assert off["servo"] < 1e-9
    assert off["ideal"] > 1e-5


def test_programs_are_judged_with_the_servos(finished, tmp_path):
    _, _, folder = finished
    (own,) = commands_of_run(folder)
    assert own.placed.drive == "servo"
    for robot, drive in ((tmp_path / SERVO, "servo"), (WITHOUT, "ideal")):
        with_motors(tmp_path)
        (told,) = command_of_table(folder / "command.csv", str(robot), None)
        assert told.placed.drive == drive


def test_runs_with_and_without_servos_are_not_learned_together(finished):
    _, _, folder = finished
    own = read_source(folder, Measurement("seen.csv", np.arange(2.0), np.zeros((2, 3))))
    assert own.drive == "servo"
    with pytest.raises(LearnError, match=r"expected drive = 'servo' as in .*, got 'ideal'"):
        require_comparable([own, replace(own, drive="ideal")])


def test_an_archive_for_other_masters_moves_the_motors(tmp_path):
    for robot, drive in ((SERVO, "servo"), (WITHOUT, "ideal")):
        system = SspSystem.of(case_of(tmp_path, robot))
        assert any("estimated for drives" in said for said in system.remarks()) == (
            drive == "servo"
        )
        with ZipFile(system.write(tmp_path / f"{drive}.ssp")) as archive:
            robot_fmu = archive.extract("resources/ElasticRobot.fmu", tmp_path / drive)
        variables = fmpy.read_model_description(robot_fmu).modelVariables
        assert next(v.start for v in variables if v.name == "drive") == drive


def test_init_says_that_a_robot_with_motors_has_servos(tmp_path):
    with_motors(tmp_path)
    for robot, drive in ((str(tmp_path / SERVO), "servo"), (WITHOUT, None)):
        folder = tmp_path / Path(robot).stem
        file = write_case(new_case(robot, "isf-force-law", True, folder), folder)
        tables = tomllib.loads(file.read_text())
        assert [tables[name].get("drive") for name in ("robot", "support")] == [drive, drive]
