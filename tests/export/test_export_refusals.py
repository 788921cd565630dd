"""elastic-robot export: what is refused or never replaced; a folder that is whole at every moment."""

import json
import os
from pathlib import Path

import pytest
from killing import begin, die_while_exporting, one_program

from coupling.errors import ProgramError
from coupling.export.exported_program import EXPORT_FOLDER, write_export
from coupling.files import atomic_folder
from coupling.files.atomic_folder import require_free
from coupling.files.robot_file import find_robot
from coupling.files.written_files import LIST

# What is typed, and what must be said.
REFUSED = {
    "language": (
        ["--to", "krk"],
        "--to: expected one of krl, rapid, fanuc, csv, got 'krk': did you",
    ),
    "targets": (["--to", "csv", "--targets", "cartesian"], "csv: expected joints, got 'cartesian'"),
    "tolerance": (["--to", "krl", "--tolerance", "-1"], "expected a number > 0 [um], got -1"),
    "not a number": (["--to", "krl", "--tolerance", "nan"], "expected a number > 0 [um], got nan"),
    "cycle": (["--to", "fanuc", "--cycle-ms", "2.5"], "whole multiples of 1 ms, got 2.5 ms"),
    "letters": (["--to", "krl", "--name", "2nd cut"], "expected a letter, then letters, digits"),
    "spacing": (["--to", "csv", "--shortest-ms", "8"], "--shortest-ms: csv: expected none"),
    "long": (["--to", "krl", "--name", "A" * 25], "at most 24 for KRL"),
    "word": (["--to", "krl", "--name", "Spline"], "expected none of KRL's own words, got 'Spline'"),
    "way out": (["--to", "rapid", "--name", "../../x"], "expected a letter, then letters, digits"),
    "task": (["--to", "rapid", "--name", "main"], "expected none of RAPID's own words"),
}
# Where an export is killed, and whose programs are found afterwards.
STAGES = {"written": "old", "complete": "old", "put aside": "old", "in place": "new"}


@pytest.mark.parametrize("name", REFUSED)
def test_a_mistake_is_refused_in_one_sentence_and_nothing_is_written(run, command, name):
    options, message = REFUSED[name]
    before = sorted(run.rglob("*"))
    done = command("export", run, *options, exits=2)
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert sorted(run.rglob("*")) == before


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("limits    = [-0.2, 0.2]", "joint 2: expected angles of -11.46 to 11.46 deg, got"),
        ("max_rate  = 0.001", "joint 2: expected at most 0.001 rad/s, got"),
        ("max_acceleration = 0.01", "joint 2: expected at most 0.01 rad/s^2, got"),
    ],
)
def test_what_the_drives_cannot_do_is_not_written(run, command, tmp_path, key, message):
    """The robot's file has got limits since the run."""
    robot = tmp_path / "robot.toml"
    text = find_robot("icme2008").read_text()
    second = "[[joint]]                  # 2\n"
    robot.write_text(text.replace(second, f"{second}{key}\n"))
    case = run / "case.toml"
    case.write_text(case.read_text().replace('"icme2008"', json.dumps(str(robot))))
    done = command("export", run, "--to", "krl", exits=2)
    assert message in done.stderr
    assert "nothing was written" in done.stderr
    assert not (run / "krl").exists()


def test_programs_are_replaced_only_when_asked_and_nothing_else_ever(run, command, tmp_path):
    place = tmp_path / "p"
    command("export", run, "--to", "krl", "-o", place, exits=0)
    first = (place / "stroke.src").read_bytes()
    again = command("export", run, "--to", "krl", "-o", place, exits=2)
    assert "holds an export already: add --overwrite" in again.stderr
    done = command("export", run, "--to", "rapid", "-o", place, "--overwrite", exits=0)
    assert {file.name for file in place.iterdir()} == {"stroke.mod", "export.json", LIST}
    done = command("export", run, "--to", "krl", "-o", place, "--overwrite", exits=0)
    assert (place / "stroke.src").read_bytes() == first  # byte for byte
    other = tmp_path / "mine"
    other.mkdir()
    (other / "photo.jpg").write_text("x")
    done = command("export", run, "--to", "krl", "-o", other, "--overwrite")
    assert "holds files that are not an export" in done.stderr
    assert [file.name for file in other.iterdir()] == ["photo.jpg"]
    file = tmp_path / "file"
    file.write_text("x")
    done = command("export", run, "--to", "krl", "-o", file)
    assert "expected the name of a folder, got a file" in done.stderr
    done = command("export", run, "--to", "krl", "-o", file / "deeper" / "p")
    assert "file is no folder to write into" in done.stderr
    assert not [name for name in os.listdir(tmp_path) if name.startswith(".")]


