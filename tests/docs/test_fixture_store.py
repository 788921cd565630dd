"""What tests store of what is costly: made once, and anew where anything differs that it depends on."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import fixture_store
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


@pytest.mark.parametrize("name", ["coupling/report/document.py", "coupling/cli/main.py"])
def test_what_it_does_not_depend_on_may_change(name):
    assert (ROOT / name).is_file()
    assert ROOT / name not in sources_of(CIRCLING)
