"""Nothing of the user's is lost in a run's folder, and nothing that a failed process has computed."""

import json
import tomllib
from pathlib import Path

import pytest
import tomlkit
from command_line import command
from killing import files_of
from places import LINE_CASE

from coupling.files.written_files import LIST

# A wall, and a checkpoint of every path; the second path of all fails while a file says so.
PROGRAM = """
import csv, pathlib, sys
here, kept = pathlib.Path(__file__).parent, pathlib.Path(sys.argv[1])
(kept / "steps").open("a").write("x")
with (here / "log.txt").open("a") as log:
    log.write(f"{len((kept / 'steps').read_text())}\\n")
if (here / "fails").exists() and len((here / "log.txt").read_text().split()) > 1:
    sys.exit("licence lost")
rows = list(csv.DictReader(open("path.csv")))
with open("wrench.csv", "w") as answer:
    answer.write("time,fx,fy,fz,mx,my,mz\\n")
    for row in rows:
        answer.write(f"{row['time']},0,0,{2e5 * max(-float(row['z']), 0.0)!r},0,0,0\\n")
"""


def case_in(folder: Path) -> Path:
    """Write the line with a program that has checkpoints; return its file."""
    (folder / "program.py").write_text(PROGRAM)
    data = tomllib.loads(LINE_CASE.read_text())
    data["process"] = {
        "model": "external",
        "command": ["{python}", "-S", "{case}/program.py", "{restart}"],
        "time_limit_s": 60.0,
    }
    file = folder / "line.toml"
    file.write_text(tomlkit.dumps(data))
    return file


