"""What cannot be run, and whatever else ends a command, is said in one message."""

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import command
from line_case import changed_text
from places import LINE_CASE
from places import LINE_CASE as LINE

from coupling.case.file import load_case
from coupling.cli.console import console
from coupling.cli.main import describe_failure
from coupling.cli.streams import LastingStream
from coupling.errors import CaseError

_PROGRAM = [sys.executable, "-m", "coupling.cli"]


def changed(old: str, new: str) -> str:
    return changed_text(LINE, (old, new))


# What is wrong with the case, and what the one message must contain.
BAD_CASES = {
    "unknown key": (
        changed("feed_m_s", "feed_ms"),
        ["tool_path", "'feed_ms'", "did you mean 'feed_m_s'"],
    ),
    "unknown table": (changed("[part]", "[work]"), ["unknown key 'work'"]),
    "wrong type": (
        changed("feed_m_s = 0.1", 'feed_m_s = "fast"'),
        ["tool_path: feed_m_s", "'fast'"],
    ),
    "negative": (
        changed("feed_m_s = 0.1", "feed_m_s = -0.1"),
        ["feed_m_s", "expected a number greater than 0, got -0.1"],
    ),
    "NaN": (changed("[1.6, 0.1, 0.8]", "[1.6, nan, 0.8]"), ["part: position_m 2", "nan"]),
    "unknown process": (
        changed('"elastic-wall"', '"elastic-wal"'),
        ["process: model", "did you mean 'elastic-wall'", "isf-force-law"],
    ),
    "unknown scheme": (
        changed('"anderson"', '"newton"'),
        ["coupling: scheme", "'newton'", "constant, aitken, anderson"],
    ),
    "unknown method": (
        changed('"mirror"', '"miror"'),
        ["compensation: method", "did you mean 'mirror'"],
    ),
    "unknown path": (
        changed('"line"', '"spiral"'),
        ["tool_path: kind", "'spiral'", "cone, pyramid"],
    ),
    "unknown curve": (
        changed('"linear"', '"cubic"'),
        ["robot: torque_curve", "linear, backlash, spline"],
    ),
    "unknown mode": (changed('"quasistatic"', '"static"'), ["robot: mode", "quasistatic"]),
    "unknown interpolation": (
        LINE.read_text() + '\n[controller]\ninterpolation = "quntic"\n',
        ["controller: interpolation", "did you mean 'quintic'", "cubic"],
    ),
    "no cycle": (
        LINE.read_text() + "\n[controller]\ncycle_s = 0.0\n",
        ["controller: cycle_s", "expected a number greater than or equal to 0.0001, got 0.0"],
    ),
    "rate of a controller": (
        LINE.read_text() + "\n[controller]\nmax_rate_rad_s = 1.0\n",
        ["controller", "'max_rate_rad_s'"],
    ),
    "unknown robot": (changed('"icme2008"', '"icme2009"'), ["icme2009", "did you mean 'icme2008'"]),
    "missing key": (changed("stiffness_N_m = 2.0e5", ""), ["process", "stiffness_N_m", "missing"]),
    "home too short": (changed("60.0, 0.0]", "60.0]"), ["home_deg", "expected 6 angles", "got 5"]),
    "unreachable": (
        changed("position_m = [1.6, 0.1, 0.8]", "position_m = [5.0, 0.1, 0.8]"),
        ["sample 1", "out of reach", "mm away", "joint"],
    ),
    "not TOML": ("[robot", ["not valid TOML"]),
    "csv that is not there": (
        changed('kind     = "line"', 'kind = "csv"\nfile = "none.csv"')
        .replace("points_m", "# points_m")
        .replace("feed_m_s", "# feed_m_s")
        .replace("blend_s", "# blend_s")
        .replace("sample_s", "# sample_s"),
        ["none.csv", "cannot be read"],
    ),
}


@pytest.mark.parametrize("name", BAD_CASES)
def test_a_bad_case_is_one_message_status_2_and_nothing_written(tmp_path, name):
    text, words = BAD_CASES[name]
    case = tmp_path / "bad.toml"
    case.write_text(text)
    done = command("compensate", case, "-o", tmp_path / "out" / "run")
    said = " ".join(done.stderr.split())
    assert done.returncode == 2, done.stdout + done.stderr
    assert [word for word in words if word not in said] == []
    assert "Traceback" not in said
    assert said.count("error:") == 1
    assert not (tmp_path / "out" / "run").exists()
    assert [f.name for f in tmp_path.rglob("*") if f.is_file()] == ["bad.toml"]


def test_a_missing_case_is_status_2(tmp_path):
    done = command("couple", tmp_path / "none.toml", exits=2)
    assert "none.toml: cannot be read: No such file or directory" in " ".join(done.stderr.split())


