"""Robot and process as an SSP archive, advanced step by step by other masters."""

import csv
import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd
from fmpy.validation import validate_fmu
from places import DOCS, LINE_CASE

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.cli import main
from coupling.errors import BuildError
from coupling.fmu_export.process_fmu import build_process_fmu
from coupling.fmu_export.ssp import INTERFACES, SspSystem
from coupling.native.compiler import host_platform
from coupling.path.controller import on_cycle
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process import ProcessResponse
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.execute import coupled_path, run_coupling
from docs.scripts.masters import MASTERS, distance_at_samples, run_system

LINE = LINE_CASE
HERE = host_platform().name
SHEET = """
[process]
model = "isf-force-law"
sheet_thickness_m = 0.001
tensile_strength_Pa = 1.05e8
tool_diameter_m = 0.01
penetration_stiffness_N_m = 1.2e5
wall_angle_deg = 45.0
step_down_m = 0.0005
"""


def require(distribution: str) -> None:
    if next(m for m in MASTERS if m.distribution == distribution).version is None:
        pytest.skip(f"{distribution} is not installed: make masters")


@dataclass(frozen=True)
class Packed:
    """A case and a folder with its system.ssp, the force alone connected, and its FMUs.

    Attributes:
        sprung: Folder with the system.ssp in which the contact spring is connected as well.
    """

    case: Case
    folder: Path

    @property
    def sprung(self) -> Path:
        return self.folder / "sprung"


@pytest.fixture(scope="module", params=["elastic-wall", "isf-force-law"])
def system(request, tmp_path_factory) -> Packed:
    folder = tmp_path_factory.mktemp("ssp")
    text = LINE.read_text()
    if request.param == "isf-force-law":
        before, _, after = text.partition("[process]")
        text = before + "[coupling]" + after.partition("[coupling]")[2] + SHEET
        # Off the part's axis, where the radial force would jump.
        text = re.sub(r"\[0\.0(?=, 0\.0, -?0\.002\])", "[0.03", text)
    (folder / "case.toml").write_text(text)
    case = load_case(folder / "case.toml")
    SspSystem.of(case, "force", step=0.01).write(folder / "system.ssp")
    SspSystem.of(case).write(folder / "sprung" / "system.ssp")
    with zipfile.ZipFile(folder / "system.ssp") as archive:
        archive.extractall(folder)
    return Packed(case, folder)


@pytest.fixture(scope="module")
def poses(system) -> np.ndarray:
    """The system in libcosim, at steps as long as the path's samples."""
    require("libcosimpy")
    time = system.case.desired.time
    return run_system("libcosimpy", system.folder, float(time[1]), time[-1])


@pytest.mark.parametrize("answer", INTERFACES)
def test_structure_is_valid_and_joins_every_connector(system, answer):
    """FMPy checks it against the schema of SSP 1.0."""
    folder = system.sprung if answer == "spring" else system.folder
    structure = read_ssd(str(folder / "system.ssp"))
    joined = [
        end
        for connection in structure.system.connections
        for end in (
            (connection.startElement, connection.startConnector),
            (connection.endElement, connection.endConnector),
        )
    ]
    connectors = [
        (component.name, connector.name)
        for component in structure.system.elements
        for connector in component.connectors
    ]
    assert sorted(joined) == sorted(connectors)
    assert len(connectors) == 2 * (7 + len(INTERFACES[answer]))


def test_connectors_are_variables_of_the_fmus(system):
    for component in read_ssd(str(system.sprung / "system.ssp")).system.elements:
        fmu = str(system.folder / component.source)
        assert validate_fmu(fmu) == []
        variables = {v.name: v for v in fmpy.read_model_description(fmu).modelVariables}
        for connector in component.connectors:
            assert variables[connector.name].causality == connector.kind


def test_co_simulated_pose_is_the_robots_under_the_force_of_two_steps_ago(system, poses):
    """Jacobi: one step for the process to answer, one for the robot to feel it; nothing else."""
    case = system.case
    time = case.desired.time
    seen = ToolPath(time, np.vstack([case.desired.pose[0, :1], poses[:, 1:8]]))
    answered = case.process.evaluate(seen).wrench.wrench[0]
    np.testing.assert_allclose(poses[1:, 8:], answered[1:-1], rtol=0, atol=1e-9)
    felt = np.zeros_like(answered)
    felt[3:] = answered[1:-2]
    (placed,) = case.robots
    planned = InverseKinematics(placed.description, placed.home).plan(case.desired)
    command = on_cycle(planned, case.controller)
    fmu = system.folder / "resources" / "ElasticRobot.fmu"
    with RobotFmu(fmu, placed.torque_curve) as robot:
        path = robot.simulate(command, WrenchHistory.of_means(time, felt), case.mode)
    assert np.abs(felt).max() > 100.0
    np.testing.assert_allclose(poses[:, 1:4], path.position[0, 1:], rtol=0, atol=1e-12)