def put(folder: Path) -> set[str]:
    """Put into a run folder what a user may have there; return the names."""
    for name in ("measured.csv", "notes.txt", "krl/cone.src", "wrench.csv.bak"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("mine")
    return {"measured.csv", "notes.txt", "krl/cone.src", "wrench.csv.bak"}


def kept(folder: Path) -> set[str]:
    found = (file for file in folder.rglob("*") if file.is_file() and file.name != LIST)
    return {str(f.relative_to(folder)) for f in found if f.read_bytes() == b"mine"}


@pytest.fixture(scope="module")
def failed(tmp_path_factory):
    """A run of compensate whose program fails in its second evaluation, and one that does not."""
    folder = tmp_path_factory.mktemp("failed")
    case = case_in(folder)
    command("compensate", "-v", case, "-o", folder / "whole", "--no-store", exits=0)
    (folder / "log.txt").unlink()
    (folder / "fails").write_text("")
    done = command("compensate", "-v", case, "-o", folder / "run")
    assert (done.returncode, "licence lost" in done.stdout) == (1, True)
    return folder, case


def test_a_program_that_failed_later_goes_on_by_the_same_command_with_its_restart_files(failed):
    folder, case = failed
    run = folder / "run"
    assert json.loads((run / "result.json").read_text())["outcome"] == "process failed"
    theirs = put(run)
    again = command("compensate", "-v", case, "-o", run)  # the licence is still lost
    assert "licence lost" in again.stdout
    (folder / "fails").unlink()
    command("compensate", "-v", case, "-o", run, exits=0)
    steps = [int(line) for line in (folder / "log.txt").read_text().split()]
    # Of every path, as the correction tries two of them.
    assert steps[:6] == [1, 1, 1, 2, 2, 3]
    assert kept(run) == theirs
    found = {name: text for name, text in files_of(run).items() if text != b"mine"}
    assert found == files_of(folder / "whole")
    assert [f.name for f in folder.glob("*.unfinished")] == []
    done = command("compensate", "-v", case, "-o", run, exits=2)
    assert "holds a result already" in done.stderr


def test_another_command_does_not_replace_a_result_whose_process_has_failed(failed, tmp_path):
    folder, _ = failed
    case = case_in(tmp_path)
    (tmp_path / "fails").write_text("")
    command("compensate", "-v", case, "-o", tmp_path / "run", "--no-store")
    for words in (("couple", case), ("compensate", folder / "line.toml")):
        done = command(*words, "-o", tmp_path / "run", "--no-store", exits=2)
        assert "add --overwrite" in done.stderr


def test_what_a_user_has_put_into_a_run_folder_outlives_it(failed, tmp_path):
    """Beside a result, in one that is replaced, and in one whose run has failed."""
    run = tmp_path / "run"
    command("couple", "-v", LINE_CASE, "-o", run, "--no-store", exits=0)
    theirs = put(run)
    (run / "desired.csv").rename(run / "desired_of_mine.csv")
    assert (
        command("couple", "-v", LINE_CASE, "-o", run, "--no-store", "--overwrite").returncode == 0
    )
    assert kept(run) == theirs
    assert {"desired.csv", "desired_of_mine.csv"} <= {file.name for file in run.iterdir()}
    case = case_in(tmp_path)
    failing = tmp_path / "failing"
    (tmp_path / "fails").write_text("")
    (tmp_path / "log.txt").write_text("1\n")
    command("couple", "-v", case, "-o", failing, "--no-store", exits=2)
    unfinished = tmp_path / "failing.unfinished"
    theirs = put(unfinished) | {"result.json"}
    (unfinished / "result.json").write_text("mine")
    command("couple", "-v", case, "-o", failing, "--no-store", exits=2)
    assert kept(unfinished) == theirs
    (tmp_path / "fails").unlink()
    command("couple", "-v", case, "-o", failing, "--no-store", exits=0)
    assert kept(failing) == theirs - {"result.json"} | {"result.json.kept"}


def test_programs_of_a_command_that_is_replaced_are_named_with_what_renews_them(tmp_path):
    run = tmp_path / "run"
    first = command("couple", "-v", LINE_CASE, "-o", run, "--no-store")
    (run / "krl").mkdir()
    (run / "krl" / "export.json").write_text("{}")
    (run / "rapid").mkdir()  # of the user
    done = command("couple", "-v", LINE_CASE, "-o", run, "--no-store", "--overwrite")
    assert "earlier command" not in first.stdout
    (line,) = [line for line in done.stdout.splitlines() if "earlier command" in line]
    assert line == (
        f"Warning: the programs in {run / 'krl'} are of an earlier command: elastic-robot export"
        f" {run} --to krl --overwrite"
    )


@pytest.mark.parametrize("left", ["list", "run.json", "both", "run.json alone"])
def test_a_run_that_was_killed_at_its_start_is_begun_by_the_same_command(tmp_path, left):
    run = tmp_path / "run.unfinished"
    run.mkdir()
    draft = f".{'0123456789abcdef' * 2}.partial"
    if left == "run.json alone":
        (run / f"run.json{draft}").write_text("{")
    if left in ("list", "both"):
        (run / f"{LIST}{draft}").write_text("{")
    if left in ("run.json", "both"):
        (run / LIST).write_text('{"kind": "run", "written": ["run.json"]}')
        (run / f"run.json{draft}").write_text("")
    command("couple", "-v", LINE_CASE, "-o", tmp_path / "run", "--no-store", exits=0)
    assert list(tmp_path.rglob("*.partial")) == []


def test_check_keeps_no_evaluation(tmp_path, monkeypatch):
    case = case_in(tmp_path)
    monkeypatch.chdir(tmp_path)
    command("check", "-v", case, "--evaluate", exits=0)
    left = {place.name for place in tmp_path.iterdir()}
    assert left == {"line.toml", "line_check.html", "program.py", "log.txt"}


OUTPUTS = {
    "check": ("check", LINE_CASE),
    "compare": ("compare", "{run}", "{run}"),
    "report": ("report", "{run}"),
    "build": ("build",),
    "ssp": ("ssp", LINE_CASE),
    "plan": ("identify", "--plan"),
}
ENDINGS = {"build": ".fmu", "ssp": ".ssp", "plan": ".csv"}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("done") / "run"
    command("couple", "-v", LINE_CASE, "-o", folder, "--no-store", exits=0)
    return folder


@pytest.mark.parametrize("name", OUTPUTS)
def test_a_command_writes_no_name_of_another_ending_and_no_file_of_the_user_s(tmp_path, run, name):
    words = [str(word).format(run=run) for word in OUTPUTS[name]]
    for file in (tmp_path / "case.toml", tmp_path / f"mine{ENDINGS.get(name, '.html')}"):
        file.write_text("mine")
        done = command(*words, "-o", file, exits=2)
        said = " ".join(done.stderr.split())
        assert "expected a name that ends in" in said or "no elastic-robot command has" in said
        assert file.read_text() == "mine"
