"""docs/conformance.md: functions of the headers, states, tests and flags are as it tells."""

import ast
import re
import runpy
import zipfile
from xml.etree import ElementTree

import pytest
from places import DOCS, HOSTS, ROOT, TESTS

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.native.compiler import SOURCES

PAGE = (DOCS / "conformance.md").read_text()
KINDS = {
    "FMI 2, native": BuildOptions("native"),
    "FMI 3, native": BuildOptions("native", fmi="3"),
}
ELEMENTS = {"CS": "CoSimulation", "ME": "ModelExchange"}
# The modes of tests/native/test_exchange_calls.py, as the page's columns have them.
MODES = ["instantiated", "initialising", "event", "continuous", "terminated"]


def tables() -> list[list[list[str]]]:
    """The page's tables, cell by cell, the heading first."""
    found = re.findall(r"(?:^\|.*\|\n)+", PAGE, re.MULTILINE)
    split = [[row.strip("|").split("|") for row in table.splitlines()] for table in found]
    return [[[cell.strip() for cell in row] for row in [rows[0], *rows[2:]]] for rows in split]


def table(*heading: str) -> list[list[str]]:
    """The rows of all tables whose headings begin so."""
    return [r for rows in tables() if rows[0][: len(heading)] == list(heading) for r in rows[1:]]


def named(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def functions_of(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text())
    return {part.name for part in tree.body if isinstance(part, ast.FunctionDef)}


def test_every_row_has_as_many_cells_as_its_heading():
    for rows in tables():
        assert {len(row) for row in rows} == {len(rows[0])}, rows[0]


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_every_function_of_the_headers_has_one_row(fmi):
    header = (SOURCES / "fmi" / f"fmi{fmi}Functions.h").read_text()
    declared = set(re.findall(rf"^#define fmi{fmi}(\w+) +fmi{fmi}FullName", header, re.MULTILINE))
    prototypes = set(re.findall(rf"FMI{fmi}_Export fmi{fmi}(\w+)TYPE +fmi{fmi}\1;", header))
    assert prototypes == declared
    assert len(prototypes) > 40
    told = [name for row in table("function") for name in named(row[0])]
    mine = [name.removeprefix(f"fmi{fmi}") for name in told if name.startswith(f"fmi{fmi}")]
    assert sorted(mine) == sorted(prototypes)
    assert all(re.match("fmi[23]", name) for name in told)


def test_every_test_named_is_there():
    tests = {named(row[0])[0]: named(row[1])[0] for row in table("name")}
    written = {
        function
        for folder in ("fmu", "native")
        for file in (TESTS / folder).glob("test_*.py")
        for function in functions_of(str(file.relative_to(ROOT)))
    }
    assert set(tests.values()) <= written
    clauses = {
        name
        for file in HOSTS.glob("clauses*.py")
        for name in functions_of(str(file.relative_to(ROOT)))
    }
    used = {"clauses"}
    for rows in tables():
        for row in rows[1:] if rows[0][-1] == "test" else []:
            keys = named(row[-1])
            assert keys or "no test" in row[-1], row
            for key in keys:
                known = key.removeprefix("clause ") in clauses if "clause " in key else key in tests
                assert known, (row[0], key)
            used |= set(keys)
    used |= {key for key in tests if f"`{key}`" in PAGE.partition("## The tests")[0]}
    assert set(tests) <= used


def taken(rows: list[list[str]], fmi: str, states: list[str]) -> dict[str, list[str]]:
    """In which states each call is taken, as the page has it."""
    return {
        named(row[0])[0]: [s for s, cell in zip(states, row[1:], strict=True) if fmi in cell]
        for row in rows
    }


def test_the_states_are_those_that_the_life_cycle_is_gone_through_with():
    life = runpy.run_path(str(TESTS / "fmu" / "test_life_cycle.py"))
    rows = table("call", "Instantiated", "Initialization Mode", "stepComplete, Step Mode")
    for fmi, expected in (("2", life["FMI2"]), ("3", life["FMI3"])):
        found = taken(rows, fmi, life["EVER"])
        assert {call: states for call, states in found.items() if states or call in expected} == (
            expected
        )


def test_the_modes_are_those_that_model_exchange_is_gone_through_with():
    calls = runpy.run_path(str(TESTS / "native" / "test_exchange_calls.py"))["CALLS"]
    rows = [
        row
        for row in table("call", "Instantiated", "Initialization Mode", "Event Mode")
        if row[0].strip("`") in calls
    ]
    for fmi in ("2", "3"):
        expected = {name: set(modes) for name, (_, modes) in calls.items()}
        if fmi == "3":
            expected["enter event mode"] -= {"event"}
        assert {name: set(s) for name, s in taken(rows, fmi, MODES).items()} == expected


def test_the_flags_are_those_of_built_fmus(example, tmp_path):
    rows = table("flag")
    for column, (kind, options) in enumerate(KINDS.items(), start=1):
        file = build_fmu(example, tmp_path / f"{column}.fmu", options)
        with zipfile.ZipFile(file) as archive:
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))
        assert root.find("ScheduledExecution") is None
        told = {
            (use, named(row[0])[0]): value
            for row in rows
            for use, value in re.findall(r"(CS|ME) (\w+)", row[column])
        }
        stated = {
            (use, flag): value
            for use, element in ELEMENTS.items()
            for found in root.iterfind(element)
            for flag, value in found.attrib.items()
            if flag != "modelIdentifier"
        }
        assert told == stated, kind


def test_the_flags_that_rows_name_are_in_the_table():
    flags = {named(row[0])[0] for row in table("flag")}
    cells = [cell for rows in tables() for row in rows[1:] for cell in row]
    pattern = r"(?:can|has|needs|provides|max|might)[A-Z]\w+"
    mentioned = {n for cell in cells for n in named(cell) if re.fullmatch(pattern, n)}
    assert mentioned <= flags
