"""Files that a module of the tests depends on: what it imports, and the data that these read."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import grimp
from places import ROOT

PACKAGES = ("coupling", "elastic_robot")
# Where the other modules are, as pytest's `pythonpath` has it.
_PLACES = (ROOT / "tests" / "helpers", ROOT / "tests", ROOT, ROOT / ".ci", ROOT / "fmu_src")
# Folders whose files a package reads, compiles, packs or starts: all of each count.
_FOLDERS = {
    "coupling.files": ("examples/robots", "examples/cases", "examples/measured"),
    "coupling.native": ("fmu_src", "coupling/native"),
    "coupling.fmu": ("fmu_src", "coupling/fmu"),
    "coupling.fmu_export": ("fmu_src", "coupling/fmu_export"),
}


def sources_of(file: Path) -> frozenset[Path]:
    """Return the files that a Python file of this project depends on, itself among them.

    Imports inside functions count, those for types alone do not; a module brings its packages.
    """
    files, modules = {file}, set[str]()
    waiting = [file]
    while waiting:
        for name in _imported(waiting.pop()):
            if name.split(".")[0] in PACKAGES:
                modules |= _upstream(name)
            elif (found := _file_of(name)) is not None and found not in files:
                files.add(found)
                waiting.append(found)
    files |= {path for name in modules if (path := _file_of(name)) is not None}
    for package, folders in _FOLDERS.items():
        if package in modules:
            files.update(*map(_all_of, folders))
    return frozenset(files)


@cache
def _graph() -> grimp.ImportGraph:
    return grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True, cache_dir=None)


@cache
def _upstream(module: str) -> frozenset[str]:
    """Return what is executed where a module of the packages is imported, or a name of a package."""
    graph, found = _graph(), set[str]()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        parent = name.rpartition(".")[0]
        if parent:
            waiting.append(parent)
        if name in graph.modules and name not in found:
            found.add(name)
            waiting += graph.find_modules_directly_imported_by(name)
    return frozenset(found)


def _imported(file: Path) -> Iterator[str]:
    """Yield the names that a file imports, and names from them, which may be modules."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@cache
def _file_of(module: str) -> Path | None:
    path = module.replace(".", "/")
    candidates = (place / end for place in _PLACES for end in (f"{path}.py", f"{path}/__init__.py"))
    return next(filter(Path.is_file, candidates), None)


@cache
def _all_of(folder: str) -> frozenset[Path]:
    return frozenset(
        file
        for file in (ROOT / folder).rglob("*")
        # Bytecode is written there, first under a name with another ending.
        if "__pycache__" not in file.parts and file.suffix != ".fmu" and file.is_file()
    )
