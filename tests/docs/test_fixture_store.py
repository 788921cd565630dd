"""What tests store of what is costly: made once, and anew where anything differs that it depends on."""

from __future__ import annotations

import json
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fixture_store
import pytest
from fixture_store import key_of, prune, stored, stored_folder
from module_sources import sources_of
from places import HELPERS, ROOT

CIRCLING = HELPERS / "circling_robots.py"
MADE: list[int] = []


@pytest.fixture(autouse=True)
def store(tmp_path, monkeypatch):
    monkeypatch.setattr(fixture_store, "STORE", tmp_path / "store")
    MADE.clear()
    return tmp_path / "store"


def square(number: int) -> int:
    MADE.append(number)
    return number**2


def fill(folder: Path, text: str) -> None:
    (folder / "text.txt").write_text(text)
    assert text, "nothing to write"


def test_several_at_once_make_it_once_and_other_inputs_another():
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda _: stored(square, 3), range(8))) == [9] * 8
    assert stored(square, number=3) == 9
    assert stored(square, 4) == 16
    assert MADE == [3, 3, 4]


def test_a_folder_is_there_whole_or_not_at_all(store):
    with pytest.raises(AssertionError, match="nothing to write"):
        stored_folder(fill, "")
    assert [entry for entry in store.iterdir() if entry.is_dir()] == []
    assert (stored_folder(fill, "a") / "text.txt").read_text() == "a"


@pytest.mark.parametrize(
    "name",
    [
        "tests/helpers/circling_robots.py",
        "tests/helpers/tuned_fmu.py",
        "coupling/identification/runs/fit.py",
        "coupling/inverse/links.py",
        "coupling/fmu/worker_main.py",  # started by its name
        "coupling/native/desk/link_path.c",
        "fmu_src/native/core/chain/chain.c",
        "fmu_src/elastic_robot/description.py",
    ],
)
def test_a_changed_source_makes_another_entry(monkeypatch, name):
    """Of the fits to runs on circles: Python that is imported, C that is compiled."""
    from circling_robots import _fit

    assert (ROOT / name).is_file()
    before = key_of(_fit, ())
    content = fixture_store._content
    monkeypatch.setattr(
        fixture_store, "_content", lambda file: b"changed" if file == ROOT / name else content(file)
    )
    assert key_of(_fit, ()) != before


@pytest.mark.parametrize("name", ["coupling/report/document.py", "coupling/cli/main.py"])
def test_what_it_does_not_depend_on_may_change(name):
    assert (ROOT / name).is_file()
    assert ROOT / name not in sources_of(CIRCLING)


def test_all_that_is_loaded_while_it_is_made_is_among_its_sources(forked, tmp_path):
    """A robot's FMU is built, inverted and simulated in a process that has loaded nothing before."""
    script = tmp_path / "made.py"
    script.write_text(
        f"""
import json, sys
sys.path[:0] = {[str(ROOT / place) for place in ("tests/helpers", "fmu_src", "")]!r}
from circling_robots import Robots
from coupling.files.robot_file import find_robot, load_robot
from coupling.run.fmu_pool import FmuPool
with FmuPool("native") as models:
    robots = Robots(load_robot(find_robot("icme2008")), models, seconds=1.0)
    robots.moved(robots.none)
print(json.dumps([module.__file__ for name, module in list(sys.modules.items())
                  if name != "__main__" and getattr(module, "__file__", None)]))
"""
    )
    done = forked(script)
    assert done.returncode == 0, done.stderr
    ours = {
        file
        for file in map(Path, json.loads(done.stdout))
        if file.is_relative_to(ROOT) and ".venv" not in file.parts
    }
    assert len(ours) > 100
    assert ours - sources_of(CIRCLING) == set()


def test_what_was_not_used_for_longest_goes_first(store):
    for age, text in enumerate(("new", "old", "older")):
        entry = stored_folder(fill, 1000 * text[-1])
        (entry / "name").write_text(text)
        os.utime(entry, (10**9 - age, 10**9 - age))
    prune(store, largest=2100)
    assert sorted(file.read_text() for file in store.glob("*/name")) == ["new", "old"]
