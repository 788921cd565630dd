"""The native FMU beyond the contract that it shares with the one in Python."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import fmpy.validation
import numpy as np
import pytest
from emulators import EMULATORS
from fmpy.fmi2 import FMU2Slave
from places import TESTS
from random_robots import make_robot

from build_fmu import main
from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.compiler import (
    PLATFORMS,
    SOURCES,
    CompilerError,
    compile_library,
    host_platform,
    zig,
)
from coupling.fmu_export.native_standards import STANDARDS
from elastic_robot.fmi.interface import blocks
from elastic_robot.robot import ElasticRobot
from elastic_robot.trajectory import HeldCommand

POSTURE = [0.0, -0.3, 0.5, 0.0, 0.6, 0.0]
FORCE_Z, Q_CMD, TCP, STRINGS = 2, 6, 24, 94
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g", "-O1")


class Unpacked:
    """An FMU's folder, its GUID and library."""

    def __init__(self, file: Path, folder: Path) -> None:
        fmpy.extract(str(file), unzipdir=str(folder))
        self.folder = folder
        self.guid = fmpy.read_model_description(str(folder)).guid
        platform = host_platform()
        self.library = folder / "binaries" / platform.name / f"ElasticRobot{platform.suffix}"
        self.resources = (folder / "resources").as_uri()

    def slave(self) -> FMU2Slave:
        """An instance through FMPy."""
        slave = FMU2Slave(
            guid=self.guid,
            unzipDirectory=str(self.folder),
            modelIdentifier="ElasticRobot",
            instanceName="robot",
        )
        slave.instantiate()
        return slave


@pytest.fixture(scope="session")
def unpacked(example, tmp_path_factory) -> Unpacked:
    folder = tmp_path_factory.mktemp("native")
    return Unpacked(
        build_fmu(example, folder / "Robot.fmu", BuildOptions("native")), folder / "fmu"
    )


def start(slave: FMU2Slave, q=POSTURE, time=0.0, **strings: str) -> FMU2Slave:
    slave.setupExperiment(startTime=time)
    names = ["trajectory", "torque_curve", "mode", "initial_state"]
    for name, value in strings.items():
        slave.setString([STRINGS + names.index(name)], [value])
    slave.enterInitializationMode()
    slave.setReal(list(range(Q_CMD, Q_CMD + len(q))), list(q))
    slave.exitInitializationMode()
    return slave


# Root of the emulated system's own libraries (Debian's libc6-arm64-cross).
AARCH64_ROOT = Path("/usr/aarch64-linux-gnu")


def _compiler() -> str:
    found = shutil.which("cc")
    if found is None:
        pytest.skip("needs a C compiler named cc for the test's own host")
    return found


@pytest.fixture(scope="session")
def c_host(tmp_path_factory) -> Path:
    return _build_host(tmp_path_factory.mktemp("host") / "host")


def _build_host(file: Path, *flags: str) -> Path:
    command = [_compiler(), "-std=c99", "-O1", "-Wall", "-Wextra", f"-I{SOURCES / 'fmi'}", *flags]
    command += ["-o", str(file), str(TESTS / "native" / "host.c"), "-ldl", "-lm", "-lpthread"]
    subprocess.run(command, check=True)
    return file


