"""What a command has written goes, what anybody else has put into its folder stays."""

import json
import os
from pathlib import Path

import pytest

from coupling.files.atomic_folder import finish_replacement, replace_folder, replaced_name
from coupling.files.output_file import require_output
from coupling.files.written_files import (
    LIST,
    WHOLE,
    begin_folder,
    claim,
    claim_file,
    claimed_folder,
    is_free,
    remove_written,
)


def made(folder: Path) -> Path:
    """Make a folder of a command: two files, a folder with one, a whole folder."""
    begin_folder(folder, "run")
    for name in ("wrench.csv", "result.json"):
        claim_file(folder / name).write_text("ours")
    claim_file(claimed_folder(folder / "forming") / "desired.csv").write_text("ours")
    claim(folder, [f"evaluations{WHOLE}"])
    (folder / "evaluations" / "0001").mkdir(parents=True)
    (folder / "evaluations" / "0001" / "restart.bin").write_text("the program's")
    return folder


def files(folder: Path) -> set[str]:
    found = (f for f in folder.rglob("*") if (f.is_symlink() or f.is_file()) and f.name != LIST)
    return {str(file.relative_to(folder)) for file in found}


def put(folder: Path) -> set[str]:
    """Put into a command's folder what a user may have there; return the names."""
    (folder / "measured.csv").write_text("mine")
    (folder / "krl").mkdir()
    (folder / "krl" / "cone.src").write_text("mine")
    (folder / "forming" / "notes.txt").write_text("mine")
    (folder / "disk").symlink_to(folder.parent)
    (folder / "broken").symlink_to("nowhere")
    (folder / "run.json.partial").write_text("mine")
    return {
        "measured.csv",
        "krl/cone.src",
        "forming/notes.txt",
        "disk",
        "broken",
        "run.json.partial",
    }


def test_a_folder_of_which_all_is_the_command_s_goes_as_a_whole(tmp_path):
    remove_written(made(tmp_path / "run"))
    assert list(tmp_path.iterdir()) == []


def test_what_is_the_user_s_stays(tmp_path):
    theirs = put(made(tmp_path / "run"))
    remove_written(tmp_path / "run")
    assert files(tmp_path / "run") == theirs


def test_what_is_the_user_s_comes_into_the_folder_that_replaces_it(tmp_path):
    theirs = put(made(tmp_path / "run"))
    new = made(tmp_path / "new")
    ours = files(new)
    (tmp_path / "run" / "report.html").write_text("mine")
    claim_file(new / "report.html").write_text("ours")
    replace_folder(new, tmp_path / "run")
    assert files(tmp_path / "run") == theirs | ours | {"report.html", "report.html.kept"}
    assert (tmp_path / "run" / "report.html.kept").read_text() == "mine"
    assert [place.name for place in tmp_path.iterdir()] == ["run"]


@pytest.mark.parametrize("moved", [0, 1, 3])
def test_a_hand_over_that_was_killed_is_finished(tmp_path, monkeypatch, moved):
    theirs = put(made(tmp_path / "run"))
    rename, done = os.rename, []

    def dying(old: Path, new: Path) -> None:
        if len(done) == moved + 2:
            raise KeyboardInterrupt
        done.append(rename(old, new))

    with monkeypatch.context() as patched:
        patched.setattr(os, "rename", dying)
        with pytest.raises(KeyboardInterrupt):
            replace_folder(made(tmp_path / "new"), tmp_path / "run")
    finish_replacement(tmp_path / "run")
    assert theirs <= files(tmp_path / "run")
    assert not replaced_name(tmp_path / "run").exists()


def test_a_file_of_a_name_that_the_command_needs_is_renamed(tmp_path):
    folder = made(tmp_path / "run")
    for number in ("", "1"):
        remove_written(folder, keep=[f"evaluations{WHOLE}"])
        (folder / "wrench.csv").write_text(f"mine{number}")
        claim_file(folder / "wrench.csv").write_text("ours")
        assert (folder / "wrench.csv").read_text() == "ours"
        assert (folder / f"wrench.csv.kept{number}").read_text() == f"mine{number}"


