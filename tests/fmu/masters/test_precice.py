"""The robot's FMU in preCICE, with the library where it is installed, else with a stand-in for it."""

import importlib.util
import json
import subprocess
import sys
import threading
import zipfile
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import numpy as np
import precice_stand_in
import pytest
from fmpy import simulate_fmu
from places import EXAMPLES, LINE_CASE

from coupling.case.file import load_case
from coupling.errors import HostError, SimulationError
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu.precice_robot import PreciceNames, run_robot
from coupling.fmu.stepped import SteppedFmu
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.ssp import SspSystem
from coupling.run.execute import coupled_path
from examples.precice import press_with_precice

FOLDER = EXAMPLES / "precice"
STIFFNESS, STOP, WINDOW = 1e6, 0.4, 0.002


def precice_is_there() -> bool:
    try:
        importlib.import_module("precice")
    except (ImportError, RuntimeError):
        return False
    return True


@pytest.fixture(scope="module")
def fmu(tmp_path_factory) -> Path:
    robot = load_robot(shipped_robots()["icme2008"])
    return build_fmu(robot, tmp_path_factory.mktemp("fmu") / "Robot.fmu")


@pytest.fixture
def pressing(monkeypatch) -> ModuleType:
    """The example; without preCICE its wall is a thread on the stand-in."""
    if precice_is_there():
        return press_with_precice
    monkeypatch.setitem(sys.modules, "precice", precice_stand_in)

    def start_wall(*arguments: object) -> threading.Thread:
        thread = threading.Thread(target=press_with_precice.wall, args=arguments, daemon=True)
        thread.start()
        return thread

    monkeypatch.setattr(press_with_precice, "start_wall", start_wall)
    return press_with_precice


def in_one_fmu(pressing: ModuleType, folder: Path, mode: str = "dynamic") -> np.ndarray:
    """Return the tool's heights at the windows' ends, the wall being the FMU's own contact [m]."""
    fmu, parameters, height = pressing.prepare(folder, mode)
    contact = {"contact.stiffness": STIFFNESS, "anchor.z": height, "tcp_tolerance": 1e-9}
    found = simulate_fmu(
        str(fmu),
        stop_time=STOP,
        step_size=WINDOW,
        output_interval=WINDOW,
        start_values={**parameters, **contact},
        output=["tcp.z"],
    )
    return np.array(found["tcp.z"])


def test_with_the_spring_the_tool_is_where_the_contact_inside_the_fmu_has_it(pressing, tmp_path):
    """Two equations for one wall, from the air into contact: to 1 um at windows of 2 ms."""
    tool, height = pressing.press()
    expected = in_one_fmu(pressing, tmp_path)
    assert tool.time[-1] == pytest.approx(STOP, abs=1e-9)
    np.testing.assert_allclose(tool.pose[:, 2], expected, rtol=0, atol=1e-6)
    depth = np.maximum(height - tool.pose[:, 2], 0.0)
    assert depth[0] == 0.0
    assert depth[-1] > 1e-3
    np.testing.assert_allclose(tool.force[:, 2], STIFFNESS * depth, rtol=0, atol=STIFFNESS * 2e-9)
    assert tool.iterations[1:].mean() < 2.5


def test_under_ramps_of_the_force_alone_it_is_there_too(pressing, tmp_path):
    alone = PreciceNames(stiffness=())
    tool, _ = pressing.press("dynamic", FOLDER / "runner-config.xml", alone)
    np.testing.assert_allclose(tool.pose[:, 2], in_one_fmu(pressing, tmp_path), rtol=0, atol=1e-6)


def test_a_robot_without_inertia_rests_as_two_springs_in_a_row(pressing, tmp_path):
    """At the windows' ends the force belongs to the pose, whatever it was between them."""
    tool, _ = pressing.press("quasistatic")
    expected = in_one_fmu(pressing, tmp_path, "quasistatic")
    np.testing.assert_allclose(tool.pose[:, 2], expected, rtol=0, atol=1e-8)


def test_no_more_than_one_state_is_kept(pressing, monkeypatch):
    """Every state that an iteration could go back to is freed when the next window begins."""
    kept = freed = 0
    keep, forget = SteppedFmu.keep, SteppedFmu._forget

    def counted_keep(self):
        nonlocal kept
        kept += 1
        keep(self)

    def counted_forget(self):
        nonlocal freed
        freed += self._kept is not None
        forget(self)

    monkeypatch.setattr(SteppedFmu, "keep", counted_keep)
    monkeypatch.setattr(SteppedFmu, "_forget", counted_forget)
    pressing.press()
    assert kept == freed == round(STOP / WINDOW)