def _run_host(unpacked: Unpacked, command: list[str], *script: str) -> str:
    """Run in an empty environment: no PATH, no locale, no library paths."""
    done = subprocess.run(
        [*command, str(unpacked.library), unpacked.guid, unpacked.resources, *script],
        env={},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_c_host_in_an_empty_environment_gets_the_poses_of_the_python_model(
    unpacked, c_host, example
):
    """200 steps of 4 ms under a pulsed force, with backlash, to twice the tolerance."""
    poses = np.loadtxt(_run_host(unpacked, [str(c_host)], "run").splitlines(), delimiter=",")
    robot = ElasticRobot(example)
    q = np.array(POSTURE)
    command = HeldCommand(0.0, q, np.zeros(6), np.zeros(6))
    robot.reset(0.0, command, np.zeros(6))
    for k in range(200):
        force = np.array([0.0, 0.0, -500.0 * (k % 7 < 3), 0.0, 0.0, 0.0])
        robot.step(0.004 * (k + 1), HeldCommand(robot.time, q, 0 * q, 0 * q), force)
        np.testing.assert_allclose(poses[k, :3], robot.tcp()[:3], rtol=0, atol=2e-6)


def test_three_instances_in_threads_are_independent(unpacked, c_host):
    _run_host(unpacked, [str(c_host)], "threads")


def test_random_calls_neither_crash_nor_give_values_that_are_not_finite(unpacked, c_host):
    said = _run_host(unpacked, [str(c_host)], "fuzz", "5000")
    assert said.startswith("5000 calls")


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler named cc")
def test_address_and_undefined_behaviour_sanitizers_find_nothing(unpacked, tmp_path):
    library = compile_library(host_platform(), STANDARDS["2"].sources(), SANITIZERS, cache=tmp_path)
    checked = Unpacked.__new__(Unpacked)
    checked.library, checked.guid, checked.resources = library, unpacked.guid, unpacked.resources
    host = _build_host(tmp_path / "host", *SANITIZERS)
    for script in (["run"], ["fuzz", "500"]):
        _run_host(checked, [str(host)], *script)


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind")
def test_valgrind_finds_no_error_and_no_leak(unpacked, c_host):
    command = [
        "--error-exitcode=9",
        "--leak-check=full",
        "--errors-for-leak-kinds=definite,indirect,possible",
        "-q",
    ]
    found = [shutil.which("valgrind"), *command, str(c_host)]
    _run_host(unpacked, found, "run")
    _run_host(unpacked, found, "fuzz", "300")


def test_the_library_needs_nothing_but_libc_and_libm(unpacked):
    objdump = shutil.which("objdump")
    if objdump is None or host_platform().suffix != ".so":
        pytest.skip("needs objdump on Linux")
    shown = subprocess.run([objdump, "-p", unpacked.library], capture_output=True, text=True)
    needed = set(re.findall(r"NEEDED\s+(\S+)", shown.stdout))
    assert needed <= {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
    symbols = subprocess.run([objdump, "-T", unpacked.library], capture_output=True, text=True)
    defined = re.findall(r" g .*\.text\s.*\s(\S+)$", symbols.stdout, re.MULTILINE)
    assert defined
    assert all(name.startswith("fmi2") for name in defined)


def test_the_core_has_no_mutable_global_state(unpacked):
    """Nothing of its own in .data or .bss; constants that need relocation are in .data.rel.ro."""
    objdump = shutil.which("objdump")
    if objdump is None or host_platform().suffix != ".so":
        pytest.skip("needs objdump on Linux")
    shown = subprocess.run([objdump, "-t", unpacked.library], capture_output=True, text=True)
    symbols = re.findall(r" O (\.data|\.bss)\s+\S+\s+(?:\.hidden )?(\S+)$", shown.stdout, re.M)
    linkers = {"completed.0", "__dso_handle", "__TMC_END__"}
    assert ".text" in shown.stdout
    assert {name for _, name in symbols} <= linkers


def test_contents_are_valid_and_complete(example, tmp_path):
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("native", sources=True))
    assert fmpy.validation.validate_fmu(str(file)) == []
    with zipfile.ZipFile(file) as archive:
        names = set(archive.namelist())
        text = archive.read("documentation/licenses/fmi-headers.txt").decode()
        xml = archive.read("modelDescription.xml")
    assert "Modelica Association" in text
    assert "2-Clause BSD" in text
    assert {"resources/robot.txt", "sources/fmi/fmi2.c", "sources/fmi/fmi2Functions.h"} <= names
    description = fmpy.read_model_description(str(file))
    listed = re.findall(rb'<File name="(\S+)"', xml)
    assert {name.decode() for name in listed} == {
        s.relative_to(SOURCES).as_posix() for s in STANDARDS["2"].sources()
    }
    assert description.coSimulation.providesDirectionalDerivative


def test_the_packed_sources_compile_to_the_library_by_themselves(example, tmp_path, c_host):
    """As a master does it: the listed files, the folder of sources alone, no flags of ours."""
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("native", sources=True))
    fmu = Unpacked(file, tmp_path / "fmu")
    xml = (fmu.folder / "modelDescription.xml").read_text()
    sources = [
        str(fmu.folder / "sources" / name) for name in re.findall(r'<File name="(\S+)"', xml)
    ]
    fmu.library = tmp_path / "own.so"
    command = [
        _compiler(),
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-pedantic",
        "-fPIC",
        "-shared",
    ]
    subprocess.run([*command, "-o", str(fmu.library), *sources, "-lm"], check=True)
    _run_host(fmu, [str(c_host)], "run")