def test_a_robot_file_that_has_changed_since_the_run_is_refused(run, command, tmp_path):
    robot = tmp_path / "robot.toml"
    text = find_robot("icme2008").read_text()
    robot.write_text(text.replace("position = [0.30, 0.0, 0.0]", "position = [0.31, 0.0, 0.0]"))
    case = run / "case.toml"
    case.write_text(case.read_text().replace('"icme2008"', json.dumps(str(robot))))
    done = command("export", run, "--to", "krl", exits=2)
    assert "up to 10000 um: the file has changed since the run" in done.stderr


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("kind", "couple", "coupled, not compensated: its command is not corrected"),
        ("converged", False, "the run has not converged"),
    ],
)
def test_a_command_that_is_not_corrected_is_named(run, command, key, value, message):
    figures = json.loads((run / "result.json").read_text())
    (run / "result.json").write_text(json.dumps({**figures, key: value}))
    done = command("export", run, "--to", "csv", exits=0)
    assert "Warning: the run" in done.stdout
    assert message in done.stdout


def test_a_folder_that_is_no_run_is_refused(tmp_path, command):
    done = command("export", tmp_path, "--to", "krl", exits=2)
    assert "name a run folder" in done.stderr
    file = tmp_path / "case.toml"
    file.touch()
    done = command("export", file, "--to", "krl", exits=2)
    assert "case.toml: expected a run folder, or the CSV of a command with --robot" in done.stderr


def put(folder: Path, text: str, overwrite: bool = False) -> None:
    exported, options = one_program(text)
    write_export(folder, [exported], options, overwrite)


@pytest.mark.parametrize("stage", STAGES)
def test_an_export_that_is_killed_leaves_whole_programs_old_or_new(tmp_path, stage):
    """kill -9 before a file is on the disk, before, between and after the two renames."""
    place = tmp_path / "krl"
    put(place, "old")
    child = begin(die_while_exporting, place, stage, "new")
    child.join()
    assert child.exitcode == -9
    # To the next export, the programs are there, and whole.
    with pytest.raises(ProgramError, match="holds an export already"):
        put(place, "other")
    assert (place / "WAY.src").read_text() == STAGES[stage]
    assert json.loads((place / "export.json").read_text())["robots"][0]["program"] == "WAY"
    put(place, "other", overwrite=True)
    assert (place / "WAY.src").read_text() == "other"
    assert [file.name for file in tmp_path.iterdir()] == ["krl"]


def test_a_first_export_that_is_killed_leaves_no_programs(tmp_path):
    for stage in ("written", "complete"):
        child = begin(die_while_exporting, tmp_path / "krl", stage, "new")
        child.join()
        assert child.exitcode == -9
        assert not (tmp_path / "krl").exists()
    put(tmp_path / "krl", "new")
    assert [file.name for file in tmp_path.iterdir()] == ["krl"]


def test_programs_that_were_put_aside_are_still_there_to_be_asked_for(tmp_path):
    """Before the work of an export, so that it does not end in a refusal."""
    put(tmp_path / "krl", "old")
    begin(die_while_exporting, tmp_path / "krl", "put aside", "new").join()
    assert not (tmp_path / "krl").exists()
    with pytest.raises(ProgramError, match="krl: holds an export already"):
        require_free(tmp_path / "krl", EXPORT_FOLDER, overwrite=False)


def test_a_full_disk_leaves_the_programs_that_were_there(small_disk):
    place = small_disk / "krl"
    put(place, "old")
    (small_disk / "other files").write_bytes(b"\0" * 2_000_000)
    with pytest.raises(ProgramError, match=r"krl: cannot be written: No space left on device"):
        put(place, "n" * 2_000_000, overwrite=True)
    assert (place / "WAY.src").read_text() == "old"
    assert {file.name for file in small_disk.iterdir()} == {"krl", "other files"}
    (small_disk / "other files").unlink()
    put(place, "n" * 2_000_000, overwrite=True)
    assert (place / "WAY.src").stat().st_size == 2_000_000


def test_two_exports_at_once_do_not_mix(tmp_path, monkeypatch):
    """The second one comes while the first changes places: it is refused, the first one ends well."""
    replace_folder = atomic_folder.replace_folder

    def meanwhile(draft: Path, target: Path) -> None:
        monkeypatch.setattr(atomic_folder, "replace_folder", replace_folder)
        with pytest.raises(ProgramError, match="krl: another command writes it: wait for its end"):
            put(target, "second")
        replace_folder(draft, target)

    monkeypatch.setattr(atomic_folder, "replace_folder", meanwhile)
    put(tmp_path / "krl", "first")
    assert (tmp_path / "krl" / "WAY.src").read_text() == "first"
    assert [file.name for file in tmp_path.iterdir()] == ["krl"]
