"""Which call may be made when, in FMUs of both kinds and versions of FMI, and what instances leave."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from native_fmu import NativeFmu, build_master
from places import HOSTS

from coupling.fmu_export.build import KINDS, BuildOptions, build_fmu

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
# PythonFMU answers these two by itself: it has no derivatives, and a time whenever it is asked.
PYTHON = {**FMI2, "GetDirectionalDerivative": [], "GetRealStatus": EVER}


@pytest.mark.parametrize(
    ("kind", "fmi", "table"),
    [("python", "2", PYTHON), ("native", "2", FMI2), ("native", "3", FMI3)],
)
def test_calls_are_taken_where_the_standard_allows_them(
    example, tmp_path, run_host, kind, fmi, table
):
    file = build_fmu(
        example, tmp_path / "Robot.fmu", BuildOptions(kind, fmi=fmi, arrays=fmi == "3")
    )
    run_host("life_cycle", file, tmp_path / "found.json")
    found = json.loads((tmp_path / "found.json").read_text())
    assert found.pop("pairs") == table
    assert set(map(tuple, found.values())) == {()}, found


@pytest.mark.parametrize("kind", KINDS)
def test_instances_and_refused_calls_leave_no_memory_behind(example, tmp_path, kind):
    """200 instances one after another in a C host; Python uses the allocator that is asked."""
    fmu = NativeFmu(build_fmu(example, tmp_path / "R.fmu", BuildOptions(kind)), tmp_path / "fmu")
    host = build_master("instances", tmp_path / "instances")
    done = subprocess.run(
        [host, fmu.library, fmu.guid, fmu.resources, "200"],
        env={"ELASTIC_ROBOT_PYTHON": sys.executable, "PYTHONMALLOC": "malloc"},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    of_instance, of_refusal = map(float, done.stdout.split())
    assert abs(of_instance) < 1000
    assert abs(of_refusal) < 10


def test_the_module_path_is_that_of_the_host_after_any_number_of_instances(example, tmp_path):
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("python"))
    done = subprocess.run(
        [sys.executable, "-c", MODULE_PATH, str(HOSTS), str(file)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


MODULE_PATH = """
import sys
sys.path.append(sys.argv[1])
from fmu import Fmu
fmu, before = Fmu(sys.argv[2]), list(sys.path)
for _ in range(20):
    instance = fmu.instance().start()
    instance.slave.reset()
    instance.start()
    instance.free()
assert sys.path == before, sys.path
names = sys.getrefcount(sys.modules["elastic_robot_entry"].__dict__)
for _ in range(20):
    fmu.instance().free()
assert sys.getrefcount(sys.modules["elastic_robot_entry"].__dict__) == names
"""
