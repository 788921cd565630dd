"""The native FMU of FMI 3.0 is the one of FMI 2.0 with arrays."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import zipfile
from dataclasses import dataclass
from pathlib import Path

import fmpy
import fmpy.validation
import numpy as np
import pytest
from emulators import EMULATORS
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from lxml import etree
from places import DOCS, TESTS
from random_robots import make_robot

from build_fmu import main
from coupling.errors import BuildError
from coupling.fmu_export.arrays import array_variables
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.compiler import PLATFORMS, SOURCES, host_platform, zig
from coupling.fmu_export.native_standards import STANDARDS
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import blocks

POSTURE = [0.0, -0.3, 0.5, 0.0, 0.6, 0.0]
STEP = 0.004  # [s]
SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"


@dataclass
class Pair:
    """One robot as FMUs of both versions of FMI, unpacked."""

    folder2: Path
    folder3: Path

    def __post_init__(self) -> None:
        self.description = fmpy.read_model_description(str(self.folder3))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.sizes = {
            v.valueReference: int(np.prod(v.shape)) if v.shape else 1
            for v in self.description.modelVariables
        }
        scalars = fmpy.read_model_description(str(self.folder2))
        self.scalars = {v.name: v.valueReference for v in scalars.modelVariables}
        self.guid2 = scalars.guid

    def fmi2(self) -> FMU2Slave:
        slave = FMU2Slave(
            guid=self.guid2,
            unzipDirectory=str(self.folder2),
            modelIdentifier="ElasticRobot",
            instanceName="robot",
        )
        slave.instantiate()
        return slave

    def fmi3(self, token: str | None = None, **options: object) -> FMU3Slave:
        slave = FMU3Slave(
            guid=token or self.description.guid,
            unzipDirectory=str(self.folder3),
            modelIdentifier="ElasticRobot",
            instanceName="robot",
        )
        slave.instantiate(**options)
        return slave

    def get(self, slave: FMU3Slave, *names: str) -> list[float]:
        found = [self.references[name] for name in names]
        return slave.getFloat64(found, sum(self.sizes[k] for k in found))

    def set(self, slave: FMU3Slave, name: str, values: list[float]) -> None:
        slave.setFloat64([self.references[name]], values)

    def started(self, **strings: str) -> FMU3Slave:
        """An instance at rest in POSTURE."""
        slave = self.fmi3()
        for name, value in strings.items():
            slave.setString([self.references[name]], [value])
        slave.enterInitializationMode(startTime=0.0)
        self.set(slave, "q_cmd", POSTURE)
        slave.exitInitializationMode()
        return slave

    def everything(self, slave: FMU3Slave) -> list[float]:
        """All reals, in the order of their value references."""
        reals = sorted(
            v.valueReference
            for v in self.description.modelVariables
            if v.type == "Float64" and v.name != "time"
        )
        return slave.getFloat64(reals, sum(self.sizes[k] for k in reals))


def make_pair(robot: Robot, folder: Path) -> Pair:
    for fmi in ("2", "3"):
        file = build_fmu(robot, folder / f"{fmi}.fmu", BuildOptions("native", fmi=fmi))
        fmpy.extract(str(file), unzipdir=str(folder / fmi))
    return Pair(folder / "2", folder / "3")


@pytest.fixture(scope="session")
def pair(example, tmp_path_factory) -> Pair:
    return make_pair(example, tmp_path_factory.mktemp("pair"))


def test_contents_are_valid_and_complete(example, tmp_path):
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("native", sources=True, fmi="3"))
    assert fmpy.validation.validate_fmu(str(file)) == []
    with zipfile.ZipFile(file) as archive:
        names = set(archive.namelist())
        build = archive.read("sources/buildDescription.xml")
        licence = archive.read("documentation/licenses/fmi-headers.txt").decode()
        page = archive.read("documentation/index.html").decode()
    platform = host_platform()
    assert f"binaries/{platform.machine}/ElasticRobot{platform.suffix}" in names
    assert {"resources/robot.txt", "sources/fmi/fmi3.c", "sources/fmi/fmi3Functions.h"} <= names
    assert "sources/fmi/fmi2.c" not in names
    assert "2-Clause BSD" in licence
    assert "Modelica Association" in licence
    assert "FMI 3.0" in page
    assert "q_cmd[6]" in page
    schema = etree.XMLSchema(etree.parse(SCHEMAS / "fmi3BuildDescription.xsd"))
    schema.assertValid(etree.fromstring(build))


def test_the_packed_sources_compile_to_the_library_by_themselves(example, tmp_path):
    """The listed files alone, all warnings on; the library has every function of FMI 3.0."""
    compiler, objdump = shutil.which("cc"), shutil.which("objdump")
    if compiler is None or objdump is None or host_platform().suffix != ".so":
        pytest.skip("needs cc and objdump on Linux")
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("native", sources=True, fmi="3"))
    fmpy.extract(str(file), unzipdir=str(tmp_path / "fmu"))
    sources = tmp_path / "fmu" / "sources"
    listed = etree.parse(sources / "buildDescription.xml").findall(".//SourceFile")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fPIC", "-shared"]
    files = [str(sources / element.get("name")) for element in listed]
    library = tmp_path / "own.so"
    subprocess.run([compiler, *flags, "-o", str(library), *files, "-lm"], check=True)
    shown = subprocess.run([objdump, "-T", str(library)], capture_output=True, text=True).stdout
    header = (SOURCES / "fmi" / "fmi3Functions.h").read_text()
    wanted = set(re.findall(r"fmi3FullName\((fmi3\w+)\)", header))
    assert len(wanted) == 75
    assert wanted <= set(re.findall(r"\.text\s.*\s(fmi3\w+)$", shown, re.MULTILINE))


def test_the_library_exports_nothing_else_and_needs_libc_and_libm_only(pair):
    objdump = shutil.which("objdump")
    if objdump is None or host_platform().suffix != ".so":
        pytest.skip("needs objdump on Linux")
    library = pair.folder3 / "binaries" / host_platform().machine / "ElasticRobot.so"
    shown = subprocess.run([objdump, "-pT", str(library)], capture_output=True, text=True).stdout
    needed = set(re.findall(r"NEEDED\s+(\S+)", shown))
    assert needed <= {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
    defined = re.findall(r" g .*\.text\s.*\s(\S+)$", shown, re.MULTILINE)
    assert defined
    assert all(name.startswith("fmi3") for name in defined)


def test_variables_are_those_of_fmi2_with_arrays(pair):
    found = {v.name: (v.shape or (), v.unit) for v in pair.description.modelVariables}
    expected = {
        "force": ((3,), "N"),
        "moment": ((3,), "N.m"),
        "q_cmd": ((6,), "rad"),
        "qd_cmd": ((6,), "rad/s"),
        "qdd_cmd": ((6,), "rad/s2"),
        "tcp.position": ((3,), "m"),
        "tcp.orientation": ((4,), "1"),
        "tcp.velocity": ((3,), "m/s"),
        "rigid.position": ((3,), "m"),
        "rigid.orientation": ((4,), "1"),
        "deviation.position": ((3,), "m"),
        "deviation.rotation": ((3,), "rad"),
        "compliance": ((6,), "m/N"),
        "deflection": ((11,), "rad"),
        "gravity": ((3,), "m/s2"),
        "joint[3].tilt[2].stiffness": ((), "N.m/rad"),
        "time": ((), "s"),
        "trajectory": ((), None),
    }
    assert {name: found[name] for name in expected} == expected


@pytest.mark.parametrize("joints", [1, 3, 7])
def test_each_element_is_in_one_array_with_one_range_unit_and_nominal(joints):
    """What an array states once must hold for all of its elements, on any robot."""
    table = blocks(make_robot(4, joints))
    arrays = [array for block in array_variables(table).values() for array in block]
    elements = [v for array in arrays for v in array.elements]
    assert elements == [v for block in table.values() for v in block.variables]
    for array in arrays:
        assert elements[array.reference] is array.elements[0]
        assert len({(v.unit, v.nominal, v.start is None) for v in array.elements}) == 1


def test_start_values_are_those_of_fmi2(pair):
    """Read from a fresh instance, as the core has them, and from both descriptions."""
    slave = pair.fmi3()
    scalars = fmpy.read_model_description(str(pair.folder2)).modelVariables
    stated = {v.valueReference: float(v.start) for v in scalars if v.type == "Real" and v.start}
    for variable in pair.description.modelVariables:
        if variable.type != "Float64" or variable.start is None:
            continue
        text = variable.start if isinstance(variable.start, str) else " ".join(variable.start)
        start = [float(value) for value in text.split()]
        first = variable.valueReference
        assert start == [stated[first + k] for k in range(len(start))]
        assert start == pair.get(slave, variable.name)


@pytest.mark.parametrize(("seed", "joints"), [(2, 1), (5, 3), (8, 7)])
def test_all_reals_are_bit_for_bit_those_of_fmi2(tmp_path, seed, joints):
    """Random robots under random commands and loads, a parameter changed on the way."""
    pair = make_pair(make_robot(seed, joints), tmp_path)
    rng = np.random.default_rng(seed)
    two, three = pair.fmi2(), pair.fmi3()
    q = 0.3 * rng.normal(size=joints)
    drives = pair.scalars["q_cmd[1]"]
    two.setupExperiment(startTime=0.5, tolerance=1e-7)
    two.enterInitializationMode()
    two.setReal(list(range(drives, drives + joints)), q.tolist())
    two.exitInitializationMode()
    three.enterInitializationMode(startTime=0.5, tolerance=1e-7)
    pair.set(three, "q_cmd", q.tolist())
    three.exitInitializationMode()
    time = 0.5
    for k in range(12):
        wrench, rate = 100.0 * rng.normal(size=6), rng.normal(size=joints)
        q = q + STEP * rate
        inputs = [*wrench, *q, *rate]
        two.setReal(list(range(len(inputs))), inputs)
        references = [pair.references[name] for name in ("force", "moment", "q_cmd", "qd_cmd")]
        three.setFloat64(references, inputs)
        if k == 6:
            gravity = [3.0, 1.0, -9.0]
            two.setReal([pair.scalars[f"gravity.{c}"] for c in "xyz"], gravity)
            pair.set(three, "gravity", gravity)
        two.doStep(time, STEP)
        assert three.doStep(time, STEP) == (False, False, False, time + STEP)
        time += STEP
        assert pair.everything(three) == two.getReal(list(range(pair.scalars["trajectory"])))
    assert pair.get(three, "time") == [time]


def test_the_snippet_of_the_page_runs_in_fmpy(pair, example, tmp_path, monkeypatch):
    """As stepped by hand with the force at each step's start, to the rounding of FMPy's times."""
    build_fmu(example, tmp_path / "ElasticRobot3.fmu", BuildOptions("native", fmi="3"))
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "native.md").read_text()
    (snippet,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict[str, np.ndarray] = {}
    exec(snippet, names)
    result, slave, size = names["result"], pair.started(), 1 / 128
    assert result["tcp.position"].shape == (129, 3)
    for k in range(128):
        pair.set(slave, "force", [0.0, 0.0, -1000.0 * k * size])
        slave.doStep(k * size, size)
        found = [*result["tcp.position"][k + 1], *result["tcp.orientation"][k + 1]]
        expected = pair.get(slave, "tcp.position", "tcp.orientation")
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


def _advance(pair: Pair, slave: FMU3Slave, begin: int) -> list[list[float]]:
    rows = []
    for k in range(begin, begin + 10):
        pair.set(slave, "force", [0.0, 0.0, -400.0 * (k % 7 < 3)])
        slave.doStep(STEP * k, STEP)
        rows.append(pair.everything(slave))
    return rows


def test_states_go_back_bit_for_bit_within_and_between_instances(pair):
    slave, other = pair.started(), pair.started()
    _advance(pair, slave, 0)
    state = slave.getFMUState()
    data = slave.serializeFMUState(state)
    expected = _advance(pair, slave, 10)
    slave.setFMUState(state)
    assert _advance(pair, slave, 10) == expected
    other.setFMUState(other.deserializeFMUState(data))
    assert _advance(pair, other, 10) == expected
    slave.freeFMUState(state)


def test_a_damaged_state_is_refused_and_changes_nothing(pair, capfd):
    slave = pair.started()
    _advance(pair, slave, 0)
    before = pair.everything(slave)
    data = bytearray(slave.serializeFMUState(slave.getFMUState()))
    data[len(data) // 2] ^= 1
    with pytest.raises(FMICallException):
        slave.deserializeFMUState(bytes(data))
    assert "checksum does not agree" in capfd.readouterr().err
    with pytest.raises(FMICallException):
        slave.deserializeFMUState(bytes(data[:-1]))
    assert "needed is a state that this FMU has saved" in capfd.readouterr().err
    assert pair.everything(slave) == before


def test_reset_begins_again(pair):
    slave = pair.started()
    first = _advance(pair, slave, 0)
    slave.reset()
    slave.enterInitializationMode(startTime=0.0)
    pair.set(slave, "q_cmd", POSTURE)
    slave.exitInitializationMode()
    assert _advance(pair, slave, 0) == first


def test_directional_derivatives_are_those_of_fmi2_by_element(pair):
    two, three = pair.fmi2(), pair.started()
    two.setupExperiment(startTime=0.0)
    two.enterInitializationMode()
    two.setReal(list(range(6, 12)), POSTURE)
    two.exitInitializationMode()
    two.doStep(0.0, STEP)
    three.doStep(0.0, STEP)
    seed = [1.0, -2.0, 3.0, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0]
    tcp, velocity = pair.scalars["tcp.x"], pair.scalars["tcp.vx"]
    scalars = [*range(tcp, tcp + 3), *range(velocity, velocity + 3)]
    expected = two.getDirectionalDerivative(scalars, [0, 1, 2, *range(6, 12)], seed)
    unknowns = [pair.references[name] for name in ("tcp.position", "tcp.velocity")]
    knowns = [pair.references[name] for name in ("force", "q_cmd")]
    assert three.getDirectionalDerivative(unknowns, knowns, seed, 6) == expected
    assert np.all(np.abs(expected) > 0.0)


NAN = float("nan")
REFUSED = {
    "too few values": (
        lambda p, s: s.setFloat64([p.references["force"]], [1.0, 2.0]),
        "there are 2 values for variables of 3 elements; needed is one for each",
    ),
    "too many values": (
        lambda p, s: s.setFloat64([p.references["force"], p.references["q_cmd"]], [0.0] * 10),
        "there are 10 values for variables of 9 elements",
    ),
    "no room": (
        lambda p, s: s.getFloat64([p.references["tcp.position"]]),
        "there are 1 values for variables of 3 elements",
    ),
    "element of an array": (
        lambda p, s: s.getFloat64([p.references["force"] + 1]),
        "the value reference 1 is asked for as a Float64 variable; this FMU has none there",
    ),
    "behind all variables": (
        lambda p, s: s.getFloat64([p.references["time"] + 1]),
        "asked for as a Float64 variable; this FMU has none there",
    ),
    "string as Float64": (
        lambda p, s: s.getFloat64([p.references["mode"]]),
        "asked for as a Float64 variable; this FMU has none there",
    ),
    "often the same": (
        lambda p, s: s.setFloat64([p.references["q_cmd"]] * 100, [0.0] * 600),
        "600 values are given in one call",
    ),
    "output": (
        lambda p, s: p.set(s, "tcp.position", [0.0] * 3),
        "tcp.x is an output and cannot be set",
    ),
    "not finite": (
        lambda p, s: p.set(s, "force", [0.0, NAN, 0.0]),
        "force.y is nan N; needed is a finite number",
    ),
    "time": (lambda p, s: p.set(s, "time", [1.0]), "is asked for as a real variable"),
    "Float64 as string": (
        lambda p, s: s.getString([p.references["force"]]),
        "is asked for as a string variable",
    ),
    "string too late": (
        lambda p, s: s.setString([p.references["mode"]], ["dynamic"]),
        "strings are fixed",
    ),
    "integer": (
        lambda p, s: s.getInt32([3]),
        "Int32 variable 3 is asked for; this FMU has Float64 and String variables only",
    ),
    "step elsewhere": (lambda p, s: s.doStep(0.5, STEP), "the step starts at 0.5 s; needed is"),
    "step back": (lambda p, s: s.doStep(0.0, -STEP), "step size is -0.004 s"),
    "event mode": (lambda p, s: s.enterEventMode(), "event mode is asked for"),
    "configuration mode": (
        lambda p, s: s.enterConfigurationMode(),
        "configuration mode is asked for",
    ),
    "initialisation": (
        lambda p, s: s.enterInitializationMode(),
        "initialisation is entered after it has ended; needed is a reset first",
    ),
    "derivative's seed": (
        lambda p, s: s.getDirectionalDerivative([24], [0], [1.0], 3),
        "there are 1 values for variables of 3 elements",
    ),
    "derivative of an input": (
        lambda p, s: s.getDirectionalDerivative([0], [0], [1.0] * 3, 3),
        "needed is an output",
    ),
    "adjoint derivative": (
        lambda p, s: s.getAdjointDerivative([24], [0], [1.0] * 3),
        "this FMU has directional ones",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_refused_call_says_why_and_changes_nothing(pair, capfd, name):
    call, sentence = REFUSED[name]
    slave = pair.started()
    before = pair.everything(slave)
    with pytest.raises(FMICallException):
        call(pair, slave)
    assert sentence in capfd.readouterr().err
    assert pair.everything(slave) == before
    slave.doStep(0.0, STEP)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"token": "{0}"}, "the GUID is {0}; this FMU's resources belong to {"),
        ({"eventModeUsed": True}, "event mode is asked for; this FMU has none"),
        ({"requiredIntermediateVariables": [0]}, "intermediate variables are asked for"),
    ],
)
def test_an_instance_that_cannot_be_is_refused_with_a_sentence(pair, capfd, options, sentence):
    with pytest.raises(Exception, match="Failed to instantiate"):
        pair.fmi3(**options)
    assert sentence in capfd.readouterr().err


def test_sentences_go_to_the_masters_log_where_it_is_on(pair, capfd):
    said = []
    slave = pair.fmi3(loggingOn=True, logMessage=lambda *message: said.append(message))
    with pytest.raises(FMICallException):
        slave.doStep(0.0, STEP)
    assert len(said) == 1
    assert said[0][2] == b"logStatusError"
    assert b"before initialisation has ended" in said[0][3]
    assert "initialisation" not in capfd.readouterr().err


def test_sanitizers_find_nothing_in_random_calls(pair, tmp_path):
    """Address and undefined behaviour; buffers of exactly the size that the FMU is told."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler named cc")
    flags = ["-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-Werror"]
    flags += ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    files = [TESTS / "native" / "host3.c", *STANDARDS["3"].sources()]
    host = tmp_path / "host3"
    include = f"-I{SOURCES / 'fmi'}"
    subprocess.run([compiler, *flags, include, "-o", host, *files, "-lm"], check=True)
    resources = pair.folder3 / "resources"
    for folder, calls in ((f"{resources}/", "1000"), (str(resources), "20")):
        done = subprocess.run(
            [host, pair.description.guid, folder, calls],
            env={},
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith(f"{calls} calls")


@pytest.mark.skipif(
    not EMULATORS or shutil.which("wine") is None,
    reason="run by `make emulators`; needs ziglang and wine",
)
def test_a_windows_path_of_the_resources_is_taken_in_wine(pair, tmp_path):
    """With backslashes and one at the end, as FMI 3.0 wants it there; the same random calls."""
    files = [str(file) for file in (TESTS / "native" / "host3.c", *STANDARDS["3"].sources())]
    target = ["-target", PLATFORMS["win64"].target, "-o", str(tmp_path / "host3.exe")]
    flags = [*target, "-std=c99", "-O1", "-fno-sanitize=all", f"-I{SOURCES / 'fmi'}"]
    subprocess.run([*zig(), *flags, *files], cwd=tmp_path, check=True)
    resources = f"Z:{pair.folder3 / 'resources'}/".replace("/", "\\")
    done = subprocess.run(
        [shutil.which("wine"), "host3.exe", pair.description.guid, resources, "200"],
        cwd=tmp_path,
        env={**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all"},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("200 calls")


def test_fmi3_is_for_native_fmus(example, tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu"), "--fmi", "3"]) == 2
    assert "add --kind native" in capsys.readouterr().err
    with pytest.raises(BuildError, match="FMI version: expected one of 2, 3, got '1'"):
        build_fmu(example, tmp_path / "R.fmu", BuildOptions("native", fmi="1"))
    assert not list(tmp_path.iterdir())
