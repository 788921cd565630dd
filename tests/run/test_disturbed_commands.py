"""Commands under another user, a full disk and a clock that jumps, killed, and eight of them at once."""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from killed_commands import KilledCommand, commands, deflections, placing
from killing import files_of, start, wait_until
from places import LINE_CASE

from coupling.errors import ResultError
from coupling.files.atomic_folder import exclusively
from coupling.files.written_files import begin_folder

_NOBODY = 65534
# A user who may read all, the interpreter among it, and write nothing of others.
_AS_NOBODY = (
    "setpriv",
    f"--reuid={_NOBODY}",
    f"--regid={_NOBODY}",
    "--clear-groups",
    *(f"--{kind}=-all,+dac_read_search" for kind in ("inh-caps", "ambient-caps", "bounding-set")),
)


def _said(*words: object, before: tuple[str, ...] = (), **options) -> tuple[int, str]:
    """Run a command in a process of its own; return its status and what it says."""
    typed = [*before, sys.executable, "-m", "coupling.cli", *map(str, words)]
    done = subprocess.run(typed, capture_output=True, text=True, check=False, **options)
    return done.returncode, done.stderr


def _as_nobody(*words: object, umask: int = 0o022) -> tuple[int, str]:
    """Run a command as another user, who has no home folder."""
    if os.name != "posix" or os.geteuid() != 0 or not shutil.which("setpriv"):
        pytest.skip("needs root and setpriv, to be another user")
    environment = {key: value for key, value in os.environ.items() if key != "HOME"}
    return _said(
        *words,
        before=_AS_NOBODY,
        env=environment | {"PYTHONDONTWRITEBYTECODE": "1"},
        umask=umask,
        cwd="/",
    )


@pytest.fixture
def shared() -> Iterator[Path]:
    """A folder that everybody may write into and reach, unlike those of pytest."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        folder.chmod(0o777)
        yield folder


def test_a_result_of_another_user_is_refused_before_the_work(shared):
    """In a folder that both may write into it could be renamed, but its files not moved."""
    begin_folder(shared / "run", "run")
    for words in (("compensate", LINE_CASE, "--overwrite"), ("study", LINE_CASE)):
        status, said = _as_nobody(*words, "-o", shared / "run")
        assert status == 2, said
        assert "run: expected a folder that this user may write into, got one of another" in said
        assert "Traceback" not in said
    assert [place.name for place in shared.iterdir()] == ["run"]


def test_a_folder_that_is_read_only_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda place, mode: False)
    with (
        pytest.raises(ResultError, match="this user may write into"),
        exclusively(tmp_path, ResultError),
    ):
        pass


def test_without_home_and_rights_for_others_a_user_has_a_result_or_a_sentence(shared):
    plan = "identify", "--plan", "--count", "6"
    status, said = _as_nobody(*plan, "-o", shared / "plan.csv", umask=0o077)
    assert status == 0, said
    assert {file.stat().st_mode & 0o777 for file in shared.iterdir()} == {0o600}
    shared.chmod(0o755)
    before = (shared / "plan.csv").read_bytes()
    for words in (
        (*plan, "-o", shared / "other.csv"),
        ("place", LINE_CASE, "-o", shared / "placed"),
    ):
        status, said = _as_nobody(*words)
        assert status == 2, said
        assert said.startswith("error: ") or "\nerror: " in said
        assert "cannot be" in said
        assert "Traceback" not in said
    assert sorted(place.name for place in shared.iterdir()) == ["plan.csv", "plan.html"]
    assert (shared / "plan.csv").read_bytes() == before


def test_a_full_disk_is_a_sentence_and_costs_nothing_of_the_user_s(small_disk, tmp_path):
    measured = deflections(tmp_path)
    theirs = small_disk / "robot.toml"
    theirs.write_text("mine")
    with suppress(OSError), (small_disk / "filling").open("wb", buffering=0) as filling:
        while True:
            filling.write(bytes(4096))
    placed = "place", placing(tmp_path), "-o", small_disk / "placed"
    identified = "identify", measured, "-o", small_disk / "new.toml", "--torque-curve", "linear"
    for words in (identified, placed):
        output = tmp_path / f"{words[0]}.txt"
        assert start(output, *words).status() == 2, output.read_text()
        said = output.read_text()
        assert "No space left" in said
        assert "fault of this program" not in said
    assert theirs.read_text() == "mine"


def test_a_clock_that_jumps_back_between_kill_and_resumption_changes_nothing(tmp_path):
    if not shutil.which("faketime"):
        pytest.skip("needs faketime")
    words = "couple", LINE_CASE, "--no-store"
    undisturbed, disturbed = tmp_path / "undisturbed", tmp_path / "disturbed"
    assert start(tmp_path / "said.txt", *words, "-o", undisturbed).status() == 0
    typed = [sys.executable, "-m", "coupling.cli", *map(str, words), "-o", str(disturbed)]
    killed = subprocess.Popen(["faketime", "-f", "+400d", *typed], start_new_session=True)
    unfinished = tmp_path / "disturbed.unfinished"
    wait_until((unfinished / "run.json").is_file)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    for file in unfinished.iterdir():
        os.utime(file, 2 * (time.time() + 3e7,))
    back = ["faketime", "-f", "-400d", *typed]
    done = subprocess.run(back, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert files_of(disturbed) == files_of(undisturbed)


def test_of_eight_at_once_in_a_folder_one_works_and_the_others_say_so(tmp_path):
    case, folder = placing(tmp_path), tmp_path / "placed"
    runs = [
        start(tmp_path / f"{k}.txt", "place", case, "-o", folder, "--no-store") for k in range(8)
    ]
    assert Counter(run.status() for run in runs) == {0: 1, 2: 7}
    for run in runs:
        said = run.output.read_text()
        assert run.status() == 0 or "writes it" in said or "holds a result already" in said, said
    assert {place.name for place in tmp_path.iterdir() if place.is_dir()} == {"placed"}


def test_eight_at_once_to_a_file_and_to_others_say_the_same(tmp_path):
    measured = deflections(tmp_path)
    runs = []
    for k in range(8):
        place = tmp_path / (f"{k}/robot.toml" if k % 2 else "robot.toml")
        words = "identify", measured, "-o", place, "--torque-curve", "linear"
        runs.append(start(tmp_path / f"{k}.txt", *words))
    assert [run.status() for run in runs] == [0] * 8, runs[0].output.read_text()
    texts = [file.read_bytes() for file in tmp_path.rglob("robot.toml")]
    assert len(texts) == 5
    assert len(set(texts)) == 1
    assert not list(tmp_path.rglob("*.partial"))


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    folder = tmp_path_factory.mktemp("killed")
    return folder, commands(folder)


@pytest.mark.parametrize("name", ["identify", "place", "next", "learn"])
def test_a_command_survives_a_round_of_kills(known, name):
    """A hundred rounds: `python tests/helpers/killed_commands.py 25`."""
    folder, words = known
    command = KilledCommand.of(words[name], folder / f"{name}_undisturbed")
    command.round(folder / name, random.Random(3))
