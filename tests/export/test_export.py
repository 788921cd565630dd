"""elastic-robot export, as a user types it: files, what they do to the moving robot, refusals."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from exported_runs import ROBOTS, ran
from wall_case import WALL_CASE

from coupling.case.file import load_case
from coupling.errors import PlanningError
from coupling.export import exporting
from coupling.export.commands import commands_of_run
from coupling.export.exported_program import ExportedProgram, ExportOptions
from coupling.export.exporting import export_commands
from coupling.export.interpolated import drive_motion
from coupling.files.controller_axes import ControllerAxes, controller_axes
from coupling.files.csv_table import read_table
from coupling.files.robot_file import find_robot
from coupling.files.written_files import LIST
from coupling.path.joint_path import JointPath
from coupling.programs.languages import LANGUAGES, read_program
from coupling.programs.program import RobotProgram
from coupling.robot.inverter import Inverter
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.stored_run import read_run


def programs_of(run: Path, options: ExportOptions) -> tuple[ExportedProgram, ...]:
    return export_commands(commands_of_run(run), options)


def simulated(run: Path, files: Path, name: str) -> tuple[float, float]:
    """Return loss and deviation of files [m], from their text and the robot of the run alone."""
    return moved(run, read_program(files), name, 0.004)


def moved(run: Path, program: RobotProgram, name: str, cycle: float) -> tuple[float, float]:
    """Return loss and deviation of a program on a controller's cycle [m]."""
    case, stored = load_case(run / "case.toml"), read_run(run).first
    joints = controller_axes(find_robot(name), 6)
    motion = drive_motion(program, case.robots[0].description, joints, cycle, 0.0)
    time = np.append(motion.time[:-1], max(motion.time[-1], stored.wrench.time[-1]))
    with FmuPool(case.fmu) as models:
        cell, _ = cell_of(case.robots, models)
        command = cell.simulate(stored.joints, stored.wrench, "dynamic")
        path = cell.simulate(type(motion)(time, motion.q), stored.wrench, "dynamic")
    return float(path.distance_to(command).max()), float(path.distance_to(stored.desired).max())


@pytest.mark.parametrize(
    ("robot", "language", "targets"),
    [
        ("icme2008", "krl", "cartesian"),
        ("icme2008", "krl", "joints"),
        ("icme2008", "csv", "joints"),
        ("abb_irb7600", "rapid", "cartesian"),
        ("abb_irb7600", "rapid", "joints"),
        ("fanuc_r2000ic", "fanuc", "cartesian"),
        ("fanuc_r2000ic", "fanuc", "joints"),
    ],
)
def test_the_files_do_what_the_summary_says(runs, tmp_path, command, robot, language, targets):
    """Read again without knowing the command, and simulated: the loss is at most 5 um."""
    place = tmp_path / "programs"
    done = command(
        "export",
        runs[robot],
        "--to",
        language,
        "--targets",
        targets,
        "-o",
        place,
        "--name",
        "WAY",
        exits=0,
    )
    (robot_says,) = json.loads((place / "export.json").read_text())["robots"]
    loss, deviation = simulated(runs[robot], place / f"WAY{LANGUAGES[language].ending}", robot)
    assert loss <= 5e-6
    assert loss == pytest.approx(robot_says["loss_m"], abs=1e-9)
    assert deviation == pytest.approx(robot_says["deviation_of_file_m"]["maximum"], abs=1e-9)
    assert robot_says["counted_as_controller"] is (robot != "icme2008")
    assert ("has no [controller]" in done.stdout) is (robot == "icme2008")
    for file in robot_says["files"]:
        assert (place / file["name"]).stat().st_size == file["bytes"]
    timed = read_program(place / f"WAY{LANGUAGES[language].ending}").timed
    assert len(timed) == robot_says["points"]
    assert len(timed) < robot_says["points_on_every_cycle"] or language == "csv"
    # Its timing is that of the command, on the controller's cycle.
    times = np.cumsum([move.duration for move in timed[1:]])
    command_time = read_table(runs[robot] / "command.csv", ("time",), AssertionError)[:, 0]
    assert times[-1] == pytest.approx(command_time[-1], abs=1e-6)
    cycles = times / 0.004
    np.testing.assert_allclose(cycles, np.round(cycles), atol=1e-3)


