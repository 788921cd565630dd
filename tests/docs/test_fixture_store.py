"""What tests store of what is costly, and which tests a change asks for."""

from __future__ import annotations

import subprocess
from concurrent.futures import ThreadPoolExecutor

import changed
import fixture_store
import module_sources
import pytest
from fixture_store import key_of, stored
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


def test_several_at_once_make_it_once_and_other_inputs_another():
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda _: stored(square, 3), range(8))) == [9] * 8
    assert stored(square, number=3) == 9
    assert stored(square, 4) == 16
    assert MADE == [3, 3, 4]


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


def test_bytecode_that_another_process_is_writing_makes_no_other_entry(tmp_path):
    """CPython writes m.cpython-311.pyc.140235 and renames it."""
    (tmp_path / "m.c").touch()
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__" / "m.cpython-311.pyc.140235").touch()
    assert module_sources._all_of(str(tmp_path)) == {tmp_path / "m.c"}


@pytest.mark.parametrize("name", ["coupling/report/document.py", "coupling/cli/main.py"])
def test_what_it_does_not_depend_on_may_change(name):
    assert (ROOT / name).is_file()
    assert ROOT / name not in sources_of(CIRCLING)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("coupling/run/robustness", "tests/run/test_robustness.py"),  # imported
        ("coupling/run_to_folder", "tests/results/test_outlook.py"),  # by what is imported
        ("coupling/errors", "coupling/errors.py"),  # has examples
        ("tests/helpers/killing", "tests/run/test_run_log.py"),
        ("tests/docs/test_fixture_store", "tests/docs/test_fixture_store.py"),
        ("fmu_src/native/core/elements/gear.c", "tests/native/test_core.py"),
        ("docs/place.md", "tests/docs/test_pages.py"),
        ("recipe/recipe.yaml", "tests/docs/test_release.py"),  # named
        (".ci/changed", "tests/docs/test_fixture_store.py"),
    ],
)
def test_a_change_is_tested_where_it_is_used(name, expected):
    """Modules stand without their ending here, so that this file does not name them."""
    found = changed.tests_of(name if (changed.ROOT / name).is_file() else f"{name}.py")
    assert expected in found
    assert all((changed.ROOT / file).exists() for file in found)


def test_what_a_branch_changes_counts_committed_or_not(tmp_path, monkeypatch):
    def git(*arguments: str) -> None:
        who = ("-c", "user.name=a", "-c", "user.email=a@b")
        subprocess.run(["git", *who, *arguments], cwd=tmp_path, check=True, capture_output=True)

    monkeypatch.setattr(changed, "ROOT", tmp_path)
    git("init", "-b", "main")
    for name in ("old", "committed", "edited", "gone"):
        (tmp_path / name).write_text("1")
    git("add", ".")
    git("commit", "-m", "a")
    assert changed.changed_files() == []
    git("checkout", "-b", "own")
    (tmp_path / "committed").write_text("2")
    git("commit", "-am", "b")
    (tmp_path / "edited").write_text("2")
    (tmp_path / "gone").unlink()
    (tmp_path / "new").write_text("1")
    assert changed.changed_files() == ["committed", "edited", "new"]
