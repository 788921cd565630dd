"""Layers of the C core: includes, and the calls that the linker sees, go one way."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from native_fmu import compiled

from coupling.native.compiler import SOURCES

INCLUDE = re.compile(r'^#include "(?:[./\w]*/)?(\w+)\.h"', re.MULTILINE)
# Each folder knows those above it in this list alone.
FOLDERS = (
    "io",
    "core/chain",
    "core/elements",
    "core/load",
    "core/step",
    "core/outputs",
    "core",
    "fmi",
)


def folder(file: Path) -> str:
    return file.parent.relative_to(SOURCES).as_posix()


@cache
def calls() -> dict[Path, set[Path]]:
    """The files whose functions and constants each C file needs, by nm of their objects."""
    nm = shutil.which("nm")
    if nm is None:
        pytest.skip("needs nm")

    def symbols(file: Path) -> tuple[set[str], set[str]]:
        made = compiled([SOURCES], "-O0", "-c", str(file.relative_to(SOURCES)))
        said = subprocess.run([nm, str(made)], capture_output=True, text=True, check=True).stdout
        rows = [line.split()[-2:] for line in said.splitlines()]
        defined = {name for kind, name in rows if kind in "TDRBC"}
        return defined, {name for kind, name in rows if kind == "U"}

    files = sorted(SOURCES.rglob("*.c"))
    with ThreadPoolExecutor(2) as pool:
        found = dict(zip(files, pool.map(symbols, files), strict=True))
    owner = {name: file for file, (defined, _) in found.items() for name in defined}
    return {
        file: {owner[name] for name in needed if name in owner}
        for file, (_, needed) in found.items()
    }


def test_modules_do_not_include_each_other_in_circles():
    included: dict[str, set[str]] = defaultdict(set)
    for file in SOURCES.rglob("*.[ch]"):
        included[file.stem] |= set(INCLUDE.findall(file.read_text())) - {file.stem}
    assert included["run"] >= {"load", "motors"}
    TopologicalSorter(included).prepare()


def test_objects_do_not_call_each_other_in_circles():
    needed = calls()
    assert SOURCES / "core/load/anchor.c" in needed[SOURCES / "core/load/contact_motion.c"]
    TopologicalSorter(needed).prepare()


def test_folders_call_and_include_those_below_them_alone():
    for file, needed in calls().items():
        above = {f for f in needed if FOLDERS.index(folder(f)) > FOLDERS.index(folder(file))}
        assert not above, file
    headers = {file.stem: folder(file) for file in SOURCES.rglob("*.h")}
    for file in SOURCES.rglob("*.[ch]"):
        for name in INCLUDE.findall(file.read_text()):
            assert FOLDERS.index(headers[name]) <= FOLDERS.index(folder(file)), (file, name)


def test_a_file_of_the_core_has_a_header_of_its_name():
    """Or is the kernel, written for several widths behind one header."""
    for file in SOURCES.glob("core/**/*.c"):
        assert file.with_suffix(".h").is_file() or file.stem in {"kernel_plain", "kernel_avx2"}, (
            file
        )


def test_names_of_static_functions_are_found_by_grep():
    """Several words, in one file alone; the kernel is written once for several widths."""
    files: dict[str, set[str]] = defaultdict(set)
    static = re.compile(
        r"^static (?:inline )?(?!const struct)[\w ]*?[\w*]+ \*?(\w+)\(", re.MULTILINE
    )
    for file in SOURCES.rglob("*.c"):
        if not file.stem.startswith("kernel_"):
            for name in static.findall(file.read_text()):
                files[name].add(file.name)
    assert len(files) > 300
    assert {name for name in files if "_" not in name} == set()
    assert {name: found for name, found in files.items() if len(found) > 1} == {}
