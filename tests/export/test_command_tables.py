"""Tables that are commands, however others write them, and those that are refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_tables import NAMES, WAY, written

from coupling.errors import ProgramError
from coupling.export.commands import command_of_table
from coupling.export.exported_program import ExportOptions
from coupling.export.exporting import export_commands
from coupling.files.csv_table import WRENCH_COLUMNS
from coupling.files.robot_file import find_robot
from coupling.programs.languages import LANGUAGES
from elastic_robot.trajectory import Trajectory


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
    done = command("export", file, "--robot", "icme2008", "--to", "krl", exits=2)
    assert message in done.stderr
    assert "way.csv" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == [file]


LOADS: dict[str, tuple[list[float], list[float], str]] = {
    "ends early": (
        [0.0, 0.5],
        [0.0, 1.0],
        "expected a wrench all along the command, from 0 to 1 s",
    ),
    "begins late": ([0.1, 1.0], [0.0, 1.0], "got one from 0.1 to 1 s"),
    "falls": ([0.0, 0.7, 0.5, 1.0], [0.0] * 4, "time: expected rising values"),
    "is no number": ([0.0, 1.0], [0.0, np.nan], "fz: expected a finite number"),
}


@pytest.mark.parametrize("name", LOADS)
def test_a_wrench_that_is_not_the_commands_is_refused(tmp_path, name):
    time, force, message = LOADS[name]
    table = np.zeros((len(time), 7))
    table[:, 0], table[:, 3] = time, force
    load = written(tmp_path / "wrench.csv", table, ("time", *WRENCH_COLUMNS))
    with pytest.raises(ProgramError, match=r"wrench\.csv: .*" + message):
        command_of_table(written(tmp_path / "way.csv", WAY), "icme2008", load)


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
    done = command("export", way, "--robot", limited(tmp_path, key), "--to", "csv", exits=2)
    assert message in done.stderr
    assert not (tmp_path / "way").exists()


def test_an_arm_of_three_joints_gets_rows_of_angles(tmp_path, command):
    parts = find_robot("icme2008").read_text().split("[[joint]]")
    arm = tmp_path / "arm.toml"
    arm.write_text("[[joint]]".join(parts[:4]))
    way = written(tmp_path / "way.csv", WAY[:, :4], NAMES[:4])
    done = command("export", way, "--robot", arm, "--to", "krl")
    assert "expected a robot of 6 joints, got one of 3: csv takes any number" in done.stderr
    command("export", way, "--robot", arm, "--to", "csv", exits=0)
    assert np.loadtxt(tmp_path / "way/csv/way.csv", delimiter=",", skiprows=1).shape[1] == 4


def test_a_command_that_begins_in_motion_is_named(tmp_path, command):
    """A piece cut out of a longer one: a program begins at rest."""
    motion = Trajectory(WAY[:, 0], WAY[:, 1:])
    piece = np.column_stack([WAY[40:90, 0], *motion.at(WAY[40:90, 0])])
    names = (*NAMES, *(f"qd{i}" for i in range(1, 7)), *(f"qdd{i}" for i in range(1, 7)))
    way = written(tmp_path / "way.csv", piece, names)
    done = command("export", way, "--robot", "icme2008", "--to", "krl", exits=1)
    assert "Warning: the command begins with joint 1 at 0.1" in done.stdout


def test_a_table_of_singular_postures_is_told_by_angles_alone(tmp_path, command):
    """Joint 5 at zero, as in the first table that anybody writes."""
    table = WAY.copy()
    table[:, 5] = 0.0
    typed = ["export", written(tmp_path / "way.csv", table), "--robot", "icme2008", "--to", "krl"]
    done = command(*typed, exits=2)
    assert "got one at" in done.stderr
    assert "(wrist): write joint angles with --targets joints" in done.stderr
    command(*typed, "--targets", "joints", exits=0)


def test_rows_of_a_command_of_few_cycles_are_not_solved_for(tmp_path):
    way = written(tmp_path / "way.csv", WAY)
    options = ExportOptions(LANGUAGES["csv"], "joints", cycle=0.3)
    (found,) = export_commands(command_of_table(way, "icme2008", None), options)
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
    (found,) = command_of_table(way, "icme2008", None)
    np.testing.assert_array_equal(found.joints.q[0], WAY[:, 1:])