@pytest.mark.parametrize("cycle_ms", [4, 12])
def test_csv_rows_are_on_the_cycle_exactly(run, command, cycle_ms):
    """On the command's own cycle they are its rows, as these lose little."""
    command("export", run, "--to", "csv", "--cycle-ms", str(cycle_ms), exits=0)
    rows = np.loadtxt(run / "csv" / "stroke.csv", delimiter=",", skiprows=1)
    assert rows[:, 0].tolist() == [round(1e-3 * cycle_ms * k, 9) for k in range(len(rows))]
    if cycle_ms == 4:
        own = read_table(run / "command.csv", [f"q{i}" for i in range(1, 7)], AssertionError)
        np.testing.assert_allclose(rows[:, 1:], own, rtol=0, atol=1e-15)


def test_rows_are_solved_for_where_samples_of_the_command_lose_too_much(tmp_path, monkeypatch):
    """20 ms, longer than a gear takes through its backlash; the loss is found again from the text.

    A path of 17 cycles: of one that ends shortly behind a row, rows as long as that lose more.
    """
    csv, (home, part) = LANGUAGES["csv"], ROBOTS["icme2008"]
    feed = np.linalg.norm([0.02, 0.01, 0.002]) / (17 * 0.02 - 0.1)
    text = WALL_CASE.format(robot="icme2008", home=home, part=part)
    run = ran(tmp_path, text.replace("feed_m_s = 0.1", f"feed_m_s = {feed:.15f}"))
    options = ExportOptions(csv, "joints", cycle=0.02)
    (solved,) = programs_of(run, options)
    monkeypatch.setattr(exporting, "_INVERSE_TOLERANCES", ())
    (samples,) = programs_of(run, options)
    assert samples.figures.loss_m > 5 * options.tolerance
    assert solved.figures.loss_m <= options.tolerance
    loss, deviation = moved(run, csv.read(solved.files), "icme2008", 0.02)
    assert loss == pytest.approx(solved.figures.loss_m, abs=1e-9)
    assert deviation == pytest.approx(solved.figures.deviation_of_file_m.maximum, abs=1e-9)


def test_what_keeps_rows_from_being_solved_for_is_said(runs, monkeypatch):
    def lost(*_):
        raise PlanningError("joint 2: passes its limit")

    monkeypatch.setattr(Inverter, "invert", lost)
    (found,) = programs_of(runs["icme2008"], ExportOptions(LANGUAGES["csv"], "joints", cycle=0.02))
    assert found.figures.loss_m > 5e-6
    assert found.remark.endswith("command were found: joint 2: passes its limit")


def test_a_smaller_tolerance_takes_more_points_and_loses_less(runs):
    krl = LANGUAGES["krl"]
    (loose,) = programs_of(
        runs["icme2008"], ExportOptions(krl, "cartesian", tolerance=50e-6, shortest=0.004)
    )
    (tight,) = programs_of(
        runs["icme2008"], ExportOptions(krl, "cartesian", tolerance=1e-6, shortest=0.004)
    )
    assert tight.figures.loss_m <= 1e-6 < loose.figures.loss_m <= 50e-6
    assert loose.figures.points < tight.figures.points


@pytest.mark.parametrize(
    ("asked", "closest"), [(0.021, 0.024), (0.001, 0.004), (0.012, 0.012), (5.0, 0.25)]
)
def test_no_two_targets_are_closer_than_asked(runs, asked, closest):
    rapid = LANGUAGES["rapid"]
    (found,) = programs_of(runs["fanuc_r2000ic"], ExportOptions(rapid, "joints", shortest=asked))
    times = [move.duration for move in rapid.read(found.files).timed[1:]]
    assert min(times) == pytest.approx(found.figures.shortest_time_s, rel=1e-5)
    assert min(times) > closest - 1e-6
    # All are whole multiples of it but the last, which takes what is left.
    steps = np.array(times[:-1]) / closest
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-3)
    assert found.figures.median_time_s == pytest.approx(np.median(times), rel=1e-5)
    alike = [time for time in times if time < min(times) + 1e-6]
    assert found.share_of_shortest == pytest.approx(len(alike) / len(times))


