"""Print the tests of what changed since main, for pytest: the nearest ones, not all that could fail."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent.parent
# Folders that modules are imported from, beside the project's own.
SOURCES = ("fmu_src/", "tests/helpers/", ".ci/")
# Folders whose modules have examples that run as tests.
PACKAGES = ("coupling/", "fmu_src/elastic_robot/")
# Tests of what no Python module imports.
OF_FOLDERS = {
    "fmu_src/native/core/": "tests/native/test_core.py",
    "fmu_src/native/io/": "tests/native/test_trajectory_files.py",
    "fmu_src/native/fmi/": "tests/native/test_life_cycle.py",
    "docs/": "tests/docs/test_pages.py",
}


def changed_files() -> list[str]:
    """Return what differs from the last commit that main has too, new files included."""
    base = _git("merge-base", "HEAD", "main")[0] if _git("branch", "--list", "main") else "HEAD"
    return [
        *_git("diff", "--name-only", "--diff-filter=d", base),
        *_git("ls-files", "--others", "--exclude-standard"),
    ]


def tests_of(name: str) -> set[str]:
    """Return the tests of a file: itself, those that import or name it, or are called after it.

    A module that none imports has those of the modules that import it.

    Args:
        name: The file, from the project's folder.
    """
    words, mentioned = set(Path(name).stem.split("_")), _mentions(name)
    tests = [file for file in _python("tests") if Path(file).stem.startswith("test_")]
    found = {
        test
        for test in tests
        if test == name or words <= set(Path(test).stem.split("_")) or mentioned(test)
    }
    if not found:
        users = [user for user in _python(*PACKAGES) if user != name and mentioned(user)]
        found = {test for user in users for test in tests if _mentions(user)(test)}
    found |= {test for folder, test in OF_FOLDERS.items() if name.startswith(folder)}
    examples = name.endswith(".py") and name.startswith(PACKAGES) and ">>> " in _text(name)
    return found | {name} if examples else found


def _mentions(name: str) -> Callable[[str], bool]:
    """Return what says whether a file imports the module in another one, or writes that one's name."""
    pattern = rf"\b{re.escape(Path(name).name)}\b"
    if name.endswith(".py"):
        module = name.removesuffix(".py").removesuffix("/__init__")
        for source in SOURCES:
            module = module.removeprefix(source)
        package, _, last = module.replace("/", ".").rpartition(".")
        pattern += rf"|^\s*(from|import) (elastic_robot\.)?{module.replace('/', '.')}\s"
        pattern += rf"|^\s*from (elastic_robot\.)?{package} import .*\b{last}\b" if package else ""
    compiled = re.compile(pattern, re.MULTILINE)
    return lambda file: compiled.search(_text(file)) is not None


@cache
def _text(file: str) -> str:
    return (ROOT / file).read_text(encoding="utf-8")


@cache
def _python(*folders: str) -> list[str]:
    return [
        file.relative_to(ROOT).as_posix()
        for folder in folders
        for file in sorted((ROOT / folder).rglob("*.py"))
    ]


def _git(*arguments: str) -> list[str]:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


if __name__ == "__main__":
    print(*sorted({test for file in changed_files() for test in tests_of(file)}), sep="\n")