def test_without_pyprecice_it_says_what_to_install(fmu, monkeypatch):
    monkeypatch.setitem(sys.modules, "precice", None)
    with pytest.raises(HostError, match="expected pyprecice 3 and the preCICE that it needs"):
        run_robot(fmu, FOLDER / "precice-config.xml")


def test_a_parameter_that_the_fmu_does_not_know_is_refused_by_its_name(fmu):
    with pytest.raises(SimulationError, match="got colour"):
        run_robot(fmu, FOLDER / "precice-config.xml", {"colour": "red"})


@pytest.mark.parametrize("name", ["precice-config.xml", "runner-config.xml"])
def test_configurations_exchange_what_their_participants_read_and_write(name):
    text = (FOLDER / name).read_text().replace("coupling-scheme:", "").replace("data:", "")
    for prefix in ("m2n", "mapping", "acceleration"):
        text = text.replace(f"{prefix}:", "")
    root = ElementTree.fromstring(text)
    names = [data.get("name") for data in root.findall("vector")]
    exchanged = [data.get("data") for data in root.findall("serial-implicit/exchange")]
    assert exchanged == names
    known = PreciceNames()
    assert (
        {known.position, known.force}
        <= set(names)
        <= {
            known.position,
            known.force,
            *known.stiffness,
        }
    )
    for participant in root.findall("participant"):
        used = [e.get("name") for e in participant if e.tag in ("read-data", "write-data")]
        assert used == names


def test_a_robot_in_python_is_refused_before_it_is_loaded(tmp_path):
    robot = load_robot(shipped_robots()["icme2008"])
    fmu = build_fmu(robot, tmp_path / "Robot.fmu", BuildOptions("python"))
    with pytest.raises(SimulationError, match="got one in Python: build a native one"):
        run_robot(fmu, FOLDER / "precice-config.xml")


@pytest.mark.skipif(
    not precice_is_there() or importlib.util.find_spec("fmiprecice") is None,
    reason="needs preCICE and fmiprecice",
)
def test_an_exported_process_under_the_runner_ends_where_couple_does(tmp_path, monkeypatch):
    """Both FMUs of an archive, implicitly coupled, the robot without inertia: to 1e-11 m."""
    monkeypatch.chdir(tmp_path)
    case = load_case(LINE_CASE)
    with zipfile.ZipFile(SspSystem.of(case).write(tmp_path / "line.ssp")) as archive:
        archive.extractall(tmp_path)
    coupled = coupled_path(case)
    text = (FOLDER / "runner-config.xml").read_text().replace('"0.002"', '"0.01"')
    configuration = tmp_path / "config.xml"
    configuration.write_text(
        text.replace('max-time value="0.4"', f'max-time value="{coupled.time[-1]}"')
    )
    simulation = {
        "fmu_file_name": "./resources/Process.fmu",
        "fmu_instance_name": "process",
        "output_file_name": "./results/process.csv",
        "output": ["force.z"],
        "fmu_read_data_names": ["tcp.x", "tcp.y", "tcp.z"],
        "fmu_write_data_names": ["force.x", "force.y", "force.z"],
    }
    participant = {
        "participant_name": "Wall",
        "config_file_name": "./config.xml",
        "mesh_name": "Wall-Mesh",
        "write_data_name": "Force",
        "read_data_name": "Position",
    }
    Path("fmi.json").write_text(json.dumps({"simulation_params": simulation}))
    Path("precice.json").write_text(json.dumps({"coupling_params": participant}))
    runner = [sys.executable, "-m", "fmiprecice.runner", "fmi.json", "precice.json"]
    with subprocess.Popen(runner) as process:
        robot = tmp_path / "resources" / "ElasticRobot.fmu"
        tool = run_robot(robot, configuration, names=PreciceNames(stiffness=()))
        assert process.wait(60) == 0
    assert tool.force[:, 2].max() > 100.0
    np.testing.assert_allclose(tool.pose[:, :3], coupled.position[0], rtol=0, atol=1e-11)
