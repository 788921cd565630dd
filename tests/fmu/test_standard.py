"""What both standards ask of every FMU, kind by kind, use by use; the clauses: hosts/clauses.py."""

from __future__ import annotations

import ast
import json
import re
from dataclasses import replace

import pytest
from places import HOSTS

from coupling.fmu_export.build import BuildOptions, build_fmu

FMUS = {
    "native, FMI 2": BuildOptions("native"),
    "native, FMI 3": BuildOptions("native", fmi="3"),
}
USES = [(name, use) for name in FMUS for use in ("cs", "me")]


@pytest.fixture(scope="module")
def built(example, tmp_path_factory):
    """FMUs of the example robot with limits of two drives, and an odd name of one."""
    folder = tmp_path_factory.mktemp("standard")
    first, second, third, *others = example.joints
    names = ("upper\x00\n arm~", "")
    limited = [
        replace(own, limits=(-2.0, 1.0), name=name)
        for own, name in zip((second, third), names, strict=True)
    ]
    robot = replace(example, joints=(first, *limited, *others))
    return {
        name: build_fmu(robot, folder / f"{number}.fmu", options)
        for number, (name, options) in enumerate(FMUS.items())
    }


@pytest.mark.parametrize(("name", "use"), USES)
def test_the_standards_clauses_are_kept(built, run_host, tmp_path, name, use):
    """Each in the process of all: that nothing crashes is among what they ask."""
    run_host("clauses", built[name], use, tmp_path / "wrong.json")
    wrong = json.loads((tmp_path / "wrong.json").read_text())
    assert not wrong, "\n".join(wrong.values())


def test_every_clause_says_what_it_rests_on():
    functions = [
        part
        for file in HOSTS.glob("clauses*.py")
        for part in ast.parse(file.read_text()).body
        if isinstance(part, ast.FunctionDef)
    ]
    assert len(functions) > 10
    asked = (HOSTS / "clauses.py").read_text().partition("CLAUSES = {")[2]
    for function in functions:
        assert f" {function.name}," in asked
        assert re.match(r"(A real .*)?FMI [23], \d", ast.get_docstring(function) or ""), (
            function.name
        )
