"""Commands from a run folder or a table of joint angles become the programs of their robots."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_tables import MIDDLES, NAMES, WAY, rows, written
from wall_case import WALL_CASE

from coupling.case.file import load_case
from coupling.errors import ProgramError
from coupling.export.commands import command_in_run, command_of_table
from coupling.export.exported_program import ExportOptions
from coupling.export.exporting import export_commands
from coupling.export.interpolated import drive_motion
from coupling.files.controller_axes import controller_axes
from coupling.files.csv_table import WRENCH_COLUMNS
from coupling.files.robot_file import find_robot, load_robot
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.length_text import format_um
from coupling.path.linear import interpolate_rows
from coupling.programs.languages import LANGUAGES, read_program
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.robot_fmu import DEFAULT_KIND
from coupling.run.execute import run_compensation
from coupling.run.fmu_pool import FmuPool
from coupling.run.folder import write_run
from coupling.run.stored_run import read_run
from elastic_robot.description import Robot
from elastic_robot.trajectory import read_trajectory


def tools(robot: Robot, motions: list[JointPath], instants: np.ndarray) -> list[ToolPath]:
    """Return the paths of the moving robot's tool without a process."""
    with FmuPool(DEFAULT_KIND) as models:
        moving = models.of(robot, "backlash").fmu
        none = WrenchHistory.none(instants)
        return [moving.simulate(motion, none, "dynamic") for motion in motions]


@pytest.mark.parametrize(
    ("robot", "language", "targets"),
    [
        ("icme2008", "krl", "cartesian"),
        ("kuka_kr210", "krl", "joints"),
        ("kuka_kr210", "csv", "joints"),
        ("abb_irb7600", "rapid", "joints"),
        ("fanuc_r2000ic", "fanuc", "cartesian"),
    ],
)
def test_a_program_of_a_table_moves_the_robot_as_the_table_does(
    tmp_path, command, robot, language, targets
):
    """Read again without the table, and simulated: at most 5 um are lost, as the summary says."""
    table = rows(robot)
    file = written(tmp_path / "way.csv", table)
    typed = ["--robot", robot, "--to", language, "--targets", targets]
    done = command("export", file, *typed, exits=0)
    place = tmp_path / "way" / language
    assert f"Programs: {place}" in done.stdout
    (says,) = json.loads((place / "export.json").read_text())["robots"]
    name = "WAY" if language == "fanuc" else "way"
    program = read_program(place / f"{name}{LANGUAGES[language].ending}")
    description, axes = load_robot(find_robot(robot)), controller_axes(find_robot(robot), 6)
    motion = drive_motion(program, description, axes, 0.004, 0.0)
    instants = np.arange(251) * 0.004
    motion = JointPath(np.append(motion.time[:-1], max(motion.time[-1], 1.0)), motion.q)
    own = JointPath(table[:, 0], (table[:, 1:],))
    read, given = tools(description, [motion, own], instants)
    loss = read.distance_to(given).max()
    assert loss <= 5e-6
    assert loss == pytest.approx(says["loss_m"], abs=2e-9)
    assert says["deviation_of_command_m"] is None
    assert says["deviation_of_file_m"] is None
    assert f"loss {format_um(says['loss_m'])} um" in done.stdout
    # Its base is the controller's own robot frame.
    np.testing.assert_allclose(says["base"], [0, 0, 0, 0, 0, 0, 1], atol=1e-15)


def test_rates_and_accelerations_of_a_table_count(tmp_path):
    """Three rows of a quintic: a spline of their angles alone would be elsewhere."""
    share = np.array([0.0, 0.5, 1.0])
    rise = 10 * share**3 - 15 * share**4 + 6 * share**5
    rate = 30 * share**2 - 60 * share**3 + 30 * share**4
    bend = 60 * share - 180 * share**2 + 120 * share**3
    way = np.array([0.1, -0.05, 0.08, 0.02, 0.05, 0.1])
    middle = np.deg2rad(MIDDLES["icme2008"])
    table = np.column_stack(
        [share, middle + rise[:, None] * way, rate[:, None] * way, bend[:, None] * way]
    )
    names = (*NAMES, *(f"qd{i}" for i in range(1, 7)), *(f"qdd{i}" for i in range(1, 7)))
    file = written(tmp_path / "way.csv", table, names)
    (found,) = export_commands(
        command_of_table(file, "icme2008", None), ExportOptions(LANGUAGES["csv"], "joints")
    )
    angles = np.array([move.joints for move in LANGUAGES["csv"].read(found.files).timed])
    at = np.arange(251) * 0.004
    exact = middle + (10 * at**3 - 15 * at**4 + 6 * at**5)[:, None] * way
    np.testing.assert_allclose(angles, exact, atol=1e-12)


