"""The folder of a study: what belongs to it, and what is left alone."""

from __future__ import annotations

from coupling.files.written_files import LIST, begin_folder, claim_file
from coupling.study.folder import lock_folder


def test_what_a_killed_command_has_left_beside_its_run_is_the_study_s(tmp_path):
    """And goes with it; what anybody else has put there stays."""
    place, theirs = tmp_path / "study", {"run.sh", "run.log", "run.old", "rows.jsonl.kept"}
    with lock_folder(place, overwrite=False):
        for name in ("run", "run.unfinished", ".run.replaced"):
            begin_folder(place / name, "run")
            claim_file(place / name / "run.json").write_text("{}")
        for name in (".run.lock", "study.toml", f"study.json.{'0f' * 16}.partial"):
            (place / name).write_text("")
        for name in theirs - {"run.old"}:
            (place / name).write_text("mine")
        (place / "run.old").mkdir()
        (place / "run" / "notes.txt").write_text("mine")
    with lock_folder(place, overwrite=True):
        assert {file.name for file in place.iterdir()} == theirs | {"run", LIST}
        assert {file.name for file in (place / "run").iterdir()} == {"notes.txt", LIST}