def test_co_simulation_nears_the_weak_coupling_in_first_order(system, poses):
    coupled = run_coupling(system.case).correction.achieved
    step = float(coupled.time[1])
    runs = [poses]
    for parts in (2, 4):
        finer = run_system("libcosimpy", system.folder, step / parts, coupled.time[-1])
        runs.append(finer)
    errors = [np.sqrt(np.mean(distance_at_samples(run, coupled) ** 2)) for run in runs]
    orders = -np.diff(np.log2(errors))
    assert errors[-1] < 1e-5
    np.testing.assert_allclose(orders, 1.0, rtol=0, atol=0.1)


def test_with_the_spring_the_same_steps_are_nearer_to_the_weak_coupling(system, poses):
    """What remains is late contact; of the sheet's force law also its ramp, which is no spring."""
    coupled = run_coupling(system.case).correction.achieved
    time = coupled.time
    sprung = run_system("libcosimpy", system.sprung, float(time[1]), time[-1])
    errors = [np.sqrt(np.mean(distance_at_samples(run, coupled) ** 2)) for run in (poses, sprung)]
    wall = system.case.process_table.model == "elastic-wall"
    assert errors[1] < (0.75 if wall else 1.05) * errors[0]


def test_ecos_and_libcosim_agree_on_the_spring(system):
    require("ecospy")
    require("libcosimpy")
    time = system.case.desired.time
    runs = [
        run_system(master, system.sprung, float(time[1]), time[-1])
        for master in ("ecospy", "libcosimpy")
    ]
    assert np.abs(runs[0][:, 8:11]).max() > 100.0
    np.testing.assert_allclose(runs[0][:, :8], runs[1][:, :8], rtol=0, atol=1e-12)


def test_ecos_and_libcosim_agree(system, poses):
    require("ecospy")
    time = system.case.desired.time
    ecos = run_system("ecospy", system.folder, float(time[1]), time[-1])
    np.testing.assert_allclose(ecos[:, :8], poses[:, :8], rtol=0, atol=1e-12)
    np.testing.assert_allclose(ecos[:, 8:], poses[:, 8:], rtol=0, atol=1e-9)


def test_a_master_that_sets_no_strings_moves_the_robot(system):
    """FMPy reads no parameters of an archive; the command is the start value of the robot's own FMU."""
    time = system.case.desired.time
    cell = simulate_ssp(
        str(system.sprung / "system.ssp"), stop_time=float(time[-1]), step_size=float(time[1])
    )
    end = [cell[f"robot.tcp.{axis}"][-1] for axis in "xyz"]
    np.testing.assert_allclose(end, system.case.desired.position[0, -1], rtol=0, atol=2e-3)
    travelled = np.ptp(cell["robot.tcp.x"])
    assert travelled > 0.9 * np.ptp(system.case.desired.position[0, :, 0])


@pytest.mark.parametrize("answer", INTERFACES)
def test_what_a_step_is_said_to_cost_is_what_libcosim_has(system, answer):
    require("libcosimpy")
    case, time = system.case, system.case.desired.time
    coupled = coupled_path(case)
    folder = system.sprung if answer == "spring" else system.folder
    (cost,) = SspSystem.of(case, answer).errors(coupled, [float(time[1])])
    poses = run_system("libcosimpy", folder, float(time[1]), time[-1])
    distance = distance_at_samples(poses, coupled)
    assert cost.largest == pytest.approx(distance.max(), abs=1e-10)
    mean = np.sum(distance**2) / len(coupled.time)  # the first sample is the start
    assert cost.rms == pytest.approx(np.sqrt(mean), abs=1e-11)
    assert distance.max() > 1e-6


