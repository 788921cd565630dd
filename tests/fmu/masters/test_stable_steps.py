"""Steps at which robot and process are stable side by side: the estimate, and what masters find."""

import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import numpy as np
import pytest
import tomlkit
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from coupling.case.file import load_case
from coupling.cli import main
from coupling.errors import BuildError
from coupling.fmu_export.build import build_fmu
from coupling.fmu_export.ssp import SspSystem
from coupling.fmu_export.step_limit import LinearisedPosture, StepLimit
from coupling.native.compiler import host_platform
from coupling.run.execute import run_coupling
from docs.scripts.make_stable_steps import CELLS, UR10, pressed
from docs.scripts.masters import MASTERS, MasterError, run_system

ICME = CELLS[-1]
STEP = 0.01  # [s], at which the light robot and the wall drive each other up under the force alone


def require_libcosim() -> None:
    if next(m for m in MASTERS if m.distribution == "libcosimpy").version is None:
        pytest.skip("libcosimpy is not installed: make masters")


def case_of(data: dict):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "case.toml")
        file.write_text(tomlkit.dumps(data))
        return load_case(file)


@pytest.fixture(scope="module")
def light():
    """The UR10 against 2e4 N/m."""
    return UR10.case(2e4)


@pytest.fixture(scope="module")
def coupled(light):
    run = run_coupling(light)
    assert run.correction.outcome.value == "converged"
    return run.correction


def test_growth_of_a_mass_against_a_spring_is_the_largest_root_of_its_polynomial():
    """m x'' = f held over h, f = -k x of the step before: q (q-1)^2 + k h^2 / 2 m (q+1) = 0."""
    mass, spring = 3.0, 2e4
    a, b, c = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0 / mass]]), np.eye(1, 2)
    posture = LinearisedPosture(0.0, a, b, c, np.ones((1, 1)), np.array([[spring]]))
    for step in (0.001, 0.01):
        beta = 0.5 * spring * step**2 / mass
        roots = np.roots([1.0, -2.0, 1.0 + beta, beta])
        assert posture.growth(step) == pytest.approx(np.abs(roots).max(), rel=1e-12)
    assert posture.contact_rate == pytest.approx(np.sqrt(spring / mass), rel=1e-12)


def test_limit_is_where_a_damped_mass_begins_to_grow():
    """Bisected to 1e-4; a process twice as stiff halves it, as the delay is what drives."""
    a, b = np.array([[0.0, 1.0], [-4e4, -4.0]]), np.array([[0.0], [1.0]])
    at = [
        LinearisedPosture(0.0, a, b, np.eye(1, 2), np.array([[2.5e-5]]), np.array([[k]]))
        for k in (2e3, 4e3)
    ]
    soft, stiff = (StepLimit.of([posture]).lasting for posture in at)
    assert at[0].growth(0.9999 * soft) < 1.0 < at[0].growth(1.0001 * soft)
    assert soft / stiff == pytest.approx(2.0, rel=0.05)
    assert StepLimit.of(at).lasting == stiff


@pytest.mark.parametrize("cell", [UR10, ICME], ids=lambda cell: cell.name)
def test_estimated_growth_is_what_the_fmu_shows(cell, tmp_path):
    """At every combination of stiffness and step; the verdict on either side of the limit is right."""
    fmu, verdicts = None, set()
    for stiffness in (1e5, 1e6):
        system = SspSystem.of(cell.case(stiffness), "force", step=STEP)
        fmu = fmu or build_fmu(system.case.robots[0].description, tmp_path / "Robot.fmu")
        posture = system.limit.postures[-1]
        at = int(np.abs(system.planned.time - posture.time).argmin())
        for step in (0.001, 0.005):
            told = posture.growth(step)
            seen = growth_in_master(fmu, system.planned.q[0][at], posture, step)
            # Relative to what happens in a step; 1.7 times a step leaves few steps to look at.
            assert np.log(seen) == pytest.approx(np.log(told), rel=0.05, abs=1e-4), (
                stiffness,
                step,
            )
            verdicts.add(told > 1.0)
    assert verdicts >= {True}
    assert cell is UR10 or verdicts == {True, False}


@pytest.mark.parametrize("step", [STEP, None], ids=["10 ms", "named"])
def test_light_robot_on_a_wall_ends_where_the_iteration_ends(light, coupled, tmp_path, step):
    require_libcosim()
    system = SspSystem.of(light)
    system.write(tmp_path / "system.ssp")
    time = coupled.achieved.time
    rows = run_system("libcosimpy", tmp_path, step or system.step, float(time[-1]))
    expected = light.process.evaluate(coupled.achieved).wrench.force[0, :, 2]
    assert rows[:, 10].max() == pytest.approx(expected.max(), rel=0.05)
    np.testing.assert_allclose(rows[-1, 1:4], coupled.achieved.position[0, -1], rtol=0, atol=1e-5)


def test_under_the_force_alone_it_explodes_as_told_and_not_at_the_named_step(
    light, coupled, tmp_path
):
    require_libcosim()
    stop = float(coupled.achieved.time[-1])
    end = coupled.achieved.position[0, -1]
    system = SspSystem.of(light, "force")
    assert system.limit.growth(STEP) > 1.05
    system.write(tmp_path / "system.ssp")
    try:
        exploded = run_system("libcosimpy", tmp_path, STEP, stop)[-1, 1:4]
    except MasterError:
        exploded = np.full(3, np.inf)
    assert np.linalg.norm(exploded - end) > 1e-2
    stable = run_system("libcosimpy", tmp_path, system.step, stop)
    np.testing.assert_allclose(stable[-1, 1:4], end, rtol=0, atol=2e-5)


