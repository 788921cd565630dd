"""Whatever ends a command is told in a sentence: closed streams, absurd files, our own faults."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import command
from places import LINE_CASE

from coupling.cli.console import console
from coupling.cli.failures import describe_failure
from coupling.cli.streams import LastingStream
from coupling.errors import CaseError

_PROGRAM = [sys.executable, "-m", "coupling.cli"]


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
    done = command("check", file)
    assert done.returncode == 2
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
        done = command("check", file)
        assert done.returncode == 2
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