def test_both_kinds_have_the_same_variables(example, tmp_path):
    kinds = [
        fmpy.read_model_description(
            str(build_fmu(example, tmp_path / f"{kind}.fmu", BuildOptions(kind)))
        )
        for kind in ("python", "native")
    ]
    one, two = (
        [
            (v.name, v.valueReference, v.causality, v.variability, v.unit, v.start)
            for v in d.modelVariables
        ]
        for d in kinds
    )
    assert one == two


def test_names_and_units_in_messages_are_those_of_the_table(tmp_path):
    """Every real in turn is set to NaN; the sentence names it as the table does, with its unit."""
    robot = make_robot(3, 5)
    fmu = Unpacked(build_fmu(robot, tmp_path / "R.fmu", BuildOptions("native")), tmp_path / "fmu")
    slave, said = fmu.slave(), []
    table = blocks(robot)
    strings = table.pop("strings")
    assert [v.name for v in strings.variables] == [
        "trajectory",
        "torque_curve",
        "mode",
        "initial_state",
    ]
    reals = [(b, v) for b in table.values() for v in b.variables]
    read, write = os.pipe()
    stderr = os.dup(2)
    os.dup2(write, 2)
    try:
        for reference in range(len(reals)):
            with pytest.raises(fmpy.fmi1.FMICallException):
                slave.setReal([reference], [float("nan")])
            said.append(os.read(read, 10000).decode())
    finally:
        os.dup2(stderr, 2)
    for (block, variable), text in zip(reals, said, strict=True):
        if block.causality == "output":
            assert f"robot: {variable.name} is an output and cannot be set" in text
        else:
            sentence = f"robot: {variable.name} is nan {variable.unit}; needed is a finite number"
            assert sentence in text
    slave.freeInstance()


