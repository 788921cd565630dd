"""Includes of the C core: a file and its header are one module; modules include each other one way."""

from __future__ import annotations

import re
from collections import defaultdict
from graphlib import TopologicalSorter

from coupling.fmu_export.compiler import SOURCES

INCLUDE = re.compile(r'^#include "(?:\.\./\w+/)?(\w+)\.h"', re.MULTILINE)


def test_modules_do_not_include_each_other_in_circles():
    included: dict[str, set[str]] = defaultdict(set)
    for file in SOURCES.glob("*/*.[ch]"):
        included[file.stem] |= set(INCLUDE.findall(file.read_text())) - {file.stem}
    assert included["step"] >= {"load", "motors"}
    TopologicalSorter(included).prepare()


def test_files_know_nothing_of_the_model_nor_the_model_of_fmi():
    for folder, foreign in {"io": "core|fmi", "core": "fmi"}.items():
        for file in sorted((SOURCES / folder).iterdir()):
            assert not re.search(rf'#include "\.\./(?:{foreign})/', file.read_text()), file
