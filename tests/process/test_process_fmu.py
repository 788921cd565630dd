"""Process FMUs: an elastic wall in FMI 2 and 3 against the same law in Python."""

import re
import shutil
import signal
import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import platform_tuple
from places import LINE_CASE, TESTS
from pythonfmu.builder import FmuBuilder
from wall_fmu import STIFFNESS, process, task

from coupling.case.file import load_case
from coupling.errors import CaseError, ProcessError
from coupling.process import ElasticWallTable

SOURCES = TESTS / "process" / "process_fmus"


@pytest.fixture(scope="module")
def fmi2(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fmi2")
    return FmuBuilder.build_FMU(SOURCES / "wall_slave.py", dest=folder / "WallSlave.fmu")


def other_functions(headers: Path, source: Path) -> str:
    """Return the functions of FMI 3 that the wall does not need but FMPy looks for."""
    names = set(re.findall(r"#define (fmi3[A-Z]\w+)", (headers / "fmi3Functions.h").read_text()))
    written = set(re.findall(r"\bfmi3[A-Z]\w+(?=\()", source.read_text()))
    return "".join(f"int {name}(void) {{ return 3; }}\n" for name in sorted(names - written))


@pytest.fixture(scope="module")
def fmi3(tmp_path_factory) -> Path:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler, cc")
    folder = tmp_path_factory.mktemp("fmi3")
    headers = Path(fmpy.__file__).parent / "c-code"
    library = folder / f"wall{fmpy.sharedLibraryExtension}"
    stubs = folder / "stubs.c"
    stubs.write_text(other_functions(headers, SOURCES / "wall.c"))
    sources = [SOURCES / "wall.c", stubs]
    build = [compiler, "-shared", "-fPIC", "-I", headers, *sources, "-o", library]
    subprocess.run(list(map(str, build)), check=True)
    file = folder / "Wall.fmu"
    with zipfile.ZipFile(file, "w") as archive:
        archive.write(SOURCES / "wall.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{platform_tuple}/{library.name}")
    return file


@pytest.mark.parametrize("standard", ["fmi2", "fmi3"])
def test_wall_fmu_is_the_wall_in_python(standard, request):
    """Every sample of an uneven path, turned from the part's axes to the base's."""
    wall = ElasticWallTable(model="elastic-wall", stiffness_N_m=STIFFNESS).process(task())
    path = task().desired
    answer = process(request.getfixturevalue(standard)).evaluate(path).wrench
    expected = wall.evaluate(path).wrench.wrench
    assert np.abs(expected).max() > 300.0
    np.testing.assert_allclose(answer.wrench, expected, rtol=0, atol=1e-9)


def test_inputs_in_base_axes_are_passed_as_they_are(fmi2):
    answer = process(fmi2, frame="base", inputs={"x": "height"}).evaluate(task().desired).wrench
    assert np.array_equal(
        answer.wrench, np.zeros((1, 41, 6))
    )  # x is about 1 m: never below the wall


def test_unknown_names_are_answered_with_the_known_ones(fmi2):
    with pytest.raises(
        CaseError, match=r"WallSlave.*inputs: z: .*got 'hight': did you mean 'height'"
    ):
        process(fmi2, inputs={"z": "hight"})


def test_an_fmu_that_refuses_a_step_is_an_error_with_its_reason(fmi2):
    deep = task().desired.displaced(np.array([0.0, 0.0, -2.0, 0.0, 0.0, 0.0]))
    with pytest.raises(ProcessError, match=r"WallSlave\.fmu: .*a metre thick"):
        process(fmi2).evaluate(deep)


def test_an_fmu_that_kills_its_host_is_an_error(fmi2):
    parameters = {"stiffness": STIFFNESS, "dies_at": 0.5}
    said = "runs the FMU has ended with exit status 3 .it declares needsExecutionTool: is the tool"
    with pytest.raises(ProcessError, match=said):
        process(fmi2, parameters=parameters).evaluate(task().desired)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs signals")
def test_an_fmu_that_is_killed_is_told_with_the_signal(fmi2):
    parameters = {"stiffness": STIFFNESS, "killed_at": 0.5}
    with pytest.raises(ProcessError, match="runs the FMU has ended by SIGKILL"):
        process(fmi2, parameters=parameters).evaluate(task().desired)


def test_what_is_no_fmu_is_refused(tmp_path):
    with pytest.raises(CaseError, match="is not there"):
        process(tmp_path / "none.fmu")
    broken = tmp_path / "broken.fmu"
    broken.write_text("no archive")
    with pytest.raises(CaseError, match="not a readable FMU"):
        process(broken)


UNITS = """<UnitDefinitions>
<Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit>
<Unit name="kN"><BaseUnit kg="1" m="1" s="-2" factor="1000"/></Unit>
</UnitDefinitions>"""


def redeclared(file: Path, *changes: tuple[str, str]) -> Path:
    """Return an FMU beside another one, with changes of its modelDescription."""
    other = file.with_stem(f"Changed{len(list(file.parent.iterdir()))}")
    with zipfile.ZipFile(file) as source, zipfile.ZipFile(other, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                text = content.decode()
                for old, new in changes:
                    assert old in text
                    text = text.replace(old, new)
                content = text.encode()
            target.writestr(name, content)
    return other


def test_declared_units_are_converted(fmi3):
    """Height in mm and force in kN: the same wall has a millionth of the number as stiffness."""
    changed = redeclared(
        fmi3,
        ("<ModelVariables>", f"{UNITS}<ModelVariables>"),
        ('name="height"', 'name="height" unit="mm"'),
        ('name="force"', 'name="force" unit="kN"'),
    )
    expected = process(fmi3).evaluate(task().desired).wrench.wrench
    found = process(changed, parameters={"stiffness": 1e-6 * STIFFNESS}).evaluate(task().desired)
    np.testing.assert_allclose(found.wrench.wrench, expected, rtol=1e-12, atol=1e-9)


REFUSED = {
    "another type": (
        ('<Float64 name="force"', '<Int32 name="force"'),
        {},
        "outputs: fz: expected a scalar Real or Float64, got 'force', Int32",
    ),
    "an output as input": (None, {"inputs": {"z": "force"}}, "inputs: z: .*'force', output"),
    "an input as output": (None, {"outputs": {"fz": "height"}}, "outputs: fz: .*'height', input"),
    "one variable for two columns": (
        None,
        {"inputs": {"x": "height", "z": "height"}},
        "inputs: expected a variable for each column, got 'height' for x and z",
    ),
    "two names of one variable for two columns": (
        (
            "</ModelVariables>",
            '<Float64 name="h" valueReference="0" causality="input" start="0"/></ModelVariables>',
        ),
        {"inputs": {"x": "height", "z": "h"}},
        "inputs: expected a variable for each column, got 'h' for x and z",
    ),
    "two variables of one name": (
        (
            "</ModelVariables>",
            '<Float64 name="force" valueReference="2" causality="output"/></ModelVariables>',
        ),
        {},
        "expected variables of different names",
    ),
    "an output as parameter": (
        None,
        {"parameters": {"force": 1.0}},
        "parameters: expected a variable of causality parameter .*, got 'force', output",
    ),
    "an input as parameter that the poses set": (
        None,
        {"parameters": {"height": 1.0}},
        "parameters: expected no variable that the poses set, got 'height'",
    ),
    "a unit of something else": (
        ('name="force"', 'name="force" unit="mm"'),
        {},
        "outputs: fz: expected a unit of N, got 'force' in 'mm'",
    ),
    "a unit that is not defined": (
        ('name="force"', 'name="force" unit="lbf"'),
        {},
        "outputs: fz: expected N or a unit that the FMU defines .* 'force' in 'lbf'",
    ),
    "a parameter of another type": (
        None,
        {"parameters": {"stiffness": "high"}},
        "parameters: stiffness: expected a number, got 'high'",
    ),
    "a parameter beyond its declared limit": (
        ('name="stiffness"', 'name="stiffness" max="1000"'),
        {},
        "parameters: stiffness: expected -inf to 1000, as the FMU declares, got 200000.0",
    ),
    "even steps alone": (
        ('canHandleVariableCommunicationStepSize="true"', ""),
        {},
        "canHandleVariableCommunicationStepSize = false: export it",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_an_fmu_declares_otherwise_is_refused_by_its_name(fmi3, kind):
    change, keys, message = REFUSED[kind]
    units = ("<ModelVariables>", f"{UNITS}<ModelVariables>")
    file = redeclared(fmi3, units, change) if change else fmi3
    with pytest.raises(CaseError, match=message):
        process(file, **keys)


def test_references_of_another_type_are_not_read(fmi2):
    """In FMI 2 an Integer may have the reference of a Real: its own name is refused."""
    changed = redeclared(
        fmi2,
        (
            "</ModelVariables>",
            '<ScalarVariable name="count" valueReference="0" causality="output"'
            ' variability="discrete"><Integer/></ScalarVariable></ModelVariables>',
        ),
    )
    with pytest.raises(CaseError, match=r"outputs: fz: .*'count', Integer"):
        process(changed, outputs={"fz": "count"})


def test_an_fmu_that_ends_its_simulation_is_not_asked_any_more(fmi3):
    """By FMI 3 a step that succeeds may be the last one."""
    with pytest.raises(
        ProcessError, match=r"has ended its simulation at 0\.5\d* s, before the end"
    ):
        process(fmi3, parameters={"stiffness": STIFFNESS, "ends_at": 0.5}).evaluate(task().desired)


def test_a_library_outside_of_the_fmu_is_not_loaded(fmi3):
    changed = redeclared(fmi3, ('modelIdentifier="wall"', 'modelIdentifier="../../wall"'))
    with pytest.raises(ProcessError, match="modelIdentifier of letters"):
        process(changed).evaluate(task().desired)


def test_a_case_names_a_process_fmu_and_its_variables(fmi3, tmp_path):
    """The test case with its wall replaced by the wall's FMU, whose path is relative to the case."""
    text = (LINE_CASE).read_text()
    wall = 'model         = "elastic-wall"\nstiffness_N_m = 2.0e5'
    assert wall in text
    fmu = (
        'model = "fmu"\nfile = "Wall.fmu"\ninputs = { z = "height" }\noutputs = { fz = "force" }\n'
        "parameters = { stiffness = 2.0e5 }"
    )
    shutil.copy(fmi3, tmp_path / "Wall.fmu")
    (tmp_path / "case.toml").write_text(text.replace(wall, fmu))
    ours, theirs = (load_case(file) for file in (LINE_CASE, tmp_path / "case.toml"))
    expected = ours.process.evaluate(ours.desired).wrench.wrench[0]
    assert np.abs(expected).max() > 300.0
    answer = theirs.process.evaluate(theirs.desired).wrench.wrench[0]
    np.testing.assert_allclose(answer, expected, rtol=0, atol=1e-9)