@pytest.mark.parametrize(
    ("language", "usual"), [("krl", 0.012), ("rapid", 0.012), ("fanuc", 0.008)]
)
def test_targets_are_as_far_apart_as_is_usual_or_as_the_tolerance_takes(runs, language, usual):
    def exported(tolerance: float):
        options = ExportOptions(LANGUAGES[language], "joints", tolerance=tolerance)
        return programs_of(runs["fanuc_r2000ic"], options)[0]

    assert exported(1e-3).figures.shortest_time_s > usual - 1e-6
    tight = exported(5e-6)
    assert tight.figures.loss_m <= 5e-6
    asked = ExportOptions(LANGUAGES[language], "joints", shortest=usual)
    if programs_of(runs["fanuc_r2000ic"], asked)[0].figures.loss_m > 5e-6:
        assert tight.figures.shortest_time_s < usual - 1e-6


def test_the_verdict_is_said_first_and_the_closest_targets_with_it(runs, command, tmp_path):
    typed = ("export", runs["abb_irb7600"], "--to", "rapid", "-o", tmp_path / "p", "--overwrite")
    close = command(*typed, "--shortest-ms", "4").stdout.strip().splitlines()
    assert close[0].startswith("NOT CERTAIN: ")
    assert close[0].endswith("4 ms apart in time: --shortest-ms 12")
    assert any("of the targets are 4 ms apart" in line for line in close)
    usual = command(*typed, "--shortest-ms", "12").stdout.strip().splitlines()
    assert usual[0].startswith("NOT KEPT: expected a loss of at most 5 um")
    assert any("of the targets are 12 ms apart" in line for line in usual)
    assert not any(line.startswith("Warning") for line in usual)


def test_the_option_that_is_advised_keeps_the_tolerance(runs, command, tmp_path):
    typed = ("export", runs["abb_irb7600"], "--to", "rapid", "-o", tmp_path / "p", "--overwrite")
    done = command(*typed, "--shortest-ms", "24", exits=1)
    option = re.search(
        r"at most 5 um \(--tolerance\), got \S+ um: (--\S+) (\S+) keeps it", done.stdout
    )
    command(*typed, *option.groups(), exits=0)
    (tight,) = programs_of(
        runs["abb_irb7600"], ExportOptions(LANGUAGES["rapid"], "joints", tolerance=1e-9)
    )
    accepted = re.match(r"--tolerance (\S+) accepts it", tight.advice)
    assert 0.0 <= float(accepted[1]) - 1e6 * tight.figures.loss_m < 1.0


@pytest.mark.parametrize(("cycle", "language"), [(0.004, "fanuc"), (0.012, "rapid")])
def test_the_loss_on_joint_lines_is_that_of_lines_drawn_finely(runs, cycle, language):
    """Reference: angles between set points by np.interp, every 0.2 ms a row of their own."""
    own, run = LANGUAGES[language], runs["fanuc_r2000ic"]
    (found,) = programs_of(run, ExportOptions(own, "joints", cycle=cycle, shortest=cycle))
    case, stored = load_case(run / "case.toml"), read_run(run).first
    axes = controller_axes(find_robot("fanuc_r2000ic"), 6)
    motion = drive_motion(own.read(found.files), case.robots[0].description, axes, cycle, 0.0)
    end = max(motion.time[-1], stored.wrench.time[-1])
    time = np.append(motion.time[:-1], end)
    fine = np.linspace(0.0, end, round(end / 2e-4) + 1)
    lines = np.column_stack([np.interp(fine, time, row) for row in motion.q[0].T])
    with FmuPool(case.fmu) as models:
        cell, _ = cell_of(case.robots, models)
        command = cell.simulate(stored.joints, stored.wrench, "dynamic")
        path = cell.simulate(JointPath(fine, (lines,)), stored.wrench, "dynamic")
    assert abs(found.figures.loss_on_joint_lines_m - found.figures.loss_m) > 0.05e-6
    assert found.figures.loss_on_joint_lines_m == pytest.approx(
        path.distance_to(command).max(), rel=5e-3
    )


def test_splines_have_no_loss_on_joint_lines(runs):
    (found,) = programs_of(
        runs["icme2008"], ExportOptions(LANGUAGES["krl"], "joints", tolerance=1e-3)
    )
    assert found.figures.loss_on_joint_lines_m is None


