"""The folder of a study, and what becomes of a robot that ends its process."""

from __future__ import annotations

from contextlib import nullcontext

import pytest

from coupling.errors import HostError, StudyError
from coupling.files.written_files import LIST, begin_folder, claim_file
from coupling.study import robot_pool
from coupling.study.folder import lock_folder
from coupling.study.robot_pool import RETRIES, simulate_here


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


@pytest.mark.parametrize("ends", [RETRIES, RETRIES + 1])
def test_a_robot_that_ends_its_process_is_tried_three_times_more(monkeypatch, ends):
    """Each sample anew: what is said where it ends once more is a sentence."""
    tried = []

    class Ending:
        def sample(self, number, values):
            tried.append(number)
            if tried.count(number) <= ends:
                raise HostError("the process that runs the FMU has ended")
            return number, values

    monkeypatch.setattr(robot_pool, "RobotPool", lambda work: nullcontext(Ending()))
    points = {0: [1.0], 7: [2.0]}
    if ends > RETRIES:
        with pytest.raises(StudyError, match=r"ended its process in 4 tries of one sample"):
            list(simulate_here(None, points))
        assert tried == [0] * 4
    else:
        assert list(simulate_here(None, points)) == [(0, [1.0]), (7, [2.0])]
        assert tried == [0] * 4 + [7] * 4