def test_a_locale_with_decimal_commas_changes_nothing(unpacked, tmp_path):
    """The same CSV read under de_DE.UTF-8 if the machine has it, else any with a comma."""
    import locale

    line = "{0},0,-0.3125,0.5,0,{1},0\n"
    file = tmp_path / "motion.csv"
    file.write_text(
        "time,q1,q2,q3,q4,q5,q6\n"
        + line.format("0.0", "0.6789123456789012345")
        + line.format("1.5", "0.7")
    )
    slave = start(unpacked.slave(), trajectory=str(file))
    expected = slave.getReal(list(range(TCP, TCP + 7)))
    names = ("de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "ru_RU.UTF-8")
    for name in names:
        try:
            locale.setlocale(locale.LC_NUMERIC, name)
            break
        except locale.Error:
            continue
    else:
        pytest.skip("needs a locale with a decimal comma")
    try:
        slave = start(unpacked.slave(), trajectory=str(file))
        assert slave.getReal(list(range(TCP, TCP + 7))) == expected
    finally:
        locale.setlocale(locale.LC_NUMERIC, "C")


def test_paths_of_any_characters_are_taken(example, tmp_path):
    """A folder with blanks, umlauts, per cent and plus; the URI encodes it or not."""
    folder = tmp_path / "a b äö 100%41 + c"
    fmu = Unpacked(build_fmu(example, tmp_path / "R.fmu", BuildOptions("native")), folder)
    slave = start(fmu.slave())
    assert np.isfinite(slave.getReal([TCP])[0])


@pytest.mark.parametrize("curve", ["linear", "backlash", "spline"])
@pytest.mark.parametrize("when", ["at the start", "after a step", "at rest"])
def test_directional_derivatives_are_those_of_the_whole_step(unpacked, curve, when):
    """Against differences of four points through the FMU itself: other inputs from a saved state.

    The differences' own error, h^4 and rounding over h, stays below 1e-6 of the largest entry.
    """
    outputs = [*range(TCP, TCP + 10), *range(TCP + 17, TCP + 20)]
    strings = {"torque_curve": curve, "mode": "quasistatic" if when == "at rest" else "dynamic"}
    slave = start(unpacked.slave(), **strings)
    wrench, steps = [30.0, -20.0, -400.0, 5.0, 3.0, 1.0], (0.006, 0.004)
    if when == "at the start":
        slave = unpacked.slave()
        slave.setupExperiment(startTime=0.0)
        slave.setString([STRINGS + 1], [curve])
        slave.enterInitializationMode()
        slave.setReal(list(range(Q_CMD, Q_CMD + 6)), POSTURE)

        def result(inputs):
            slave.setReal(list(inputs), list(inputs.values()))
            return np.array(slave.getReal(outputs))
    else:
        slave.setReal(list(range(6)), wrench)
        slave.doStep(0.0, steps[0])
        before = slave.getFMUState()

        def result(inputs):
            slave.setFMUState(before)
            slave.setReal(list(inputs), list(inputs.values()))
            slave.doStep(steps[0], steps[1])
            return np.array(slave.getReal(outputs))

    base = dict(zip(range(24), [*wrench, *POSTURE, *[0.05] * 6, *[0.3] * 6], strict=True))
    for known, h in ((FORCE_Z, 40.0), (4, 40.0), (Q_CMD + 1, 4e-5), (13, 4e-3), (20, 0.4)):
        if when == "at the start" and known == 20:
            continue  # the initial state does not follow the drives' acceleration
        moved = [result({**base, known: base[known] + f * h}) for f in (-2, -1, 1, 2)]
        expected = (moved[0] - 8.0 * moved[1] + 8.0 * moved[2] - moved[3]) / (12.0 * h)
        result(base)
        found = np.array(slave.getDirectionalDerivative(outputs, [known], [1.0]))
        scale = np.abs(expected).max()
        assert scale > 0.0
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * scale)


def test_derivatives_leave_the_instance_as_it_was(unpacked):
    slave = start(unpacked.slave())
    twin = start(unpacked.slave())
    for k in range(20):
        for one in (slave, twin):
            one.setReal([FORCE_Z], [-400.0 * (k % 7 < 3)])
            one.doStep(0.004 * k, 0.004)
        slave.getDirectionalDerivative([TCP], [FORCE_Z, Q_CMD], [1.0, 0.1])
        everything = list(range(STRINGS))
        assert slave.getReal(everything) == twin.getReal(everything)


@pytest.mark.parametrize(
    ("unknown", "known", "message"),
    [(FORCE_Z, TCP, "needed is an output"), (TCP, TCP, "needed is an input")],
)
def test_derivatives_of_other_variables_are_refused(unpacked, capfd, unknown, known, message):
    slave = start(unpacked.slave())
    with pytest.raises(fmpy.fmi1.FMICallException):
        slave.getDirectionalDerivative([unknown], [known], [1.0])
    assert message in capfd.readouterr().err


