"""The C core's libraries: shipped, or compiled once however many ask for them; the desk library."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from native_fmu import SANITIZERS, build_linked
from places import ROOT
from random_robots import make_robot, with_gear_parts

from build_fmu import main
from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.native_standards import STANDARDS
from coupling.inverse.link_model import LinkModel
from coupling.native import compiler, core_library
from coupling.native.compiler import (
    PLATFORMS,
    SOURCES,
    CompilerError,
    compile_library,
    host_platform,
)
from coupling.native.core_library import core_libraries, library_name
from coupling.native.desk_library import DESK_SOURCES, desk_sources
from coupling.native.desk_robot import DeskRobot
from coupling.native.robot_text import robot_text
from elastic_robot.errors import RobotFileError

# Counts its runs, takes its time, and leaves half a library where it is told to fail.
COMPILER = """
import pathlib, sys, time
here = pathlib.Path(__file__).parent
if "--version" in sys.argv:
    print((here / "version").read_text())
    sys.exit()
with open(here / "runs", "a") as runs:
    runs.write("x")
out = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
out.write_text("half")
time.sleep(0.3)
if (here / "fail").exists():
    sys.exit("no room")
out.write_text("whole")
"""
ASK = """
import sys
from pathlib import Path
from coupling.native.compiler import PLATFORMS, compile_library
assert "numpy" not in sys.modules
here = Path(sys.argv[1])
command = [sys.executable, str(here / "cc.py")]
file = compile_library(PLATFORMS["linux64"], [here / "a.c"], cache=here / "c", compiler=command)
print(file.read_text())
"""
ROUNDS = str(max(300, int(os.environ.get("ELASTIC_ROBOT_FUZZ", "0")) // 50))
SEED = os.environ.get("ELASTIC_ROBOT_FUZZ_SEED", "1")


@pytest.fixture
def slow(tmp_path) -> list[str]:
    """The command of a compiler that is slow."""
    for name, text in {"cc.py": COMPILER, "version": "1", "runs": "", "a.c": "int a;"}.items():
        (tmp_path / name).write_text(text)
    return [sys.executable, str(tmp_path / "cc.py")]


def test_two_processes_at_once_compile_once_and_read_a_whole_library(slow, tmp_path):
    """Without NumPy, as the wheel's build hook runs in an environment that has none."""
    ask = [sys.executable, "-c", ASK, str(tmp_path)]
    asked = [subprocess.Popen(ask, cwd=ROOT, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    assert [process.communicate()[0].strip() for process in asked] == ["whole", "whole"]
    assert (tmp_path / "runs").read_text() == "x"


def test_a_failed_compilation_leaves_nothing_that_is_taken_for_a_library(slow, tmp_path):
    def compile_it() -> Path:
        cache = tmp_path / "c"
        return compile_library(host_platform(), [tmp_path / "a.c"], cache=cache, compiler=slow)

    (tmp_path / "fail").touch()
    with pytest.raises(CompilerError, match=r"failed for .*\nno room"):
        compile_it()
    (tmp_path / "fail").unlink()
    assert compile_it().read_text() == "whole"


def test_another_version_of_the_compiler_makes_another_library(slow, tmp_path):
    def place() -> Path:
        compiler._version.cache_clear()
        return compiler.library_file(host_platform(), [tmp_path / "a.c"], slow)

    first = place()
    (tmp_path / "version").write_text("2")
    assert place() != first
    (tmp_path / "version").write_text("1")
    assert place() == first


def test_a_cache_that_cannot_be_written_is_named(slow, tmp_path):
    cache = tmp_path / "a.c"
    with pytest.raises(CompilerError, match=r"a\.c: cannot be written: .*exists"):
        compile_library(host_platform(), [tmp_path / "a.c"], cache=cache, compiler=slow)


@pytest.mark.skipif(compiler.zig() is None, reason="needs ziglang")
@pytest.mark.parametrize("name", ["linux64", "aarch64-darwin"])
def test_a_library_is_the_same_wherever_it_is_made(tmp_path, name):
    """So that FMUs of one version of the project are, whoever builds them; and it names no folder."""
    platform, made = PLATFORMS[name], []
    for folder in (tmp_path / "here", tmp_path / "elsewhere"):
        folder.mkdir()
        source = folder / "a.c"
        source.write_text('__attribute__((visibility("default"))) int a(int x) { return x; }')
        command = compiler.portable_compiler(platform)
        flags, cache = core_library._flags(platform), folder / "cache"
        file = compile_library(platform, [source], flags, cache, compiler=command)
        made.append(file.read_bytes())
    assert made[0] == made[1]
    assert str(tmp_path).encode() not in made[0]


@pytest.fixture
def no_compiler(monkeypatch):
    monkeypatch.setattr(compiler, "zig", lambda: None)
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)


@pytest.mark.parametrize("fmi", STANDARDS)
def test_shipped_libraries_of_all_platforms_are_taken_without_a_compiler(
    no_compiler, monkeypatch, example, tmp_path, fmi
):
    monkeypatch.setattr(core_library, "SHIPPED", tmp_path)
    for platform in PLATFORMS.values():
        (tmp_path / library_name(platform)).write_text(platform.machine)
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("native", tuple(PLATFORMS), fmi=fmi))
    with zipfile.ZipFile(file) as archive:
        names = [name for name in archive.namelist() if name.startswith("binaries/")]
        found = {name: archive.read(name).decode() for name in names}
    assert found == {
        f"binaries/{STANDARDS[fmi].folder(p)}/ElasticRobot{p.suffix}": p.machine
        for p in PLATFORMS.values()
    }


