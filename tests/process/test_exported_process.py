"""A process as an FMU that this project writes: as the process itself, and among others in a host."""

import sys
import zipfile

import numpy as np
import pytest
from left_behind import left_behind
from places import HOSTS
from wall_fmu import STIFFNESS, process, task

from coupling.fmu_export.process_fmu import build_process_fmu
from coupling.process import ElasticWallTable


def test_our_own_exported_process_is_the_wall_in_python(tmp_path):
    """The FMU that this project writes of a process, read back as one."""
    wall = ElasticWallTable(model="elastic-wall", stiffness_N_m=STIFFNESS).process(task())
    path = task().desired
    file = build_process_fmu(wall, path, tmp_path / "Wall.fmu")
    answer = (
        process(
            file,
            frame="base",
            inputs={name: f"tcp.{name}" for name in ("x", "y", "z", "qx", "qy", "qz", "qw")},
            outputs={f"f{axis}": f"force.{axis}" for axis in "xyz"},
            parameters={},
        )
        .evaluate(path)
        .wrench
    )
    np.testing.assert_allclose(answer.wrench, wall.evaluate(path).wrench.wrench, rtol=0, atol=1e-9)


def test_our_own_exported_process_may_refuse_many_times(exported, run_host):
    said = run_host("process_refusals", exported)
    assert said.count("tcp.y: expected a finite number, got nan") == 50


def test_our_own_exported_process_goes_back_to_its_states_bit_for_bit(exported, run_host):
    run_host("process_state", exported)


def test_damaged_and_foreign_states_of_an_exported_process_are_refused(
    exported, run_host, tmp_path
):
    softer = ElasticWallTable(model="elastic-wall", stiffness_N_m=0.5 * STIFFNESS).process(task())
    other = build_process_fmu(softer, task().desired, tmp_path / "Softer.fmu")
    said = run_host("foreign_states", exported, other)
    assert "state: expected an unchanged one that this FMU has saved, got 5 other bytes" in said
    assert "state: expected one of FMU {" in said


def test_a_host_without_numpy_is_told_which_fmu_which_python_and_what_to_do(
    exported, forked, tmp_path
):
    script = tmp_path / "started.py"
    script.write_text(f"""
import sys
sys.path.append({str(HOSTS)!r})
from fmu import Fmu
process = Fmu(sys.argv[1])
sys.modules |= {{name: None for name in [*sys.modules, "numpy"] if name.startswith("numpy")}}
try:
    process.instance()
except Exception as error:
    print(error)
""")
    done = forked(script, exported)
    assert "Failed to instantiate" in done.stdout, done.stderr
    expected = f"expected Python 3.11 or newer with numpy, got {sys.executable} "
    for said in (done.stderr, done.stdout):  # and in the log, which FMPy prints
        assert f"Process: the host of this FMU: {expected}" in said
        assert f"{sys.executable} -m pip install numpy" in said
        assert "Error(" not in said


@pytest.fixture
def exported(tmp_path):
    """The wall as this project writes it."""
    wall = ElasticWallTable(model="elastic-wall", stiffness_N_m=STIFFNESS).process(task())
    return build_process_fmu(wall, task().desired, tmp_path / "Wall.fmu")


def test_instances_and_refused_calls_leave_no_memory_behind(exported, tmp_path):
    left_behind(exported, tmp_path, "-DSTATELESS")


def test_the_module_path_is_that_of_the_host_after_any_number_of_instances(exported, run_host):
    run_host("module_path", exported, "process_entry")


def test_another_version_in_the_same_process_is_refused(exported, tmp_path, run_host):
    """Python has one module of each name; the FMU's own file must be the one that runs."""
    other = tmp_path / "Other.fmu"
    with zipfile.ZipFile(exported) as source, zipfile.ZipFile(other, "w") as changed:
        for name in source.namelist():
            more = b"# changed" if name == "resources/process_slave.py" else b""
            changed.writestr(name, source.read(name) + more)
    said = run_host("two_versions", exported, other)
    assert "process_slave: expected this FMU's own, got another version" in said
