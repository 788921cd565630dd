"""The library in front of PythonFMU's: what it passes on, and what it cures."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from emulators import EMULATORS
from native_fmu import build_master
from places import TESTS

from build_fmu import main
from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.python_host import host_library, without_host
from coupling.native import compiler
from coupling.native.compiler import PLATFORMS, SOURCES, host_platform, zig
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="PythonFMU has a library for Linux"),
    pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler named cc"),
]
POSTURE = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])


@pytest.fixture(scope="module")
def fmu(example, tmp_path_factory) -> Path:
    return build_fmu(example, tmp_path_factory.mktemp("fmu") / "Robot.fmu", BuildOptions("python"))


@pytest.fixture(scope="module")
def c_host(tmp_path_factory) -> Path:
    return build_master("host", tmp_path_factory.mktemp("host") / "host")


def run_c(c_host, fmu, folder, script, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a host without Python in an environment that is empty but for the one given."""
    fmpy.extract(str(fmu), unzipdir=str(folder))
    guid = fmpy.read_model_description(str(folder)).guid
    library = folder / "binaries" / host_platform().name / "ElasticRobot.so"
    return subprocess.run(
        [str(c_host), str(library), guid, (folder / "resources").as_uri(), script],
        env=environment,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=120,
    )


def test_a_c_host_in_an_empty_environment_gets_the_poses_of_the_model(
    fmu, c_host, example, tmp_path
):
    """One variable tells where Python and its packages are; 100 steps with backlash, to rounding.

    The FMU's drives go from command to command, which at rest adds zeros.
    """
    done = run_c(c_host, fmu, tmp_path, "run", ELASTIC_ROBOT_PYTHON=sys.executable)
    assert done.returncode == 0, done.stderr
    poses = np.loadtxt(done.stdout.splitlines(), delimiter=",")
    robot = ElasticRobot(example)
    robot.reset(0.0, HeldCommand(0.0, POSTURE, 0 * POSTURE, 0 * POSTURE), Load())
    for k in range(100):
        force = np.array([0.0, 0.0, -500.0 * (k % 7 < 3), 0.0, 0.0, 0.0])
        drives = HeldCommand(robot.time, POSTURE, 0 * POSTURE, 0 * POSTURE)
        robot.step(k * 0.004 + 0.004, drives, Load(force))
        np.testing.assert_allclose(poses[k], robot.tcp(), rtol=0, atol=1e-14)


def test_three_threads_of_a_c_host_get_the_same_poses(fmu, c_host, tmp_path):
    done = run_c(c_host, fmu, tmp_path, "threads", ELASTIC_ROBOT_PYTHON=sys.executable)
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(sys.prefix == sys.base_prefix, reason="needs a virtual environment")
def test_a_virtual_environment_is_found_by_its_variable(fmu, c_host, tmp_path):
    done = run_c(c_host, fmu, tmp_path, "run", VIRTUAL_ENV=sys.prefix)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("named", ["/nowhere/python3.11", "/bin/sh"])
def test_a_host_whose_python_is_none_is_told_what_is_expected(fmu, c_host, tmp_path, named):
    done = run_c(c_host, fmu, tmp_path, "run", ELASTIC_ROBOT_PYTHON=named)
    assert "robot: ELASTIC_ROBOT_PYTHON: expected a Python program, python3.11" in done.stderr
    assert f"that has a shared library (libpython3), got '{named}'" in done.stderr
    assert done.returncode == 1  # the host's, as it got no instance


