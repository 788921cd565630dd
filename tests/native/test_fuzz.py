"""Random calls under sanitizers, and what valgrind finds at the end, for FMI 2.0 and FMI 3.0.

`make fuzz` makes a million calls of each; ELASTIC_ROBOT_FUZZ is their number.  Most are made on a robot
of two joints, whose steps are short work.
"""

from __future__ import annotations

import copy
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import fmpy
import pytest
from native_fmu import SANITIZERS, NativeFmu, build_master, compiler, run_master
from native_pair import Pair
from places import TESTS
from random_robots import make_robot

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.compiler import SOURCES, compile_library, host_platform
from coupling.fmu_export.native_standards import STANDARDS

CALLS = os.environ.get("ELASTIC_ROBOT_FUZZ", "5000")
VALGRIND = ("valgrind", "-q", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all")


def build3(name: str, file: Path, linked: Sequence[Path], *flags: str) -> Path:
    """A master of FMI 3.0 with the FMU's library, or its sources."""
    files = [TESTS / "native" / f"{name}.c", *linked, "-ldl", "-lm"]
    command = [compiler(), "-std=c99", "-O1", "-Wall", "-Wextra", *flags, f"-I{SOURCES / 'fmi'}"]
    subprocess.run([*command, "-o", file, *files], check=True)
    return file


def run3(pair, command: list[object], calls: str, slash: str = "/") -> str:
    resources = f"{pair.folder3 / 'resources'}{slash}"
    done = subprocess.run(
        [*map(str, command), pair.description.guid, resources, calls],
        env={},
        capture_output=True,
        text=True,
        timeout=7200,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.fixture(scope="module")
def small(tmp_path_factory) -> dict[str, Path]:
    """A random robot of two joints, by version of FMI."""
    folder, robot = tmp_path_factory.mktemp("small"), make_robot(4, 2)
    return {
        fmi: build_fmu(robot, folder / f"{fmi}.fmu", BuildOptions("native", fmi=fmi))
        for fmi in STANDARDS
    }


def checked(said: str, calls: str) -> None:
    """Calls were refused, and steps were made, in good numbers."""
    made, refused, steps = (int(word.split()[0]) for word in said.split(", "))
    assert made == int(calls)
    assert refused > made / 4
    assert steps > made / 20


def test_sanitizers_find_nothing_in_random_calls_of_fmi_2(native, small, tmp_path):
    """Address and undefined behaviour; a refused call changes nothing."""
    fuzz = build_master("fuzz2", tmp_path / "fuzz2", *SANITIZERS)
    library = compile_library(host_platform(), STANDARDS["2"].sources(), SANITIZERS, cache=tmp_path)
    light, heavy = NativeFmu(small["2"], tmp_path / "light"), copy.copy(native)
    light.library = heavy.library = library
    checked(run_master(light, [str(fuzz)], CALLS, timeout=7200), CALLS)
    checked(run_master(heavy, [str(fuzz)], "1000"), "1000")
    host = build_master("host", tmp_path / "host", *SANITIZERS)
    run_master(heavy, [str(host)], "run")


def test_sanitizers_find_nothing_in_random_calls_of_fmi_3(pair, small, tmp_path):
    """The same; buffers have exactly the size that the FMU is told."""
    fuzz = build3("fuzz3", tmp_path / "fuzz3", STANDARDS["3"].sources(), *SANITIZERS)
    fmpy.extract(str(small["3"]), unzipdir=str(tmp_path / "light"))
    light = Pair(pair.folder2, tmp_path / "light")
    checked(run3(light, [fuzz], CALLS), CALLS)
    checked(run3(pair, [fuzz], "1000"), "1000")
    assert run3(pair, [fuzz], "20", slash="").startswith("20 calls")


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind")
def test_valgrind_finds_no_error_and_no_leak_at_the_end(native, pair, host, tmp_path):
    """Of whatever kind of leak, after steps, states, refused calls and random ones."""
    for name, calls in (("instances", "3"), ("fuzz2", "300")):
        master = build_master(name, tmp_path / name)
        run_master(native, [*VALGRIND, str(master)], calls)
    run_master(native, [*VALGRIND, str(host)], "run")
    for name, calls in (("instances", "3"), ("fuzz3", "300")):
        flags = ("-DFMI3", f"-Wl,-rpath,{pair.library3.parent}")
        master = build3(name, tmp_path / f"{name}3", [pair.library3], *flags)
        run3(pair, [*VALGRIND, master], calls)


def test_instances_and_refused_calls_of_fmi_3_leave_no_memory_behind(pair, tmp_path):
    """200 instances one after another; tests/fmu/test_life_cycle.py does so with FMI 2.0."""
    flags = ("-DFMI3", f"-Wl,-rpath,{pair.library3.parent}")
    master = build3("instances", tmp_path / "instances", [pair.library3], *flags)
    assert all(abs(float(number)) < 10 for number in run3(pair, [master], "200").split())