def test_what_is_not_written_through_a_link_of_the_user_s(tmp_path):
    folder = made(tmp_path / "run")
    (tmp_path / "thesis.csv").write_text("mine")
    (folder / "command.csv").symlink_to(tmp_path / "thesis.csv")
    claim_file(folder / "command.csv").write_text("ours")
    remove_written(folder)
    assert (tmp_path / "thesis.csv").read_text() == "mine"


def test_evaluations_that_were_moved_to_another_disk_stay_there(tmp_path):
    folder = made(tmp_path / "run")
    os.rename(folder / "evaluations", tmp_path / "disk")
    (folder / "evaluations").symlink_to(tmp_path / "disk")
    claim(folder, [f"evaluations{WHOLE}"])
    assert (folder / "evaluations").is_symlink()
    remove_written(folder)
    assert (tmp_path / "disk" / "0001" / "restart.bin").exists()


def test_of_a_folder_without_a_list_nothing_is_removed(tmp_path):
    folder = made(tmp_path / "run")
    (folder / LIST).unlink()
    before = files(folder)
    remove_written(folder)
    assert files(folder) == before
    replace_folder(made(tmp_path / "new"), folder)
    assert {"wrench.csv.kept", "wrench.csv"} <= files(folder)


HOSTILE = (
    b"",
    b"[" * 100_000,
    b"\xff\xfe",
    b'{"kind": "run", "written": 7}',
    b'{"kind": "run", "written": [["a"], null, "", ".", "..", "../**", "../thesis.txt", "/", "/**"]}',
)


@pytest.mark.parametrize("content", HOSTILE)
def test_a_damaged_or_hostile_list_removes_nothing(tmp_path, content):
    folder = tmp_path / "run"
    folder.mkdir()
    (tmp_path / "thesis.txt").write_text("mine")
    (folder / "notes.txt").write_text("mine")
    (folder / LIST).write_bytes(content)
    remove_written(folder)
    assert (folder / "notes.txt").read_text() == (tmp_path / "thesis.txt").read_text() == "mine"


def test_a_list_names_a_place_outside_by_its_whole_path(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    folder = made(tmp_path / "run")
    names = [str(tmp_path / "thesis.txt"), "a\\..\\b", "forming/../../thesis.txt"]
    (folder / LIST).write_text(json.dumps({"kind": "run", "written": names}))
    remove_written(folder)
    assert (tmp_path / "thesis.txt").exists()


def test_a_command_that_was_killed_at_its_start_leaves_a_free_folder(tmp_path):
    (tmp_path / f"{LIST}.{'0' * 32}.partial").write_text("")
    assert is_free(tmp_path)
    begin_folder(tmp_path, "run")
    assert not is_free(tmp_path)
    (tmp_path / f"run.json.{'a' * 32}.partial").write_text("")
    claim(tmp_path, ["run.json"])
    remove_written(tmp_path)
    assert not tmp_path.exists()


def test_what_a_command_was_killed_writing_goes_as_soon_as_it_is_given_again(tmp_path):
    """Drafts of listed files and of the list; not what a user has named alike."""
    begin_folder(tmp_path, "inputs")
    claim(tmp_path, ["robot.toml"])
    names = [f"{name}.{'0' * 32}.partial" for name in (LIST, "robot.toml", "measured.csv")]
    for name in names:
        (tmp_path / name).write_text("half")
    begin_folder(tmp_path, "inputs")
    assert {file.name for file in tmp_path.iterdir()} == {LIST, names[-1]}


@pytest.mark.parametrize(
    ("content", "is_ours"),
    [
        ("", True),
        ("# Made from robot.toml by elastic-robot learn: m.csv.\n", True),
        ("# Made by elastic-robot init from the example cone.toml.\n", False),
        ("[robot]\n# stiffness by elastic-robot learn\n", False),
        ("PK\x03\x04", False),
    ],
)
def test_a_file_of_somebody_else_is_not_replaced(tmp_path, content, is_ours):
    file = tmp_path / "robot.toml"
    file.write_text(content)
    if is_ours:
        require_output(file, ".toml", ValueError)
    else:
        with pytest.raises(ValueError, match=r"robot\.toml: holds what no elastic-robot command"):
            require_output(file, ".toml", ValueError)