def test_a_file_of_the_wrong_kind_is_named_as_what_it_is(tmp_path):
    from coupling.files.robot_file import RobotFileError, load_robot, shipped_robots

    (tmp_path / "case.toml").write_text(LINE.read_text())
    (tmp_path / "robot.urdf").write_text("<robot/>")
    with pytest.raises(CaseError, match="expected a case, got a robot file"):
        load_case(shipped_robots()["icme2008"])
    with pytest.raises(CaseError, match=r"got a folder: give the case\.toml in it"):
        load_case(tmp_path)
    with pytest.raises(RobotFileError, match="expected a robot file, got a case"):
        load_robot(tmp_path / "case.toml")
    with pytest.raises(RobotFileError, match=r"elastic-robot init cell --robot \S+robot\.urdf"):
        load_robot(tmp_path / "robot.urdf")


def test_a_broken_robot_in_a_case_names_both_files(tmp_path):
    from coupling.files.robot_file import shipped_robots

    robot = shipped_robots()["icme2008"].read_text().replace("mass      = 700.0", "mass = -1.0")
    (tmp_path / "my.toml").write_text(robot)
    (tmp_path / "case.toml").write_text(changed('"icme2008"', '"my.toml"'))
    done = command("couple", tmp_path / "case.toml", exits=2)
    assert "case.toml: robot: description:" in done.stderr
    assert "joint 1: mass: expected a finite number >= 0 [kg], got -1.0" in " ".join(
        done.stderr.split()
    )


def test_joint_limits_are_errors_and_rates_are_warnings(tmp_path):
    from coupling.files.robot_file import shipped_robots

    text = shipped_robots()["icme2008"].read_text()
    first = "origin    = [0.0, 0.0, 0.0]"
    (tmp_path / "slow.toml").write_text(text.replace(first, first + "\nmax_rate = 0.001", 1))
    (tmp_path / "short.toml").write_text(text.replace(first, first + "\nlimits = [-1.0, 0.0]", 1))
    for robot in ("slow", "short"):
        (tmp_path / f"{robot}_case.toml").write_text(changed('"icme2008"', f'"{robot}.toml"'))
    slow = command("couple", tmp_path / "slow_case.toml", "-o", tmp_path / "out", exits=0)
    assert "Warning: joint 1 moves at" in slow.stdout
    assert "its maximum rate is 0.001 rad/s" in " ".join(slow.stdout.split())
    short = command("couple", tmp_path / "short_case.toml", "-o", tmp_path / "out2", exits=2)
    assert "its limits are -57.30 to 0.00 deg" in " ".join(short.stderr.split())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "position_m =",
            "position_mm =",
            "did you mean 'position_m'? Convert the value to its unit",
        ),
        ("feed_m_s = 0.1", "feed_mm_min = 6000.0", "'feed_m_s'? Convert the value to its unit"),
        ("feed_m_s = 0.1", "feed = 0.1", "got unknown key 'feed'"),
        ("feed_m_s = 0.1", 'feed_m_s = "0.1 m/s"', "write it without quotation marks and unit"),
        ('"line"', '"C:\\parts"', "Unescaped '\\' in a string (at line"),
    ],
)
def test_units_and_paths_of_newcomers_are_told_what_to_write(tmp_path, old, new, said):
    case = tmp_path / "bad.toml"
    case.write_text(changed(old, new))
    with pytest.raises(CaseError) as caught:
        load_case(case)
    assert said in str(caught.value)
    assert ("Convert" in str(caught.value)) == ("Convert" in said)


def _case(folder: Path, *changes: tuple[str, str]) -> Path:
    file, text = folder / "case.toml", LINE_CASE.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.skipif(os.name != "posix", reason="needs a POSIX shell")