def test_the_clock_of_a_table_may_begin_anywhere(tmp_path):
    """Seconds since 1970 in dyadic rows: the same files, with the wrench on the same clock."""
    krl, texts = LANGUAGES["krl"], []
    for start in (0.0, 1.75e9, -7.0):
        table = rows() + start * (np.arange(7) == 0)
        file = written(tmp_path / "way.csv", table)
        wrench = np.zeros((3, 7))
        wrench[:, 0], wrench[:, 3] = start + np.array([0.0, 0.25, 1.0]), [0.0, 300.0, 500.0]
        load = written(tmp_path / "wrench.csv", wrench, ("time", *WRENCH_COLUMNS))
        commands = command_of_table(file, "icme2008", load)
        (found,) = export_commands(commands, ExportOptions(krl, "cartesian"))
        texts.append([one.text for one in found.files])
    assert texts[1] == texts[0]
    assert texts[2] == texts[0]


def test_a_wrench_beside_a_table_keeps_its_jumps_and_its_ends(tmp_path):
    """A jump at the start, one that is beside the cycle, and an end behind that of the command."""
    file = written(tmp_path / "way.csv", rows())
    time = np.array([-1.0, 0.0, 0.0, 0.3333, 0.3333, 3.0])
    force = np.array([0.0, 0.0, 100.0, 200.0, -50.0, 350.0])
    table = np.zeros((6, 7))
    table[:, 0], table[:, 3] = time, force
    load = written(tmp_path / "wrench.csv", table, ("time", *WRENCH_COLUMNS))
    (command,) = command_of_table(file, "icme2008", load)
    found = command.wrench
    assert found.jumps.tolist() == [0.0, 0.3333]
    assert (found.time[0], found.time[-1]) == (0.0, 1.0)
    assert found.before[0, [0, -1], 2] == pytest.approx([0.0, -50.0 + 400.0 * 0.6667 / 2.6667])
    own = WrenchHistory(time, table[:, 1:])
    np.testing.assert_allclose(found.before, own.at(found.instants), atol=1e-10)
    cycle = np.arange(251) * 0.004
    assert np.all(np.isin(cycle, found.instants))


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """The run of a line of 2.3 s on a robot whose base is turned."""
    folder = tmp_path_factory.mktemp("edited")
    text = WALL_CASE.format(robot="icme2008", home=MIDDLES["icme2008"], part=[1.4, 0.6, 0.5])
    text = text.replace("feed_m_s = 0.1", "feed_m_s = 0.01")
    text = text.replace("home_deg", "base_rpy_deg = [10.0, 5.0, 20.0]\nhome_deg")
    (folder / "case.toml").write_text(text)
    (folder / "run").mkdir()
    case = load_case(folder / "case.toml")
    done = run_compensation(case)
    assert done.correction.converged
    write_run(folder / "run", case, done)
    return folder / "run"


@pytest.fixture(scope="module")
def edited(run) -> Path:
    """The command of the run with joint 1 moved by 0.1 mrad to and fro, poses and rates with it."""
    names = (run / "command.csv").read_text().split("\n", 1)[0].split(",")
    table = np.loadtxt(run / "command.csv", delimiter=",", skiprows=1)
    share = table[:, 0] / table[-1, 0]
    pace = np.pi / table[-1, 0]
    table[:, 8] += 1e-4 * np.sin(np.pi * share) ** 4
    table[:, 14] += 4e-4 * pace * np.sin(np.pi * share) ** 3 * np.cos(np.pi * share)
    bend = 3.0 * np.cos(np.pi * share) ** 2 - np.sin(np.pi * share) ** 2
    table[:, 20] += 4e-4 * pace**2 * np.sin(np.pi * share) ** 2 * bend
    placed = load_case(run / "case.toml").robots[0]
    planner = InverseKinematics(placed.description, placed.home)
    motion = JointPath(table[:, 0], (table[:, 8:14],))
    table[:, 1:8] = planner.forward(motion, table[:, 0]).transformed(placed.world_from_base).pose[0]
    return written(run.parent / "next.csv", table, tuple(names))