def test_misuse_of_the_life_cycle_is_refused_with_a_sentence(unpacked, capfd):
    slave = unpacked.slave()
    for call, message in (
        (lambda: slave.doStep(0.0, 0.01), "before initialisation has ended"),
        (lambda: start(slave) and slave.doStep(0.5, 0.01), "the step starts at 0.5 s; needed is"),
        (lambda: slave.doStep(0.0, -0.01), "step size is -0.01 s"),
        (lambda: slave.doStep(0.0, float("nan")), "step size is nan s"),
        (lambda: slave.setString([STRINGS], ["x.csv"]), "strings are fixed"),
        (lambda: slave.setupExperiment(startTime=1.0), "set up after initialisation"),
        (lambda: slave.getReal([94]), "94 is asked for as a real variable; this FMU has 0 to 93"),
        (
            lambda: slave.getString([93]),
            "93 is asked for as a string variable; this FMU has 94 to 97",
        ),
        (lambda: slave.getInteger([3]), "integer variable 3 is asked for"),
    ):
        with pytest.raises(fmpy.fmi1.FMICallException):
            call()
        assert message in capfd.readouterr().err


def test_a_motion_that_cannot_be_integrated_is_given_up(unpacked, capfd):
    """A force of 1e12 N turns the arm over within nanoseconds: an error soon, and the state kept."""
    slave = start(unpacked.slave())
    before = slave.getReal(list(range(TCP, TCP + 7)))
    slave.setReal([FORCE_Z], [1e12])
    with pytest.raises(fmpy.fmi1.FMICallException):
        slave.doStep(0.0, 0.1)
    assert "it is unstable or the load is not physical" in capfd.readouterr().err
    slave.setReal([FORCE_Z], [0.0])
    slave.doStep(0.0, 0.001)
    after = slave.getReal(list(range(TCP, TCP + 7)))
    np.testing.assert_allclose(after, before, rtol=0, atol=1e-12)


def test_kinds_agree_on_random_robots(tmp_path):
    """Dynamic, a trajectory, a wrench and changed parameters: the native FMU and the Python model.

    Both at 1e-8 m; they may differ by the sum.
    """
    rng = np.random.default_rng(5)
    for seed in (2, 5, 8):
        robot = make_robot(seed, 3)
        table = blocks(robot)
        fmu = Unpacked(
            build_fmu(robot, tmp_path / f"{seed}.fmu", BuildOptions("native")), tmp_path / f"{seed}"
        )
        time = np.linspace(0.0, 0.3, 16)
        q = np.cumsum(0.01 * rng.normal(size=(16, 3)), axis=0)
        columns = ["time", "q1", "q2", "q3"]
        np.savez(tmp_path / "t.npz", columns=columns, data=np.column_stack([time, q]))
        references = {}
        for block in table.values():
            for variable in block.variables:
                references[variable.name] = len(references)
        from elastic_robot.trajectory import Trajectory

        drives, wrench = Trajectory(time, q), rng.normal(size=6) * 100.0
        python = ElasticRobot(robot, "backlash", tolerance=1e-8)
        stiffness = 0.7 * python.parameters.stiffness
        python.parameters = replace(python.parameters, stiffness=stiffness)
        python.reset(0.0, drives, np.zeros(6))
        slave = fmu.slave()
        slave.setupExperiment(startTime=0.0, tolerance=1e-8)
        slave.setString([references["trajectory"]], [str(tmp_path / "t.npz")])
        slave.enterInitializationMode()
        names = [v.name for v in table["stiffness"].variables]
        slave.setReal([references[name] for name in names], stiffness.tolist())
        slave.exitInitializationMode()
        tcp = [references[f"tcp.{c}"] for c in ("x", "y", "z", "qx", "qy", "qz", "qw")]
        for k in range(1, 16):
            load = wrench * (k % 4 < 2)
            python.step(float(time[k]), drives, load)
            slave.setReal(list(range(6)), load.tolist())
            slave.doStep(time[k - 1], time[k] - time[k - 1])
            np.testing.assert_allclose(slave.getReal(tcp), python.tcp(), rtol=0, atol=2e-8)