@pytest.mark.parametrize(
    ("streams", "status"),
    [(">&-", 0), ("2>&-", 0), ("<&- >&- 2>&-", 0), (">/dev/full", 2), ("2>/dev/full", 0)],
)
def test_a_command_outlasts_its_streams(streams, status):
    words = ["/bin/sh", "-c", f'"$@" {streams}', "sh", *_PROGRAM, "robots"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == status
    assert "Traceback" not in done.stderr
    full = "error: standard output: cannot be written: No space left on device"
    assert done.stderr.startswith(full) if status else not done.stderr


def test_a_name_that_ascii_lacks_is_written_out(tmp_path):
    words = [*_PROGRAM, "check", tmp_path / "Kegel_\u00e4.toml"]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    done = subprocess.run(words, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 2
    assert "Kegel_\\xe4.toml: cannot be read" in done.stderr


@pytest.mark.skipif(os.name != "posix", reason="Windows keeps folders that are worked in")
def test_a_working_folder_that_is_gone_is_named(tmp_path):
    words = ["/bin/sh", "-c", 'cd "$0" && rmdir "$0" && exec "$@"', tmp_path, *_PROGRAM]
    done = subprocess.run([*words, "init", "new"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (f"[x]\ny = {'[' * 5000}{']' * 5000}\n", "levels deep, got hundreds"),
        (f"x = 0x{'f' * 9000}\n", "integers of at most 64 bits"),
        ("x = '\x1b[2J'\n", "is not valid TOML"),
        (f"[robot]\n{'k' * 10_000_000} = 1\n", "characters ...]"),
    ],
)
def test_an_absurd_case_is_refused_in_a_short_sentence(tmp_path, content, words):
    file = tmp_path / "case.toml"
    file.write_text(content, encoding="utf-8")
    done = command("check", file, exits=2)
    assert words in done.stderr
    assert len(done.stderr) < 20_000
    assert "\x1b" not in done.stderr


def test_a_case_with_a_mark_of_its_encoding_is_read(tmp_path):
    file = tmp_path / "case.toml"
    file.write_bytes(b"\xef\xbb\xbf[robot]\nx = 1\n")
    assert "unknown key 'x'" in command("check", file).stderr


@pytest.mark.parametrize("name", ["a" * 5000, "loop.toml", "a\\u0000b"])
def test_a_path_that_no_file_can_have_is_refused_with_its_key(tmp_path, name):
    (tmp_path / "loop.toml").symlink_to(tmp_path / "loop.toml")
    file = tmp_path / "case.toml"
    for table, key in (("robot", "description"), ("tool_path", "file")):
        text = f'[{table}]\n{key} = "{name}"\n'
        rest = LINE_CASE.read_text(encoding="utf-8").partition("[part]")[2]
        if table == "robot":
            text = f"{text}home_deg = [0, 0, 0, 0, 0, 0]\n[part]{rest}"
        else:
            robot = '[robot]\ndescription = "icme2008"\nhome_deg = [0, 0, 0, 0, 0, 0]\n'
            text = f'{robot}[part]\nposition_m = [1.6, 0, 0.8]\n{text}kind = "csv"\n[process]\n'
        file.write_text(text, encoding="utf-8")
        done = command("check", file, exits=2)
        assert f"{table}: {key}: expected" in done.stderr


def test_a_fault_of_the_program_asks_for_a_report_and_debug_shows_where(monkeypatch):
    def broken() -> None:
        raise ZeroDivisionError("float division by zero")

    monkeypatch.setattr("coupling.files.robot_file.shipped_robots", broken)
    done, shown = command("robots"), command("robots", "--debug")
    assert done.returncode == shown.returncode == 2
    assert "error: a fault of this program (ZeroDivisionError" in done.stderr
    assert "--debug" in done.stderr
    assert "Traceback" not in done.stderr
    assert "Traceback (most recent call last)" in shown.stderr


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError(), "expected more memory"),
        (RecursionError("maximum recursion depth exceeded"), "nested less deeply"),
        (OSError(36, "File name too long", "abc"), "abc: File name too long"),
        (UnicodeEncodeError("ascii", "\u00e4", 0, 1, "ordinal not in range"), "PYTHONUTF8=1"),
        (OverflowError("math range error"), "a fault of this program (OverflowError"),
        (CaseError("x: expected 1, got 2"), "x: expected 1, got 2"),
    ],
)
def test_every_kind_of_exception_is_one_sentence(error, words):
    assert words in describe_failure(error)
    assert "\n" not in describe_failure(error)


def test_nothing_that_is_printed_steers_the_terminal():
    with console.capture() as said:
        console.print("process: \x1b]0;title\x1b[2J\x9b31m \u202egnp.exe done")
    assert said.get() == "process: \\x1b]0;title\\x1b[2J\\x9b31m \\u202egnp.exe done\n"


def test_an_error_shortens_what_it_quotes_and_keeps_its_remedy():
    words = str(CaseError(f"case.toml: name: expected a word, got '{'a' * 10**7}': shorten it"))
    assert len(words) < 1000
    assert words.startswith("case.toml: name: expected a word")
    assert words.endswith("': shorten it")
    assert len(str(CaseError("\n".join(["one problem"] * 10**5)))) < 3000


def test_a_stream_that_a_plugin_has_closed_loses_what_is_written():
    closed = io.StringIO()
    closed.close()
    stream = LastingStream(closed)
    assert stream.write("text") == 4
    assert "closed" in str(stream.failure)
