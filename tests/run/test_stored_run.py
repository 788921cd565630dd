"""Run folders read back: what is damaged is refused with its file."""

from __future__ import annotations

import json
import re
from shutil import copytree

import pytest
from command_line import command
from places import LINE_CASE

from coupling.errors import ResultError
from coupling.results.run_result import GapResult
from coupling.run.stored_run import read_run


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stored") / "out"
    done = command("compensate", "-v", LINE_CASE, "-o", folder, "--no-store")
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.parametrize(
    "name", ["desired", "uncompensated", "achieved", "correction", "wrench", "command"]
)
def test_a_table_that_is_cut_between_two_rows_is_refused_with_its_file(finished, tmp_path, name):
    """As by a disk that was full: what is left is a table of numbers."""
    folder = tmp_path / "cut"
    copytree(finished, folder)
    read_run(folder)
    file = folder / f"{name}.csv"
    rows = file.read_text().splitlines(keepends=True)
    file.write_text("".join(rows[: len(rows) // 2]))
    named = r"\w+" if name == "desired" else name
    with pytest.raises(ResultError, match=rf"{re.escape(str(folder))}/{named}\.csv: .* cut short"):
        read_run(folder)


def test_a_table_that_lacks_rows_within_is_refused_with_their_number(finished, tmp_path):
    folder = tmp_path / "gap"
    copytree(finished, folder)
    file = folder / "achieved.csv"
    rows = file.read_text().splitlines(keepends=True)
    file.write_text("".join(rows[:5] + rows[7:]))
    said = rf"achieved\.csv: expected {len(rows) - 1} rows as in desired\.csv, got {len(rows) - 3}"
    with pytest.raises(ResultError, match=said):
        read_run(folder)


def test_what_a_user_has_put_into_a_run_folder_is_no_part_of_the_run(finished, tmp_path):
    """A folder and a table of names like those of a cell's robots and of the other mode's path."""
    cell = tmp_path / "cell"
    copytree(finished, cell)
    for name in ("forming", "support", "copy of forming"):
        copytree(finished, cell / name)
        (cell / name / "achieved_mine.csv").write_text("not a path")
    figures = json.loads((cell / "result.json").read_text())
    gap = dict.fromkeys(GapResult.model_fields, 1e-3)
    (cell / "result.json").write_text(json.dumps({**figures, "pinch_gap_m": gap}))
    (cell / "gap.csv").write_text("time,before,after\n0,0.001,0.001\n1,0.001,0.001\n")
    assert list(read_run(cell).robots) == ["forming", "support"]