def test_without_libraries_and_compiler_the_command_says_what_to_do(no_compiler, tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu")]) == 2
    said = capsys.readouterr().err
    assert "the C core for linux64: expected its library as a wheel of this project brings" in said
    assert "or a compiler to make it, got neither" in said
    assert "install the package ziglang (pip install ziglang)" in said
    assert not list(tmp_path.iterdir())


def test_without_zig_this_machines_compiler_serves_this_machine_alone(monkeypatch):
    monkeypatch.setattr(compiler, "zig", lambda: None)
    # That it is fast as well is nobody's claim here: a quarter of the time.
    monkeypatch.setattr(compiler, "FLAGS", [flag for flag in compiler.FLAGS if flag != "-O3"])
    here = host_platform()
    assert core_libraries([here])[here.name].is_file()
    other = next(p for p in PLATFORMS.values() if p != here)
    with pytest.raises(BuildError, match=rf"the C core for {other.name}: .* cc, gcc or clang"):
        core_libraries([here, other])


def test_the_command_says_which_platforms_are_inside(tmp_path, capsys):
    here = host_platform().name
    for kind, platforms in (("native", here), ("python", "linux64, win64")):
        file = tmp_path / f"{kind}.fmu"
        assert main(["-o", str(file), "--kind", kind, "--platforms", here]) == 0
        assert f"{file}: built for {platforms}\n" in capsys.readouterr().out


def test_a_checkout_builds_for_this_machine_unless_others_are_named(tmp_path, capsys):
    file = tmp_path / "R.fmu"
    assert main(["-o", str(file)]) == 0
    said = capsys.readouterr().out
    assert f"{file}: built for {host_platform().name}\n" in said
    assert "--platforms all" in said


def test_a_wheel_builds_for_all_platforms_that_it_brings(monkeypatch, tmp_path):
    monkeypatch.setattr(core_library, "SHIPPED", tmp_path)
    brought = list(PLATFORMS.values())[1:3]
    for platform in brought:
        (tmp_path / library_name(platform)).touch()
    assert core_library.usual_platforms() == brought


def test_the_compiler_of_a_wheel_needs_no_package(slow, tmp_path):
    """As in an environment that has hatchling alone: filelock cannot be imported."""
    hidden = "import sys; sys.modules['filelock'] = None\n" + ASK
    said = subprocess.run(
        [sys.executable, "-c", hidden, str(tmp_path)], cwd=ROOT, capture_output=True, text=True
    )
    assert said.stdout.strip() == "whole", said.stderr


def test_unknown_kinds_and_platforms_are_refused(example, tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "native", "--platforms", "vax"]) == 2
    said = capsys.readouterr().err
    assert "platform: expected one of linux64, win64" in said
    assert "got 'vax'" in said
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "python", "--platforms", "darwin64"]) == 2
    assert "PythonFMU has libraries for, linux64, win64, got 'darwin64'" in capsys.readouterr().err
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "python", "--sources"]) == 2
    assert "leave out --kind python" in capsys.readouterr().err
    with pytest.raises(BuildError, match="kind: expected one of native, python, got 'java'"):
        build_fmu(example, tmp_path / "R.fmu", BuildOptions("java"))
    assert not list(tmp_path.iterdir())


def test_fmi3_is_for_native_fmus(example, tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "python", "--fmi", "3"]) == 2
    assert "leave out --kind python" in capsys.readouterr().err
    with pytest.raises(BuildError, match="FMI version: expected one of 2, 3, got '1'"):
        build_fmu(example, tmp_path / "R.fmu", BuildOptions("native", fmi="1"))
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
    monkeypatch.setattr("coupling.native.compiler.zig", lambda: None)
    other = next(p for p in PLATFORMS.values() if p != host_platform())
    with pytest.raises(CompilerError, match=r"install the package ziglang .* or cc, gcc or clang"):
        compile_library(other, [])


def test_sanitizers_find_nothing_in_random_numbers(tmp_path):
    """Of robots of 1 to 9 joints, whole and cut off: finite, nan, inf; paths of any length."""
    flags = (*SANITIZERS, "-fvisibility=default")
    library = compile_library(host_platform(), desk_sources(), flags)
    folders = f"-I{SOURCES}", f"-I{DESK_SOURCES}"
    fuzz = build_linked("fuzz_desk", tmp_path / "fuzz_desk", library, *SANITIZERS, *folders)
    files = []
    for seed in range(12):
        robot = with_gear_parts(make_robot(seed, joints=1 + seed % 9), seed)
        files.append(tmp_path / f"{seed}.txt")
        files[-1].write_text(robot_text(robot, "{desk}"))
    done = subprocess.run(
        [str(word) for word in (fuzz, ROUNDS, SEED, *files)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-5000:]
    assert int(done.stdout.split()[0]) > int(ROUNDS) // 10


def test_a_robot_that_is_too_long_is_refused_by_its_name():
    said = "random 1: expected at most 12 joints for the inverse, got 13"
    with pytest.raises(RobotFileError, match=said):
        DeskRobot(make_robot(1, joints=13))


def test_arrays_of_another_shape_or_not_finite_never_reach_c():
    model = LinkModel(make_robot(3, joints=6))
    theta = np.zeros((4, model.size))
    said = r"rates: expected an array of shape \(4, \d+\), got \(4, 2\)"
    with pytest.raises(ValueError, match=said):
        model.desk.loads(theta, np.zeros((4, 2)), theta, np.zeros((4, 6)))
    with pytest.raises(ValueError, match=r"wrenches: expected an array of shape \(4, 6\)"):
        model.desk.linearised(theta, theta, theta, np.zeros((3, 6)))
