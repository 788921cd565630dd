"""The folder of programs is whole at every moment: kills, full disks, two exports at once."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from killing import begin, die_while_exporting, one_program

from coupling.errors import ProgramError
from coupling.export.folder import EXPORT_FOLDER, write_export
from coupling.files import atomic_folder
from coupling.files.atomic_folder import require_free

# Where an export is killed, and whose programs are found afterwards.
STAGES = {"written": "old", "complete": "old", "put aside": "old", "in place": "new"}


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