def test_programs_say_what_of_the_controller_they_overwrite_and_do_not_set(runs):
    texts = {
        name: programs_of(
            runs["icme2008"], ExportOptions(LANGUAGES[name], "joints", tolerance=1e-3)
        )[0]
        .files[0]
        .text
        for name in ("krl", "rapid", "fanuc")
    }
    assert re.search(r"^; \$LOAD, the load on the flange, is the controller's", texts["krl"], re.M)
    assert "set the load of the tool" in texts["rapid"]
    for words in ("!Overwrites PR[9], UFRAME[9]", "!and UTOOL[9]", "!PAYLOAD"):
        assert words in texts["fanuc"]


def test_a_loss_that_cannot_be_kept_is_said(run, command, monkeypatch):
    monkeypatch.setattr(exporting, "_MAX_PROGRAMS", 1)
    done = command("export", run, "--to", "krl", "--tolerance", "0.01", exits=1)
    assert "NOT KEPT: expected a loss of at most 0.01 um" in done.stdout
    assert (run / "krl" / "stroke.src").exists()


def test_a_cell_has_a_program_for_each_robot(tmp_path, command):
    case = (Path(__file__).parents[2] / "examples" / "cases" / "two_robots.toml").read_text()
    quick = case.replace("depth_m        = 0.005", "depth_m        = 0.0005").replace(
        "0.06", "0.002"
    )
    out = ran(tmp_path, quick, "couple")
    command("export", out, "--to", "rapid", exits=0)
    names = {file.name for file in (out / "rapid").iterdir()}
    assert names == {"pair_forming.mod", "pair_support.mod", "export.json", LIST}
    robots = json.loads((out / "rapid" / "export.json").read_text())["robots"]
    assert [robot["robot"] for robot in robots] == ["forming", "support"]
    assert max(robot["loss_m"] for robot in robots) <= 5e-6


def test_krl_says_the_posture_where_the_robot_file_says_how_the_controller_counts(
    run, command, tmp_path
):
    """Joint 1 the other way round, joint 2 from the horizontal: with it the turns of its angles."""
    command("export", run, "--to", "krl", exits=0)
    assert "DECL FRAME P[" in (run / "krl" / "stroke.dat").read_text()
    robot = tmp_path / "robot.toml"
    signs = np.diag([-1.0, 1.0, 1.0, 1.0, 1.0, 1.0]).tolist()
    keys = f"[controller]\njoint_matrix = {signs}\njoint_offset_deg = [0, -90, 90, 0, 0, 0]\n"
    robot.write_text(find_robot("icme2008").read_text().replace("[sources]", f"{keys}[sources]"))
    case = run / "case.toml"
    case.write_text(case.read_text().replace('"icme2008"', json.dumps(str(robot))))
    command("export", run, "--to", "krl", "--overwrite", exits=0)
    text = (run / "krl" / "stroke.dat").read_text()
    start = np.rad2deg(read_program(run / "krl" / "stroke.src").moves[0].joints)
    assert "DECL POS P[" in text
    status = 2 + 4 * (start[4] < 0.0)
    turn = sum(2**i for i in range(6) if start[i] < 0.0)
    assert f",S {status},T {turn}}}" in text.splitlines()[2]
    assert turn & 2  # joint 2 leans forward by less than 90 deg
    assert start[0] * read_run(run).first.joints.q[0][0, 0] < 0.0


def test_the_controllers_own_angles_do_not_change_what_the_robot_does(runs):
    """FANUC's count, base and flange against the robot file's: other numbers, the same motion."""
    fanuc = LANGUAGES["fanuc"]
    (found,) = programs_of(runs["fanuc_r2000ic"], ExportOptions(fanuc, "cartesian"))
    case = load_case(runs["fanuc_r2000ic"] / "case.toml")
    robot = case.robots[0].description
    counted = drive_motion(
        fanuc.read(found.files), robot, controller_axes(find_robot("fanuc_r2000ic"), 6), 0.004, 0.0
    )
    command = read_run(runs["fanuc_r2000ic"]).first.joints
    np.testing.assert_allclose(counted.q[0][0], command.q[0][0], atol=1e-6)
    start = np.rad2deg(fanuc.read(found.files).moves[0].joints)
    q = np.rad2deg(command.q[0][0])
    np.testing.assert_allclose(start, [q[0], q[1], q[2] - q[1], *q[3:]], atol=2e-5)
    assert not ControllerAxes.as_described(6).stated