def test_at_the_named_step_a_tool_stays_on_a_stiff_wall_and_bounces_at_a_longer_one(tmp_path):
    """Ten million N/m: a late touch adds energy that the robot does not take away."""
    require_libcosim()
    data = UR10.case(1e7).resolved
    data["tool_path"]["points_m"] = [[0.0, 0.0, 0.01], [0.0, 0.0, -0.005], [0.02, 0.0, -0.005]]
    system = SspSystem.of(case_of(data))
    system.write(tmp_path / "system.ssp")
    assert system.step < system.limit.touch < 3e-4
    calm, wild = (pressed(tmp_path, system, step) for step in (system.step, 7e-4))
    assert (calm[len(calm) // 2 :, 10] > 0.0).all()
    assert calm[:, 10].max() < 500.0
    assert wild is None or wild[:, 10].max() > 2000.0


def test_a_master_that_is_given_no_step_takes_that_of_the_archive(light, tmp_path):
    require_libcosim()
    system = SspSystem.of(light, "force")
    assert system.step < STEP
    system.write(tmp_path / "system.ssp")
    code = """
        from libcosimpy.CosimExecution import CosimExecution
        execution = CosimExecution.from_ssp_file("system.ssp")
        assert execution.step()
        print("time", execution.status().current_time)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], cwd=tmp_path, text=True, capture_output=True
    )
    assert f"time {round(1e9 * system.step)}" in done.stdout, done.stdout + done.stderr


def test_where_no_step_is_safe_packing_is_refused_and_an_asked_one_is_warned_of():
    """A quasi-static robot softer than the process: each answer is larger than the last."""
    data = UR10.case(1e6).resolved
    data["robot"]["mode"] = "quasistatic"
    case = case_of(data)
    with pytest.raises(
        BuildError, match=r"found none: .* connect the contact spring of the process"
    ):
        SspSystem.of(case, "force")
    (_, warning, _) = SspSystem.of(case, "force", step=STEP).remarks()
    assert warning == "warning: this step is not safe, none is"
    assert SspSystem.of(case).step == STEP
    with pytest.raises(BuildError, match=r"step: expected a finite number > 0 \[s\], got -1"):
        SspSystem.of(case, "force", step=-1.0)
    with pytest.raises(BuildError, match=r"expected one of spring, force, got .forces."):
        SspSystem.of(case, "forces")


def test_command_says_what_is_safe(tmp_path, monkeypatch, capsys):
    file = tmp_path / "press.toml"
    file.write_text(tomlkit.dumps(UR10.case(2e4).resolved))
    arguments = ["ssp", str(file), "-o", str(tmp_path / "s.ssp"), "--force-only", "--step", "0.01"]
    monkeypatch.setattr(
        sys, "argv", ["elastic-robot", *arguments, "--platforms", host_platform().name]
    )
    with pytest.raises(SystemExit, match="0"):
        main()
    said = capsys.readouterr().out
    assert "communication step: 10 ms" in said
    assert "warning: this step is not safe, 1 ms is" in said
    assert "lasting contact is stable below 1.59 ms" in " ".join(said.split())


# How far it pushes the tool once, the smaller one for what grows, between which
# distances a deviation counts [m], and its steps.
_PUSHES, _NEAR, _FAR, _MOST = (1e-8, 1e-4), 1e-8, 1e-3, 3000
_TCP, _FORCE = ("tcp.x", "tcp.y", "tcp.z"), ("force.x", "force.y", "force.z")


def growth_in_master(
    fmu: Path, drives: np.ndarray, posture: LinearisedPosture, step: float
) -> float:
    """Return by what deviations grow over a step of a master that exchanges pose and force.

    The robot rests at the surface of a bilateral wall; a push of one step disturbs it.

    Args:
        fmu: The robot's FMU.
        drives: Angles of its drives [rad].
        posture: The process's stiffness, of which the wall is made.
        step: Communication step [s].
    """
    for push in _PUSHES:
        apart = _deviations(fmu, drives, posture, step, push)
        if apart[-1] > _FAR:
            break
    joined = np.lib.stride_tricks.sliding_window_view(apart, 4).max(axis=1)  # it swings
    tail = joined[joined > _NEAR][len(joined[joined > _NEAR]) // 3 :]
    return float(np.exp(np.polyfit(np.arange(len(tail)), np.log(tail), 1)[0]))


def _deviations(
    fmu: Path, drives: np.ndarray, posture: LinearisedPosture, step: float, push: float
) -> np.ndarray:
    """Return how far the tool is from rest after every step [m]."""
    description = read_model_description(str(fmu))
    reference = {v.name: v.valueReference for v in description.modelVariables}
    tcp, force = ([reference[name] for name in names] for names in (_TCP, _FORCE))
    robot = FMU2Slave(
        guid=description.guid,
        unzipDirectory=extract(str(fmu)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="robot",
    )
    robot.instantiate()
    robot.setupExperiment(startTime=0.0, tolerance=1e-10)
    robot.setString([reference["torque_curve"]], ["linear"])
    robot.enterInitializationMode()
    names = [f"q_cmd[{i}]" for i in range(1, 1 + len(drives))]
    robot.setReal([reference[name] for name in names], drives.tolist())
    robot.exitInitializationMode()
    rest = np.array(robot.getReal(tcp))
    process, own = posture.stiffnesses
    answer = posture.stiffness @ np.full(3, push * own / process)
    seen, apart = rest, []
    for k in range(_MOST):
        robot.setReal(force, answer.tolist())
        robot.doStep(k * step, step)
        answer = posture.stiffness @ (rest - seen)
        seen = np.array(robot.getReal(tcp))
        apart.append(float(np.linalg.norm(seen - rest)))
        if apart[-1] > _FAR or (k > 50 and max(apart[-50:]) < _NEAR):
            break
    robot.freeInstance()
    return np.array(apart)
