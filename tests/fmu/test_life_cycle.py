"""Which call may be made when, in FMUs of both versions of FMI; what instances leave; the clauses."""

import ast
import json
import re
from dataclasses import replace

import pytest
from left_behind import left_behind
from places import HOSTS

from coupling.fmu_export.build import BuildOptions, build_fmu

EVER = ["instantiated", "initialising", "running", "terminated"]
BEGUN, ALIVE, BEFORE = EVER[1:], EVER[:3], EVER[:2]

# FMI 2.0.4, section 4.2.4: "Allowed function calls" for co-simulation, of what this FMU has.  A step is
# complete when its call returns: the columns stepInProgress, stepFailed and stepCanceled are not there.
FMI2 = {
    "SetDebugLogging": EVER,
    "SetupExperiment": ["instantiated"],
    "EnterInitializationMode": ["instantiated"],
    "ExitInitializationMode": ["initialising"],
    "Terminate": ["running"],
    "Reset": EVER,
    "Get of an output": BEGUN,
    "Get of an input": BEGUN,
    "GetString": BEGUN,
    "Set of an input": ALIVE,
    "Set of a tunable parameter": ALIVE,
    "SetString of a fixed parameter": BEFORE,
    "Set of an output": [],
    "GetFMUstate": EVER,
    "SetFMUstate": EVER,
    "DeSerializeFMUstate": EVER,
    "GetDirectionalDerivative": BEGUN,
    "DoStep": ["running"],
    "GetRealStatus": ["running", "terminated"],
}
# FMI 3.0.2, sections 2.3 and 4.2: states Instantiated, Initialization Mode, Step Mode, Terminated.
FMI3 = {
    **FMI2,
    "Get of an output": EVER,
    "Get of an input": EVER,
    "GetString": EVER,
}
del FMI3["SetupExperiment"], FMI3["GetRealStatus"]


@pytest.mark.parametrize(("fmi", "table"), [("2", FMI2), ("3", FMI3)])
def test_calls_are_taken_where_the_standard_allows_them(example, tmp_path, run_host, fmi, table):
    file = build_fmu(example, tmp_path / "Robot.fmu", BuildOptions(fmi=fmi))
    run_host("life_cycle", file, tmp_path / "found.json")
    found = json.loads((tmp_path / "found.json").read_text())
    assert found.pop("pairs") == table
    assert set(map(tuple, found.values())) == {()}, found


def test_instances_and_refused_calls_leave_no_memory_behind(example_fmu, tmp_path):
    left_behind(example_fmu, tmp_path)


def test_the_module_path_is_that_of_the_host_after_any_number_of_instances(
    example, tmp_path, run_host
):
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("python"))
    run_host("module_path", file, "elastic_robot_entry")


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