def test_unknown_kinds_and_platforms_are_refused(example, tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "native", "--platforms", "vax"]) == 2
    said = capsys.readouterr().err
    assert "platform: expected one of linux64, win64" in said
    assert "got 'vax'" in said
    assert main(["-o", str(tmp_path / "R.fmu"), "--platforms", "darwin64"]) == 2
    assert "PythonFMU has libraries for, linux64, win64, got 'darwin64'" in capsys.readouterr().err
    assert main(["-o", str(tmp_path / "R.fmu"), "--sources"]) == 2
    assert "add --kind native" in capsys.readouterr().err
    with pytest.raises(BuildError, match="kind: expected one of python, native, got 'java'"):
        build_fmu(example, tmp_path / "R.fmu", BuildOptions("java"))
    assert not list(tmp_path.iterdir())


def test_libraries_are_compiled_once(tmp_path):
    """The cache's key follows sources and flags."""
    source = tmp_path / "one.c"
    source.write_text("int one(void) { return 1; }")
    first = compile_library(host_platform(), [source], cache=tmp_path / "cache")
    stamp = first.stat().st_mtime_ns
    assert compile_library(host_platform(), [source], cache=tmp_path / "cache") == first
    assert first.stat().st_mtime_ns == stamp
    other = compile_library(host_platform(), [source], ["-DX"], cache=tmp_path / "cache")
    source.write_text("int one(void) { return 2; }")
    changed = compile_library(host_platform(), [source], cache=tmp_path / "cache")
    assert len({first, other, changed}) == 3
    source.write_text("not C")
    with pytest.raises(CompilerError, match=r"failed for"):
        compile_library(host_platform(), [source], cache=tmp_path / "cache")


def test_without_a_compiler_the_need_is_told(monkeypatch):
    monkeypatch.setattr("coupling.fmu_export.compiler.zig", lambda: None)
    other = next(p for p in PLATFORMS.values() if p != host_platform())
    with pytest.raises(CompilerError, match=r"install cc, gcc or clang .* ziglang"):
        compile_library(other, [])


MAGIC = {
    "linux64": b"\x7fELF",
    "aarch64-linux": b"\x7fELF",
    "win64": b"MZ",
    "darwin64": b"\xcf\xfa\xed\xfe",
    "aarch64-darwin": b"\xcf\xfa\xed\xfe",
}