def test_the_runs_own_command_in_its_place_gives_the_same_programs(run, tmp_path, command):
    for place, more in (("own", []), ("given", ["--command", run / "command.csv"])):
        command(
            "export", run, *more, "--to", "krl", "--name", "WAY", "-o", tmp_path / place, exits=0
        )
    for file in (tmp_path / "own").iterdir():
        assert (tmp_path / "given" / file.name).read_bytes() == file.read_bytes()


@pytest.mark.parametrize("language", LANGUAGES)
def test_an_edited_command_becomes_a_program_in_every_language(run, edited, command, language):
    """Under the run's wrench, in the part's frame: what is read back moves as the CSV does."""
    command("export", run, "--command", edited, "--to", language, exits=0)
    place = run.parent / "next" / language
    name = "NEXT" if language == "fanuc" else "next"
    program = read_program(place / f"{name}{LANGUAGES[language].ending}")
    case, stored = load_case(run / "case.toml"), read_run(run).first
    placed = case.robots[0]
    axes = controller_axes(find_robot("icme2008"), 6)
    motion = drive_motion(program, placed.description, axes, 0.004, 0.0)
    loads = stored.wrench.transformed(placed.world_from_base.inverse())
    time = np.append(motion.time[:-1], max(motion.time[-1], loads.time[-1]))
    table = read_trajectory(edited, 6)
    own = np.loadtxt(edited, delimiter=",", skiprows=1)
    assert table.end == own[-1, 0]
    given = JointPath(own[:, 0], *((own[:, k : k + 6],) for k in (8, 14, 20)))
    with FmuPool(case.fmu) as models:
        fmu = models.of(placed.description, "backlash").fmu
        read, asked, first = (
            fmu.simulate(one, loads, "dynamic")
            for one in (JointPath(time, motion.q), given, stored.joints)
        )
    (says,) = json.loads((place / "export.json").read_text())["robots"]
    assert read.distance_to(asked).max() == pytest.approx(says["loss_m"], abs=2e-9)
    assert says["loss_m"] <= 5e-6
    assert asked.distance_to(first).max() > 5e-5
    deviation = read.transformed(placed.world_from_base).distance_to(stored.desired).max()
    assert deviation == pytest.approx(says["deviation_of_file_m"]["maximum"], abs=2e-9)


def test_a_wrench_file_makes_the_run_of_a_table(run, edited, tmp_path):
    """A robot that hangs as the run's is the run's, where the run's wrench is given in its axes."""
    stored, placed = read_run(run).first, load_case(run / "case.toml").robots[0]
    gravity = list(placed.description.gravity)
    robot = tmp_path / "robot.toml"
    text = find_robot("icme2008").read_text()
    head, _, tail = text.partition("gravity")
    robot.write_text(f"{head}gravity = {gravity}{tail[tail.index(chr(10)) :]}")
    loads = stored.wrench.transformed(placed.world_from_base.inverse())
    load = np.column_stack([loads.time, loads.wrench[0]])
    file = written(tmp_path / "wrench.csv", load, ("time", *WRENCH_COLUMNS))
    table = np.loadtxt(run / "command.csv", delimiter=",", skiprows=1)
    names = (*NAMES, *(f"qd{i}" for i in range(1, 7)), *(f"qdd{i}" for i in range(1, 7)))
    way = written(tmp_path / "way.csv", table[:, [0, *range(8, 26)]], names)
    (own,) = command_of_table(way, str(robot), file)
    with FmuPool(own.fmu) as models:
        fmu = models.of(own.placed.description, own.placed.torque_curve).fmu
        path = fmu.simulate(own.joints, own.wrench, "dynamic").transformed(placed.world_from_base)
    position = interpolate_rows(stored.achieved.time, path.time, path.position[0])
    off = np.linalg.norm(position - stored.achieved.position[0], axis=1)
    assert off.max() < 1e-8