@pytest.mark.skipif(sys.platform != "linux", reason="the page's line is for Linux")
def test_a_program_without_python_runs_it_after_the_line_of_the_page(system, poses):
    """Ecos's own program, which writes the initial state and all steps but the last, six digits."""
    require("ecospy")
    shipped = importlib.metadata.distribution("ecospy").locate_file("ecospy/binaries/ecos")
    program = shutil.copy(str(shipped), system.folder)
    os.chmod(program, 0o755)  # the wheel ships it without
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "LD_LIBRARY_PATH": str(Path(sys.prefix, "lib")),  # of libtbb
    }
    time = system.case.desired.time
    (line,) = re.findall(
        r"^export ELASTIC_ROBOT_PYTHON=.*$", (DOCS / "import.md").read_text(), re.M
    )
    simulate = f"simulate --path system.ssp --stepSize {time[1]}"
    done = subprocess.run(
        ["bash", "-c", f"{line}\n./ecos {simulate} --stopTime {time[-1]}"],
        cwd=system.folder,
        env=environment,
        text=True,
        capture_output=True,
        timeout=300,
    )
    with (system.folder / "system.csv").open() as table:
        header, *rows = csv.reader(table, skipinitialspace=True)
    assert len(rows) == len(poses), done.stdout + done.stderr
    columns = [header.index(f"robot::tcp.{axis}[REAL]") for axis in "xyz"]
    shown = np.array(rows[1:])[:, columns].astype(float)  # from the first step's end on
    np.testing.assert_allclose(shown, poses[:-1, 1:4], rtol=0, atol=6e-7)


def test_process_fmu_gives_the_processs_force_and_needs_numpy_alone(system, run_host, tmp_path):
    """Random poses about the desired path, in a process where the project cannot be imported."""
    case, rng = system.case, np.random.default_rng(3)
    time = case.desired.time
    pose = case.desired.pose[0].copy()
    pose[:, :3] += rng.normal(scale=1e-3, size=(len(time), 3))
    np.savez(tmp_path / "path.npz", time=time, pose=pose)
    fmu, wrench = system.folder / "resources" / "Process.fmu", tmp_path / "wrench.npy"
    said = run_host("process_path", fmu, tmp_path / "path.npz", wrench)
    answer = case.process.evaluate(ToolPath(time, pose))
    expected = answer.wrench.wrench[0][:-1]
    assert np.abs(expected).max() > 100.0, said
    given = np.load(wrench)
    np.testing.assert_allclose(given[:, :6], expected, rtol=0, atol=1e-9)
    # The wall stands still; what follows the desired path goes along with it for a step, and on.
    place = case.process.law().place
    ahead = place(2 * time[1:] - time[:-1])
    along = place(time[1:]) - place(time[:-1])
    np.testing.assert_allclose(given[:, 6:9], pose[:-1, :3] + along, rtol=0, atol=1e-12)
    velocity = (ahead - place(time[1:])) / np.diff(time)[:, None]
    np.testing.assert_allclose(given[:, 9:12], velocity, rtol=0, atol=1e-9)
    upper = (slice(None, -1), *np.triu_indices(3))
    np.testing.assert_allclose(given[:, 12:], answer.stiffness[upper], rtol=1e-12, atol=1e-9)
    assert "process: tcp.y: expected a finite number, got nan" in said


def test_archive_is_the_same_each_time(system, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    prepared = SspSystem.of(system.case)
    first, second = (prepared.write(tmp_path / f"{k}.ssp").read_bytes() for k in "ab")
    assert first == second


class Remembering:
    """A process that is no function of time and position."""

    identity = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        return ProcessResponse(WrenchHistory.none(path.time))


def test_a_process_with_memory_is_refused(system, tmp_path):
    with pytest.raises(BuildError, match="got Remembering, which needs the whole path at once"):
        build_process_fmu(Remembering(), system.case.desired, tmp_path / "P.fmu")
    with pytest.raises(BuildError, match=r"ends in \.ssp"):
        SspSystem.of(system.case).write(tmp_path / "system.zip")


def test_command_writes_the_archive(tmp_path, monkeypatch, capsys):
    file = tmp_path / "deep" / "stroke.ssp"
    monkeypatch.setattr(
        sys, "argv", ["elastic-robot", "ssp", str(LINE), "-o", str(file), "--platforms", HERE]
    )
    with pytest.raises(SystemExit, match="0"):
        main()
    assert zipfile.is_zipfile(file)
    said = capsys.readouterr().out
    assert "built" in said
    assert "distance of the tool from the coupling of `couple`" in said
    assert "communication step: " in said
