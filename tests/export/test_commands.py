"""Commands of a run or a table of joint angles become programs; tables that are none are refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_tables import MIDDLES, NAMES, WAY, rows, written
from wall_case import WALL_CASE

from coupling.case.file import load_case
from coupling.export.commands import command_of_table
from coupling.export.exported_program import ExportOptions
from coupling.export.exporting import export_commands
from coupling.export.interpolated import drive_motion
from coupling.files.controller_axes import controller_axes
from coupling.files.robot_file import find_robot, load_robot
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.length_text import format_um
from coupling.programs.languages import LANGUAGES, read_program
from coupling.robot.robot_fmu import DEFAULT_KIND
from coupling.run.execute import run_compensation
from coupling.run.fmu_pool import FmuPool
from coupling.run.folder import write_run
from elastic_robot.description import Robot
from elastic_robot.trajectory import Trajectory


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
    done = command("export", file, *typed)
    assert done.returncode == 0, done.stdout + done.stderr
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
        command_of_table(file, "icme2008"), ExportOptions(LANGUAGES["csv"], "joints")
    )
    angles = np.array([move.joints for move in LANGUAGES["csv"].read(found.files).timed])
    at = np.arange(251) * 0.004
    exact = middle + (10 * at**3 - 15 * at**4 + 6 * at**5)[:, None] * way
    np.testing.assert_allclose(angles, exact, atol=1e-12)


def test_the_clock_of_a_table_may_begin_anywhere(tmp_path):
    """Seconds since 1970 in dyadic rows: the same files."""
    krl, texts = LANGUAGES["krl"], []
    for start in (0.0, 1.75e9, -7.0):
        file = written(tmp_path / "way.csv", rows() + start * (np.arange(7) == 0))
        commands = command_of_table(file, "icme2008")
        (found,) = export_commands(commands, ExportOptions(krl, "cartesian"))
        texts.append([one.text for one in found.files])
    assert texts[1] == texts[0]
    assert texts[2] == texts[0]


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


def test_what_does_not_go_together_is_refused(run, command):
    way = written(run.parent / "way.csv", WAY)
    nowhere = run.parent / "nowhere"
    for typed, message in (
        ([way], "expected a run folder, or the CSV of a command with --robot, got a file"),
        ([nowhere], "with --robot, got nothing of that name"),
        ([run, "--robot", "icme2008"], "--robot: expected a command as CSV with this option"),
        ([way, "--robot", "icme208"], "got 'icme208': did you mean 'icme2008'?"),
        ([nowhere.with_suffix(".csv"), "--robot", "icme2008"], "cannot be read: No such file"),
        ([run.parent], "name a run folder"),
    ):
        done = command("export", *typed, "--to", "krl", "-o", run.parent / "programs")
        assert done.returncode == 2, typed
        assert message in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
    assert not (run.parent / "programs").exists()


def test_every_language_that_is_asked_for_is_written_in_its_folder(run, tmp_path, command):
    """And none of them where one cannot be."""
    place = tmp_path / "all"
    typed = ("--to", "krl", "--to", "rapid", "--to", "csv", "--name", "WAY", "-o", place)
    done = command("export", run, *typed)
    assert done.returncode == 0, done.stderr
    for language in ("krl", "rapid", "csv"):
        assert (place / language / f"WAY{LANGUAGES[language].ending}").is_file()
        assert f"Programs: {place / language}" in done.stdout.replace("\n", "")
    none = tmp_path / "none"
    done = command("export", run, "--to", "krl", "--to", "rapit", "-o", none)
    assert done.returncode == 2
    assert "expected one of krl, rapid, fanuc, csv, got 'rapit'" in done.stderr
    done = command("export", run, "--to", "csv", "--to", "krl", "-o", place)
    assert "holds an export already" in done.stderr
    assert not none.exists()


def cell(table: np.ndarray, row: int, column: int, value: float) -> np.ndarray:
    changed = table.copy()
    changed[row, column] = value
    return changed


def text_of(table: np.ndarray, names: tuple[str, ...] = NAMES) -> bytes:
    lines = [",".join(names), *(",".join(map(repr, row)) for row in table.tolist())]
    return ("\n".join(lines) + "\n").encode()


POSES = ("x", "y", "z", "qx", "qy", "qz", "qw")
# What stands in the file, and what must be said.
HOSTILE: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "got 0 lines"),
    "names alone": (text_of(WAY[:0]), "got 1 lines"),
    "one row": (text_of(WAY[:1]), "at least two rows, got 1"),
    "a joint is missing": (text_of(WAY[:, :-1], NAMES[:-1]), "columns q6 are missing"),
    "a joint more": (text_of(WAY[:, [*range(7), 1]], (*NAMES, "q7")), "q1 to q6 of the robot's"),
    "no time": (text_of(WAY[:, 1:], NAMES[1:]), "columns time are missing"),
    "two of a name": (text_of(WAY[:, [*range(7), 1]], (*NAMES, "q1")), "one column 'q1', got two"),
    "nan": (text_of(cell(WAY, 5, 3, np.nan)), "line 7: q3: expected a finite number, got 'nan'"),
    "infinite": (text_of(cell(WAY, 5, 3, -np.inf)), "line 7: q3: expected a finite number"),
    "overflow": (
        text_of(WAY).replace(b"0.0078125", b"1e999", 1),
        "line 3: time: expected a finite",
    ),
    "huge": (text_of(cell(WAY, 5, 3, 1e90)), "line 7: q3: expected an angle in radians"),
    "degrees": (text_of(np.rad2deg(WAY)), "q5: expected an angle in radians, of 25.1 at most"),
    "time falls": (
        text_of(cell(WAY, 5, 0, 0.01)),
        "line 7: time: expected more than the 0.03125 s",
    ),
    "time stands": (
        text_of(cell(WAY, 5, 0, 0.03125)),
        "expected more than the 0.03125 s before it",
    ),
    "time creeps": (text_of(cell(WAY, 5, 0, 0.03125 + 1e-9)), "at least 1e-06 s apart"),
    "microseconds": (text_of(WAY * [1e6, *[1] * 6]), "at most 20000 s, got one of 1e+06 s"),
    "rates alone": (
        text_of(WAY[:, [*range(7), *range(1, 7)]], (*NAMES, *(f"qd{i}" for i in range(1, 7)))),
        "accelerations qdd1.., or neither, got qd1.. alone",
    ),
    "some rates": (text_of(WAY[:, [*range(7), 1]], (*NAMES, "qd2")), "or none, got qd2"),
    "no rotation": (
        text_of(np.hstack([WAY, np.zeros((129, 7))]), (*NAMES, *POSES)),
        "line 2: qw: expected the last part of a unit quaternion",
    ),
    "another robot": (
        text_of(np.hstack([WAY, np.tile([1.0, 0, 1, 0, 0, 0, 1], (129, 1))]), (*NAMES, *POSES)),
        "it is the command of another robot",
    ),
    "half a row": (text_of(WAY)[:5000], "expected 7 cells"),
    "half a number": (text_of(WAY)[:-2], "expected a line break at its end"),
    "semicolons": (text_of(WAY).replace(b",", b";"), "separate them with commas"),
    "Latin": (
        "# Größe\n".encode("latin-1") + text_of(WAY),
        "expected text in UTF-8, got the byte 0xf6 at 4",
    ),
    "zeros": (b"\0" * 3000 + b"\n" + text_of(WAY), "expected 1 cells"),
    "words": (text_of(WAY).replace(b"0.0078125", b"soon", 1), "finite number, got 'soon'"),
    "a quote": (text_of(WAY) + b'"1,2\n', "is not a table of CSV"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_table_that_is_no_command_is_refused_in_one_sentence(tmp_path, command, name):
    content, message = HOSTILE[name]
    file = tmp_path / "way.csv"
    file.write_bytes(content)
    done = command("export", file, "--robot", "icme2008", "--to", "krl")
    assert done.returncode == 2
    assert message in done.stderr
    assert "way.csv" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == [file]


def limited(folder: Path, key: str) -> Path:
    """Return the example robot with a limit of joint 2."""
    robot = folder / "robot.toml"
    second = "[[joint]]                  # 2\n"
    robot.write_text(find_robot("icme2008").read_text().replace(second, f"{second}{key}\n"))
    return robot


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("limits    = [-0.15, 0.15]", "joint 2: expected angles of -8.59 to 8.59 deg, got"),
        ("max_rate  = 0.001", "joint 2: expected at most 0.001 rad/s, got"),
        ("max_acceleration = 0.01", "joint 2: expected at most 0.01 rad/s^2, got"),
    ],
)
def test_a_table_beyond_what_the_drives_can_do_is_not_written(tmp_path, command, key, message):
    way = written(tmp_path / "way.csv", WAY)
    done = command("export", way, "--robot", limited(tmp_path, key), "--to", "csv")
    assert done.returncode == 2
    assert message in done.stderr
    assert not (tmp_path / "way").exists()


def test_an_arm_of_three_joints_gets_rows_of_angles(tmp_path, command):
    parts = find_robot("icme2008").read_text().split("[[joint]]")
    arm = tmp_path / "arm.toml"
    arm.write_text("[[joint]]".join(parts[:4]))
    way = written(tmp_path / "way.csv", WAY[:, :4], NAMES[:4])
    done = command("export", way, "--robot", arm, "--to", "krl")
    assert "expected a robot of 6 joints, got one of 3: csv takes any number" in done.stderr
    assert command("export", way, "--robot", arm, "--to", "csv").returncode == 0
    assert np.loadtxt(tmp_path / "way/csv/way.csv", delimiter=",", skiprows=1).shape[1] == 4


def test_a_command_that_begins_in_motion_is_named(tmp_path, command):
    """A piece cut out of a longer one: a program begins at rest."""
    motion = Trajectory(WAY[:, 0], WAY[:, 1:])
    piece = np.column_stack([WAY[40:90, 0], *motion.at(WAY[40:90, 0])])
    names = (*NAMES, *(f"qd{i}" for i in range(1, 7)), *(f"qdd{i}" for i in range(1, 7)))
    way = written(tmp_path / "way.csv", piece, names)
    done = command("export", way, "--robot", "icme2008", "--to", "krl")
    assert done.returncode == 1
    assert "Warning: the command begins with joint 1 at 0.1" in done.stdout


def test_a_table_of_singular_postures_is_told_by_angles_alone(tmp_path, command):
    """Joint 5 at zero, as in the first table that anybody writes."""
    table = WAY.copy()
    table[:, 5] = 0.0
    typed = ["export", written(tmp_path / "way.csv", table), "--robot", "icme2008", "--to", "krl"]
    done = command(*typed)
    assert done.returncode == 2
    assert "got one at" in done.stderr
    assert "(wrist): write joint angles with --targets joints" in done.stderr
    assert command(*typed, "--targets", "joints").returncode == 0


def test_rows_of_a_command_of_few_cycles_are_not_solved_for(tmp_path):
    way = written(tmp_path / "way.csv", WAY)
    options = ExportOptions(LANGUAGES["csv"], "joints", cycle=0.3)
    (found,) = export_commands(command_of_table(way, "icme2008"), options)
    assert found.figures.loss_m > options.tolerance
    assert "expected a command of 8 cycles at least, got 3.33" in found.remark


Changed = Callable[[bytes], bytes]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace(b"\n", b"\r\n"),
        lambda text: b"\xef\xbb\xbf" + text,
        lambda text: b"# mine\n\n" + text,
        lambda text: text.replace(b"\n", b",note\n"),
    ],
    ids=["CRLF", "mark", "comment", "other column"],
)
def test_how_others_write_a_table_does_not_matter(tmp_path, change: Changed):
    way = tmp_path / "way.csv"
    way.write_bytes(change(text_of(WAY)))
    (found,) = command_of_table(way, "icme2008")
    np.testing.assert_array_equal(found.joints.q[0], WAY[:, 1:])