def test_every_function_is_passed_on_with_its_arguments_and_status(run_host, tmp_path, monkeypatch):
    """With a library in PythonFMU's place that tells what reaches it."""
    library, inner = tmp_path / "Robot.so", tmp_path / "Robot_pythonfmu.so"
    shutil.copy(host_library(host_platform()), library)
    command = ["cc", "-std=c99", "-shared", "-fPIC", f"-I{SOURCES / 'fmi'}", "-o", str(inner)]
    subprocess.run([*command, str(TESTS / "native" / "inner.c")], check=True)
    resources, log = tmp_path / "resources", tmp_path / "log"
    resources.mkdir()
    (resources / "slavemodule.txt").write_text("slave\n")
    (resources / "guid.txt").write_text("{right}\n")
    monkeypatch.setenv("INNER_LOG", str(log))
    run_host("passing_on", library, inner, resources.as_uri(), log)
    # At the end Python is let go of once before the variables that hold it are destroyed.
    assert log.read_text() == "forget Python\nvariables destroyed\n"


def test_many_instances_are_unloaded_and_the_process_ends_in_the_ordinary_way(fmu, run_host):
    for _ in range(2):
        assert run_host("ends", fmu, 12).endswith("the end\n")


def test_a_folder_may_have_any_name(fmu, tmp_path, forked):
    """PythonFMU's own library crashes on most of these letters."""
    script = tmp_path / "simulated.py"
    script.write_text("""
import sys
import fmpy
folder = fmpy.extract(sys.argv[1], unzipdir=sys.argv[2])
print(fmpy.simulate_fmu(folder, stop_time=0.01, output=["tcp.z"])[-1]["tcp.z"])
""")
    folder = tmp_path / "Größe #1 100% (é) ñ"
    done = forked(script, fmu, folder)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) > 0.5


@pytest.mark.parametrize("changed", ["elastic_robot/errors.py", "elastic_robot_slave.py"])
def test_an_fmu_of_another_version_is_refused_in_the_same_process(fmu, tmp_path, run_host, changed):
    """Python has one module of a name; the slave's own changes come with the model's."""
    other = tmp_path / "Other.fmu"
    with zipfile.ZipFile(fmu) as archive, zipfile.ZipFile(other, "w") as written:
        for name in archive.namelist():
            new = name.endswith((changed, "elastic_robot/errors.py"))
            written.writestr(name, archive.read(name) + b"# of another version\n" * new)
    said = run_host("two_versions", fmu, other)
    assert "got another version that this process has loaded" in said


def test_without_a_compiler_pythonfmus_library_stands_alone(
    example, tmp_path, monkeypatch, capsys, run_host
):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compiler, "zig", lambda: None)
    file = tmp_path / "Plain.fmu"
    assert main(["-o", str(file), "--kind", "python"]) == 0
    assert "linux64, win64: PythonFMU's library alone" in capsys.readouterr().out
    assert without_host(file, "ElasticRobot") == ["linux64", "win64"]
    run_host("alone", file)
    with pytest.raises(BuildError, match="there is no C compiler for linux64"):
        build_fmu(example, tmp_path / "R.fmu", BuildOptions("python", ("linux64",)))


@pytest.mark.parametrize("platform", ["darwin64", "aarch64-linux", "amiga"])
def test_platforms_that_pythonfmu_has_no_library_for_are_refused(example, tmp_path, platform):
    with pytest.raises(BuildError, match="PythonFMU has libraries for, linux64, win64, got"):
        build_fmu(example, tmp_path / "R.fmu", BuildOptions("python", (platform,)))


@pytest.mark.skipif(not EMULATORS, reason="run by `make emulators`; needs ziglang")
def test_it_is_compiled_for_all_platforms_that_pythonfmu_has_libraries_for(example, tmp_path):
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("python", ("linux64", "win64")))
    assert without_host(file, "ElasticRobot") == []
    assert host_library(PLATFORMS["win64"]).read_bytes().startswith(b"MZ")


