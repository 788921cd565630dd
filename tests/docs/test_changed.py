"""`make check` runs the tests nearest to what changed."""

from __future__ import annotations

import subprocess

import changed
import pytest


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("coupling/run/robustness", "tests/run/test_robustness.py"),  # imported
        ("coupling/run_to_folder", "tests/results/test_outlook.py"),  # by what is imported
        ("coupling/errors", "coupling/errors.py"),  # has examples
        ("tests/helpers/killing", "tests/run/test_run_log.py"),
        ("tests/docs/test_changed", "tests/docs/test_changed.py"),
        ("fmu_src/native/core/elements/gear.c", "tests/native/test_core.py"),
        ("docs/place.md", "tests/docs/test_pages.py"),
        ("recipe/recipe.yaml", "tests/docs/test_release.py"),  # named
        (".ci/changed", "tests/docs/test_changed.py"),
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