def test_what_does_not_go_together_is_refused(run, edited, command):
    way = written(run.parent / "way.csv", WAY)
    nowhere = run.parent / "nowhere"
    for typed, message in (
        ([way], "expected a run folder, or the CSV of a command with --robot, got a file"),
        ([nowhere], "with --robot, got nothing of that name"),
        ([run, "--robot", "icme2008"], "--robot: expected a command as CSV with this option"),
        ([run, "--wrench", way], "--wrench: expected a command as CSV with this option"),
        (
            [run, "--robot", "icme2008", "--command", edited],
            "--robot: expected a command as CSV with this option",
        ),
        ([way, "--command", edited], "--command: expected a run folder with this option, got"),
        ([way, "--robot", "icme2008", "--command", way], "--command: expected a run folder with"),
        ([way, "--robot", "icme208"], "got 'icme208': did you mean 'icme2008'?"),
        ([nowhere.with_suffix(".csv"), "--robot", "icme2008"], "cannot be read: No such file"),
        ([run, "--command", nowhere], "cannot be read: No such file"),
        ([run.parent, "--command", edited], "name a run folder"),
        ([run, "--command", way], "expected a command from 0 to 2.348 s as that of"),
    ):
        done = command("export", *typed, "--to", "krl", "-o", run.parent / "programs", exits=2)
        assert message in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
    assert not (run.parent / "programs").exists()


def test_a_command_of_another_base_is_none_of_the_run(run, edited, tmp_path):
    """The same angles with the poses of a robot that stands upright."""
    table = np.loadtxt(edited, delimiter=",", skiprows=1)
    names = edited.read_text().split("\n", 1)[0].split(",")
    table[:, 1] += 0.01
    off = written(tmp_path / "off.csv", table, tuple(names))
    with pytest.raises(ProgramError, match=r"off\.csv: expected the poses .* 10000 um"):
        command_in_run(run, off)
    # Angles alone are taken for what they are.
    bare = written(tmp_path / "bare.csv", table[:, [0, *range(8, 14)]], NAMES)
    (own,) = command_in_run(run, bare)
    np.testing.assert_array_equal(own.joints.q[0], table[:, 8:14])


def test_a_command_of_rounded_times_is_on_the_clock_of_the_run(run, edited, tmp_path):
    """It ends with the run's wrench but for the rounding of its text."""
    table = np.loadtxt(edited, delimiter=",", skiprows=1)[:, [0, *range(8, 14)]]
    end = read_run(run).first.wrench.time[-1]
    table[[0, -1], 0] = 4e-7, end - 4e-7
    (own,) = command_in_run(run, written(tmp_path / "rounded.csv", table))
    assert own.joints.time[[0, -1]].tolist() == [0.0, end]
    table[-1, 0] = end - 4e-6
    with pytest.raises(ProgramError, match="expected a command from 0 to"):
        command_in_run(run, written(tmp_path / "short.csv", table))


def test_every_language_that_is_asked_for_is_written_in_its_folder(run, tmp_path, command):
    """And none of them where one cannot be."""
    place = tmp_path / "all"
    typed = ("--to", "krl", "--to", "rapid", "--to", "csv", "--name", "WAY", "-o", place)
    done = command("export", run, *typed, exits=0)
    for language in ("krl", "rapid", "csv"):
        assert (place / language / f"WAY{LANGUAGES[language].ending}").is_file()
        assert f"Programs: {place / language}" in done.stdout.replace("\n", "")
    none = tmp_path / "none"
    done = command("export", run, "--to", "krl", "--to", "rapit", "-o", none, exits=2)
    assert "expected one of krl, rapid, fanuc, csv, got 'rapit'" in done.stderr
    done = command("export", run, "--to", "csv", "--to", "krl", "-o", place)
    assert "holds an export already" in done.stderr
    assert not none.exists()