@pytest.mark.skipif(not EMULATORS, reason="run by `make emulators`; needs ziglang")
@pytest.mark.parametrize("name", PLATFORMS)
@pytest.mark.parametrize("fmi", STANDARDS)
def test_libraries_for_other_platforms_are_made_here(name, fmi, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    library = compile_library(PLATFORMS[name], STANDARDS[fmi].sources())
    assert library.read_bytes().startswith(MAGIC[name])
    assert not list(tmp_path.iterdir())  # nothing is left where it was asked for


@pytest.mark.skipif(
    not EMULATORS or shutil.which("qemu-aarch64") is None or not AARCH64_ROOT.is_dir(),
    reason="run by `make emulators`; needs ziglang, qemu-user and libc6-arm64-cross",
)
def test_the_aarch64_library_gives_the_same_poses_in_an_emulator(
    unpacked, c_host, example, tmp_path
):
    """Other instructions and another libm round otherwise: 1e-10 m after 200 steps."""
    name = "aarch64-linux"
    fmu = build_fmu(example, tmp_path / "A.fmu", BuildOptions("native", (name,)))
    fmpy.extract(str(fmu), unzipdir=str(tmp_path / "fmu"))
    other = Unpacked.__new__(Unpacked)
    other.library = tmp_path / "fmu" / "binaries" / name / "ElasticRobot.so"
    other.guid = fmpy.read_model_description(str(fmu)).guid
    other.resources = (tmp_path / "fmu" / "resources").as_uri()
    target = ["-target", PLATFORMS[name].target.rpartition(".2.")[0], "-o", str(tmp_path / "host")]
    source = [f"-I{SOURCES / 'fmi'}", str(TESTS / "native" / "host.c"), "-lm"]
    subprocess.run([*zig(), *target, "-std=c99", "-O1", *source], cwd=tmp_path, check=True)
    emulated = [shutil.which("qemu-aarch64"), "-L", str(AARCH64_ROOT), str(tmp_path / "host")]
    found, expected = (
        np.loadtxt(_run_host(f, command, "run").splitlines(), delimiter=",")
        for f, command in ((other, emulated), (unpacked, [str(c_host)]))
    )
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


WINDOWS_HOST = """
#include <stdio.h>
#include <windows.h>
#include "fmi2Functions.h"
int main(int count, char **arguments)
{
    HMODULE library = LoadLibraryA(arguments[1]);
    fmi2CallbackFunctions none = {0};
    fmi2ValueReference z = 26;
    double value = 0.0;
    fmi2Component robot;
    (void)count;
    if (library == NULL)
        return 1;
#define GET(name) name##TYPE *name##_ = (name##TYPE *)(void *)GetProcAddress(library, #name)
    GET(fmi2Instantiate);
    GET(fmi2SetupExperiment);
    GET(fmi2ExitInitializationMode);
    GET(fmi2DoStep);
    GET(fmi2GetReal);
    robot = fmi2Instantiate_("r", fmi2CoSimulation, arguments[2], arguments[3], &none, 0, 0);
    if (robot == NULL)
        return 2;
    fmi2SetupExperiment_(robot, 0, 0.0, 0.0, 0, 0.0);
    fmi2ExitInitializationMode_(robot);
    for (int k = 0; k < 100; k++)
        if (fmi2DoStep_(robot, 0.004 * k, 0.004, 1) != fmi2OK)
            return 3;
    fmi2GetReal_(robot, &z, 1, &value);
    printf("%.17g\\n", value);
    return 0;
}
"""


@pytest.mark.skipif(
    not EMULATORS or shutil.which("wine") is None,
    reason="run by `make emulators`; needs ziglang and wine",
)
def test_the_windows_library_runs_in_wine(unpacked, example, tmp_path):
    """Height of the TCP at rest after 100 steps, as here to 1e-12 m."""
    fmu = build_fmu(example, tmp_path / "W.fmu", BuildOptions("native", ("win64",)))
    fmpy.extract(str(fmu), unzipdir=str(tmp_path / "fmu"))
    guid = fmpy.read_model_description(str(fmu)).guid
    (tmp_path / "host.c").write_text(WINDOWS_HOST)
    target = ["-target", PLATFORMS["win64"].target, "-o", str(tmp_path / "host.exe")]
    source = [f"-I{SOURCES / 'fmi'}", str(tmp_path / "host.c")]
    subprocess.run([*zig(), *target, "-std=c99", *source], cwd=tmp_path, check=True)
    library = "Z:" + str(tmp_path / "fmu" / "binaries" / "win64" / "ElasticRobot.dll").replace(
        "/", "\\"
    )
    resources = "file:///Z:" + str(tmp_path / "fmu" / "resources")
    done = subprocess.run(
        [shutil.which("wine"), str(tmp_path / "host.exe"), library, guid, resources],
        env={**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all"},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, (done.returncode, done.stdout, done.stderr)
    slave = start(unpacked.slave(), q=[0.0] * 6)
    for k in range(100):
        slave.doStep(0.004 * k, 0.004)
    assert float(done.stdout) == pytest.approx(slave.getReal([26])[0], abs=1e-12)
