"""Temporary folders: those of killed processes go, those in use stay."""

import os
import tempfile
import time

import pytest
from killing import begin, hold_a_scratch_folder, nothing, wait_until

from coupling.files.scratch import ScratchFolder, remove_abandoned


@pytest.fixture
def place(tmp_path, monkeypatch):
    begin(nothing).join()  # has a temporary folder of its own, elsewhere
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def age(place) -> None:
    for file in place.rglob(".owned"):
        os.utime(file, (time.time() - 3600.0,) * 2)


def test_a_folder_goes_with_its_end(place):
    with ScratchFolder() as folder:
        (folder / "robot.fmu").write_text("")
        assert list(place.iterdir()) == [folder]
    assert list(place.iterdir()) == []
    left = ScratchFolder()
    del left
    assert list(place.iterdir()) == []


def test_the_folder_of_a_killed_process_is_removed_by_the_next(place):
    process = begin(hold_a_scratch_folder, place)
    wait_until(lambda: list(place.glob("*/robot.fmu")))
    age(place)
    remove_abandoned()
    assert len(list(place.iterdir())) == 1  # in use
    process.kill()
    process.join()
    age(place)
    (place / "elastic_robot_of_others").mkdir()  # never locked: nobody knows whose it is
    remove_abandoned()
    assert [f.name for f in place.iterdir()] == ["elastic_robot_of_others"]


def test_a_young_folder_is_left_as_its_lock_may_be_to_come(place):
    (place / "elastic_robot_new").mkdir()
    (place / "elastic_robot_new" / ".owned").write_text("")
    remove_abandoned()
    assert len(list(place.iterdir())) == 1
    age(place)
    remove_abandoned()
    assert list(place.iterdir()) == []