# What python_host asks of Python on Windows: here one that runs already.
STAND_IN_FOR_PYTHON = """
__declspec(dllexport) int Py_IsInitialized(void) { return 1; }
__declspec(dllexport) void Py_InitializeEx(int signals) { (void)signals; }
__declspec(dllexport) void *PyEval_SaveThread(void) { return 0; }
"""
WINDOWS_HOST = """
#include <stdio.h>
#include <windows.h>
#include "fmi2Functions.h"

static void hear(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    printf("%d %s %s: %s\\n", status, name, category, message);
}

int main(int count, char **arguments)
{
    static const fmi2CallbackFunctions callbacks = {hear, NULL, NULL, NULL, NULL};
    HMODULE library = LoadLibraryA(arguments[1]);
    fmi2InstantiateTYPE *instantiate = (void *)GetProcAddress(library, "fmi2Instantiate");
    fmi2DoStepTYPE *step = (void *)GetProcAddress(library, "fmi2DoStep");
    fmi2FreeInstanceTYPE *release = (void *)GetProcAddress(library, "fmi2FreeInstance");
    fmi2Component c = instantiate("robot", fmi2CoSimulation, "{right}", arguments[2], &callbacks, 0, 1);
    HMODULE inner = GetModuleHandleA("Robot_pythonfmu.dll");
    if (c == NULL)
        return 3;
    *(int *)(void *)GetProcAddress(inner, "inner_answer") = fmi2Fatal;
    printf("step %d\\n", step(c, 0.5, 0.25, fmi2True));
    release(c);
    return 0;
}
"""


@pytest.mark.skipif(
    not EMULATORS or shutil.which("wine") is None,
    reason="run by `make emulators`; needs ziglang and wine",
)
def test_the_windows_library_runs_in_wine(tmp_path):
    """Between a host and stand-ins for Python and PythonFMU, which have no release for Wine here."""
    folder = tmp_path / "with blank"
    (folder / "resources").mkdir(parents=True)
    (folder / "resources" / "slavemodule.txt").write_text("slave\n")
    (folder / "resources" / "guid.txt").write_text("{right}\n")
    shutil.copy(host_library(PLATFORMS["win64"]), folder / "Robot.dll")
    (tmp_path / "python.c").write_text(STAND_IN_FOR_PYTHON)
    (tmp_path / "host.c").write_text(WINDOWS_HOST)
    compiler = [*zig(), "-target", PLATFORMS["win64"].target, "-std=c99", f"-I{SOURCES / 'fmi'}"]
    for source, made in (
        (tmp_path / "python.c", ["-shared", "-o", str(tmp_path / "python3.dll")]),
        (TESTS / "native" / "inner.c", ["-shared", "-o", str(folder / "Robot_pythonfmu.dll")]),
        (tmp_path / "host.c", ["-o", str(tmp_path / "host.exe")]),
    ):
        subprocess.run([*compiler, str(source), *made], cwd=tmp_path, check=True)
    arguments = ["with blank\\Robot.dll", (folder / "resources").as_uri().replace("///", "///Z:/")]

    def run(**environment: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [shutil.which("wine"), str(tmp_path / "host.exe"), *arguments],
            cwd=tmp_path,
            env={
                **os.environ,
                "WINEPREFIX": str(tmp_path / "wine"),
                "WINEDEBUG": "-all",
                "INNER_LOG": str(tmp_path / "log"),
                **environment,
            },
            capture_output=True,
            text=True,
            timeout=240,
        )

    done = run()
    assert (done.returncode, done.stdout) == (0, "step 3\n"), done.stderr
    reached = (tmp_path / "log").read_text().splitlines()
    assert [line.split()[0] for line in reached][:3] == [
        "fmi2Instantiate",
        "fmi2DoStep",
        "fmi2FreeInstance",
    ]
    assert reached[1] == "fmi2DoStep 0.5 0.25 1"
    elsewhere = folder / "python"
    elsewhere.mkdir()
    (tmp_path / "python3.dll").rename(elsewhere / "python3.dll")
    told = run()
    assert told.returncode == 3
    assert "4 robot logStatusFatal: expected a Python in this process or python3.dll" in told.stdout
    assert run(ELASTIC_ROBOT_PYTHON=f"Z:{elsewhere / 'python.exe'}".replace("/", "\\")).stdout == (
        "step 3\n"
    )
