"""Random calls and files under sanitizers, and what valgrind finds at the end, for FMI 2.0 and FMI 3.0.

`make fuzz` makes a million calls of each kind and a hundred thousand files; ELASTIC_ROBOT_FUZZ is the
number of calls, ELASTIC_ROBOT_FUZZ_SEED makes others.  Most are made on a robot of two joints, whose
steps are short work, without and with motors and hysteresis.
"""

import copy
import os
import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest
from native_fmu import POSTURE, SANITIZERS, build_linked, build_master, run_master
from native_pair import Pair
from random_robots import driven, limited, make_robot
from trajectory_files import COLUMNS, DATA, INTEGERS, READ, npz

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.native_standards import STANDARDS
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

CALLS = os.environ.get("ELASTIC_ROBOT_FUZZ", "5000")
FILES = str(max(4000, int(CALLS) // 10))
# Every so many bytes of a state are forged.
FORGED = 4 if int(CALLS) > 100000 else 28
SEED = os.environ.get("ELASTIC_ROBOT_FUZZ_SEED", "1")
LONGEST = 7200.0  # [s]
VALGRIND = ("valgrind", "-q", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all")


def run(*command: object) -> str:
    """Run in an empty environment; a finding is an exit code."""
    done = subprocess.run(
        [str(word) for word in command],
        env={},
        capture_output=True,
        text=True,
        errors="replace",
        timeout=LONGEST,
    )
    assert done.returncode == 0, done.stderr[-5000:]
    return done.stdout


def of3(pair, slash: str = "/") -> tuple[str, str]:
    """Token and resources of the FMU of FMI 3.0, as its masters in C want them."""
    return pair.description.guid, f"{pair.folder3 / 'resources'}{slash}"


def of2(pair) -> tuple[str, str]:
    """GUID and resources of the FMU of FMI 2.0."""
    return pair.guid2, (pair.folder2 / "resources").as_uri()


@pytest.fixture(scope="module", params=["plain", "driven"])
def small(request, tmp_path_factory) -> dict[str, Path]:
    """A random robot of two joints, by version of FMI; with limited motors, friction and hysteresis."""
    folder, robot = tmp_path_factory.mktemp("small"), make_robot(4, 2)
    if request.param == "driven":
        robot = limited(driven(robot, np.random.default_rng(4)), 60.0)
    return {
        fmi: build_fmu(robot, folder / f"{fmi}.fmu", BuildOptions("native", fmi=fmi))
        for fmi in STANDARDS
    }


@pytest.fixture(scope="module")
def light(small, tmp_path_factory) -> Pair:
    """The small robot's FMUs, unpacked."""
    folders = [tmp_path_factory.mktemp(f"light{fmi}") for fmi in small]
    for file, folder in zip(small.values(), folders, strict=True):
        fmpy.extract(str(file), unzipdir=str(folder))
    return Pair(*folders)


def checked(said: str, calls: str) -> None:
    """Calls were refused, and steps or exchanges of states were made, in good numbers."""
    made, refused, useful = (int(word.split()[0]) for word in said.split(", "))
    assert made == int(calls)
    assert refused > made / 4
    assert useful > made / 20


@pytest.mark.parametrize("fmi", STANDARDS)
def test_sanitizers_find_nothing_in_random_calls(pair, light, sanitized, tmp_path, fmi):
    """Address and undefined behaviour; a refused call changes nothing; buffers are as long as told."""
    fuzz = build_linked("fuzz_steps", tmp_path / "fuzz", sanitized, *SANITIZERS, f"-DFMI={fmi}")
    of = of2 if fmi == "2" else of3
    checked(run(fuzz, *of(light), CALLS, SEED), CALLS)
    checked(run(fuzz, *of(pair), "1000", SEED), "1000")
    if fmi == "3":
        assert run(fuzz, *of3(pair, slash=""), "20").startswith("20 calls")


def test_sanitizers_find_nothing_in_a_master_that_loads_the_library(native, sanitized, tmp_path):
    host = build_master("host", tmp_path / "host", *SANITIZERS)
    heavy = copy.copy(native)
    heavy.library = sanitized
    run_master(heavy, [str(host)], "run")


@pytest.mark.parametrize("first", [0, 1])
def test_sanitizers_find_nothing_in_forged_states(first, light, sanitized, tmp_path):
    """Whole numbers, and single bytes, that a state cannot have, under a right checksum."""
    forge = build_master("forged_states", tmp_path / "forged", *SANITIZERS)
    said = run(forge, sanitized, *of2(light), first, FORGED)
    accepted, refused = (int(part.split()[0]) for part in said.split(", "))
    assert accepted > refused > 0


@pytest.mark.parametrize("fmi", STANDARDS)
def test_sanitizers_find_nothing_in_random_calls_of_model_exchange(
    pair, light, sanitized, tmp_path, fmi
):
    """The same for the calls of an integrator."""
    fuzz = build_linked("fuzz_exchange", tmp_path / "fuzz", sanitized, *SANITIZERS, f"-DFMI={fmi}")
    of = of2 if fmi == "2" else of3
    checked(run(fuzz, *of(light), CALLS, SEED), CALLS)
    checked(run(fuzz, *of(pair), "5000", SEED), "5000")


def test_sanitizers_find_nothing_in_damaged_trajectory_files(sanitized, tmp_path):
    """Bytes and words changed, doubled or lost; half of the archives have fitting checksums."""
    folder = tmp_path / "files"
    folder.mkdir()
    rates = np.column_stack([DATA, np.ones((3, 2))])
    sound = {**READ, **INTEGERS, "rates.npz": npz([*COLUMNS, "qd1", "qdd1"], rates)}
    for name, content in sound.items():
        (folder / name).write_bytes(content)
    fuzz = build_linked("fuzz_files", tmp_path / "fuzz_files", sanitized, *SANITIZERS)
    said = run(fuzz, SEED, FILES, *sorted(folder.iterdir()))
    times, refused = (int(word) for word in said.split() if word.isdigit())
    assert times == int(FILES)
    assert 0.3 * times < refused < times


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind")
def test_valgrind_finds_no_error_and_no_leak_at_the_end(native, pair, tmp_path):
    """Of whatever kind of leak, after steps, states, refused calls and random ones."""
    master = build_master("instances", tmp_path / "instances")
    run_master(native, [*VALGRIND, str(master)], "2")
    master = build_linked("instances", tmp_path / "instances3", pair.library3, "-DFMI3")
    run(*VALGRIND, master, *of3(pair), "2")
    for fmi, of, library in (("2", of2, native.library), ("3", of3, pair.library3)):
        for name in ("fuzz_steps", "fuzz_exchange"):
            master = build_linked(name, tmp_path / f"{name}{fmi}", library, f"-DFMI={fmi}")
            run(*VALGRIND, master, *of(pair), "30")


def test_instances_and_refused_calls_of_fmi_3_leave_no_memory_behind(pair, tmp_path):
    """200 instances one after another; tests/fmu/test_life_cycle.py does so with FMI 2.0."""
    master = build_linked("instances", tmp_path / "instances", pair.library3, "-DFMI3")
    assert all(abs(float(number)) < 10 for number in run(master, *of3(pair), "200").split())


def test_a_c_host_in_an_empty_environment_gets_the_poses_of_the_python_model(native, host, example):
    """100 steps of 4 ms under a pulsed force, with backlash, to twice the tolerance."""
    poses = np.loadtxt(run_master(native, [str(host)], "run").splitlines(), delimiter=",")
    robot = ElasticRobot(example)
    q = np.array(POSTURE)
    robot.reset(0.0, HeldCommand(0.0, q, np.zeros(6), np.zeros(6)), Load())
    for k in range(100):
        force = np.array([0.0, 0.0, -500.0 * (k % 7 < 3), 0.0, 0.0, 0.0])
        robot.step(0.004 * (k + 1), HeldCommand(robot.time, q, 0 * q, 0 * q), Load(force))
        np.testing.assert_allclose(poses[k, :3], robot.tcp()[:3], rtol=0, atol=2e-6)


def test_three_instances_in_threads_are_independent(native, host):
    run_master(native, [str(host)], "threads")


@pytest.mark.skipif(sys.platform != "linux", reason="its master counts calls of glibc")
def test_memory_is_asked_for_before_the_first_step_only(native, tmp_path):
    """Steps, refused ones among them, inputs, all outputs, derivatives, states kept and restored."""
    master = build_master("cycles", tmp_path / "cycles")
    lines = run_master(native, [str(master)], "allocations").splitlines()
    assert len(lines) == 6  # three curves, moving and at rest
    for line in lines:
        counts = dict(part.split() for part in line.split(": ")[1].split(", "))
        assert int(counts.pop("start")) > 0
        assert set(counts) == {"set", "step", "get", "derivative", "state"}
        assert set(counts.values()) == {"0"}, line
