"""Schemes, weak coupling and processes against closed forms."""

import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from places import CASES, EXAMPLES, TESTS
from pythonfmu.builder import FmuBuilder
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from spring_robot import SpringPlanner, SpringRobot, upright

from coupling.errors import CaseError, HostError, SimulationError
from coupling.fmu_export.build import build_fmu
from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.process import PROCESSES, ElasticWall, IsfForceLawTable, ProcessResponse
from coupling.robot.cell import Cell, Member
from coupling.robot.robot_fmu import RobotFmu
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Loop, Tolerance
from coupling.solve.mirror import Mirror
from coupling.solve.relaxation import Aitken, ConstantRelaxation
from coupling.solve.scheme import Outcome
from coupling.solve.schemes import SCHEMES
from coupling.toolpaths import Cone, Task
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot


def loop(robot, process, scheme, max_evaluations=40) -> Loop:
    tight = Tolerance(path=1e-11, rms=1e-11, force=1e-9)
    return Loop(robot, process, "quasistatic", scheme, tight, max_evaluations)


def moving_command(n: int = 50) -> JointPath:
    """Up and down along a wall at z = 0, always 1 to 3 mm inside it."""
    time = np.linspace(0.0, 1.0, n)
    depth = -2e-3 - 1e-3 * np.sin(2 * np.pi * time)
    return JointPath(time, (np.column_stack([time, 0.0 * time, depth]),))


WALL = {"point": np.zeros(3), "normal": np.array([0.0, 0.0, 1.0])}


# At a gain of 50 Aitken's single factor does not recover from lost contact within 40 evaluations.
@pytest.mark.parametrize(
    ("scheme", "gain"),
    [(s, g) for s in SCHEMES for g in (0.1, 0.5, 5.0)] + [("constant", 50.0), ("anderson", 50.0)],
)
def test_springs_against_a_wall_rest_at_the_closed_form(scheme, gain):
    """x = x_c / (1 + gain): the tool's depth divided by one plus stiffness times compliance."""
    first = 1.0 / (1.0 + gain) if scheme == "constant" else 1.0
    command = moving_command()
    robot, wall = SpringRobot(gain / 1e6 * np.eye(3)), ElasticWall(stiffness=1e6, **WALL)
    result = couple(loop(robot, wall, SCHEMES[scheme](first)), command)
    assert result.converged, result.reason
    np.testing.assert_allclose(
        result.path.position[0, :, 2], command.q[0][:, 2] / (1.0 + gain), rtol=0, atol=1e-9
    )
    assert len(result.evaluations) >= 2


@pytest.mark.parametrize("scheme", ["aitken", "anderson"])
def test_gain_that_varies_along_the_path_is_no_obstacle(scheme):
    command = moving_command()
    gain = np.linspace(0.1, 5.0, len(command.time))
    robot = SpringRobot(gain[:, None, None] / 1e6 * np.eye(3))
    wall = ElasticWall(stiffness=1e6, **WALL)
    result = couple(loop(robot, wall, SCHEMES[scheme](1.0), max_evaluations=200), command)
    assert result.converged, result.reason
    expected = command.q[0][:, 2] / (1.0 + gain)
    np.testing.assert_allclose(result.path.position[0, :, 2], expected, rtol=0, atol=1e-9)


def test_plain_iteration_at_gain_five_is_reported_as_diverging():
    robot, wall = SpringRobot(5e-6 * np.eye(3)), ElasticWall(stiffness=1e6, **WALL)
    # Held at depth, so that contact is never lost and the growth is the gain itself.
    result = couple(loop(robot, _Bilateral(wall), ConstantRelaxation(1.0)), moving_command())
    assert result.outcome is Outcome.DIVERGED
    assert "factor 5 per evaluation" in result.reason
    assert "use another scheme" in result.reason
    assert len(result.evaluations) == 4  # ten times over the larger one of the first two


class _Bilateral:
    """A wall that also pulls."""

    def __init__(self, wall: ElasticWall) -> None:
        self.wall = wall

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        depth = (self.wall.point - path.position[0]) @ self.wall.normal
        force = self.wall.stiffness * np.outer(depth, self.wall.normal)
        return ProcessResponse(WrenchHistory.of_forces(path.time, [force]))


def test_a_limit_cycle_is_named_with_its_positions():
    """Losing contact on every other evaluation: plain iteration at gain 1.0 flips for ever."""
    robot, wall = SpringRobot(1e-6 * np.eye(3)), ElasticWall(stiffness=1e6, **WALL)
    result = couple(loop(robot, wall, ConstantRelaxation(1.0)), moving_command())
    assert result.outcome is Outcome.LIMIT_CYCLE
    assert "limit cycle" in result.reason
    assert "t = 0.2" in result.reason  # deepest near a quarter of the period


def test_the_evaluation_limit_is_a_result():
    robot, wall = SpringRobot(0.9e-6 * np.eye(3)), ElasticWall(stiffness=1e6, **WALL)
    result = couple(loop(robot, wall, ConstantRelaxation(1.0), max_evaluations=3), moving_command())
    assert result.outcome is Outcome.EXHAUSTED
    assert result.reason == "not converged within 3 evaluations of the process"


def test_a_robot_that_fails_on_the_way_ends_the_iteration_as_diverged():
    class Breaking(SpringRobot):
        calls = 0

        def simulate(self, command, wrench, mode):
            self.calls += 1
            if self.calls == 3:
                raise SimulationError("too soft")
            return super().simulate(command, wrench, mode)

    wall = ElasticWall(stiffness=1e6, **WALL)
    result = couple(
        loop(Breaking(5e-6 * np.eye(3)), wall, ConstantRelaxation(1.0)), moving_command()
    )
    assert result.outcome is Outcome.ROBOT_FAILED
    assert "too soft" in result.reason
    assert np.all(np.isfinite(result.path.pose))


@pytest.mark.parametrize("at", [3, 8])
def test_a_robot_whose_host_ends_is_an_error_and_no_verdict(at):
    """In the first coupling and in that of a corrected command, which 8 simulations reach."""

    class Ending(SpringRobot):
        calls = 0

        def simulate(self, command, wrench, mode):
            self.calls += 1
            if self.calls == at:
                raise HostError("killed")
            return super().simulate(command, wrench, mode)

    springs = Ending(5e-7 * np.eye(3))
    cell = Cell((Member("springs", AT_THE_ORIGIN, springs, SpringPlanner()),))
    process, command = ElasticWall(stiffness=1e6, **WALL), moving_command()
    desired = ToolPath(command.time, upright(command.q[0]))
    with pytest.raises(HostError, match="killed"):
        Mirror().correct(loop(cell, process, SCHEMES["anderson"](1.0)), SampledPath.of(desired))
    assert springs.calls == at


@given(st.integers(0, 10**6))
def test_schemes_solve_random_linear_problems(seed):
    """x = b - A x with gains up to 4 in three directions: Anderson ends after few updates."""
    rng = np.random.default_rng(seed)
    vectors = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    matrix = vectors @ np.diag(rng.uniform(0.1, 4.0, 3)) @ vectors.T
    b = rng.normal(size=3)
    scheme, x = SCHEMES["anderson"](1.0), np.zeros(3)
    for _ in range(12):
        x = scheme.update(x, b - matrix @ x)
    np.testing.assert_allclose(x, np.linalg.solve(np.eye(3) + matrix, b), rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", SCHEMES)
def test_reset_forgets(name):
    scheme = SCHEMES[name](0.5)
    x, g = np.array([1.0, 2.0]), np.array([3.0, 1.0])
    first = scheme.update(x, g)
    scheme.update(first, g)
    scheme.reset()
    assert np.array_equal(scheme.update(x, g), first)


def test_aitken_solves_a_linear_spring_pair_in_two_updates():
    """Robot k_r against wall k_p: the tool rests at k_r x_c / (k_r + k_p)."""
    k_r, k_p, x_c = 2.0e5, 1.0e6, 1.0e-3
    scheme, x = Aitken(first=0.1), np.array([x_c])
    for _ in range(2):
        x = scheme.update(x, g=x_c - k_p / k_r * x)
    np.testing.assert_allclose(x, k_r * x_c / (k_r + k_p), rtol=1e-12)


@pytest.fixture(scope="module")
def arm_fmu(tmp_path_factory):
    """One elastic joint about y, 1 m arm, 1e5 N m/rad: compliance 1e-5 m/N at the TCP."""
    link = Body(mass=20.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 1.0, 1.0))
    joint = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link, stiffness=1e5, damping=100.0)
    robot = Robot("arm", (joint,), gravity=(0.0, 0.0, 0.0), tcp_position=(1.0, 0.0, 0.0))
    return build_fmu(robot, tmp_path_factory.mktemp("arm") / "Arm.fmu")


@pytest.mark.parametrize("scheme", ["aitken", "anderson"])
def test_fmu_against_a_wall_of_loop_gain_five_equals_the_closed_form(arm_fmu, scheme):
    """k e = F cos(q + e), F = k_w times the depth sin(q + e): one scalar equation per sample."""
    time = np.linspace(0.0, 1.0, 60)
    q = 2e-3 + 1e-3 * np.sin(2 * np.pi * time) ** 2  # positive angles are below z = 0
    wall = ElasticWall(stiffness=5e5, **WALL)
    with RobotFmu(arm_fmu, "linear") as robot:
        result = couple(loop(robot, wall, SCHEMES[scheme](1.0)), JointPath(time, (q[:, None],)))
    assert result.converged, result.reason

    def balance(e: float, angle: float) -> float:
        return 1e5 * e + 5e5 * np.sin(angle + e) * np.cos(angle + e)

    e = np.array([brentq(balance, -0.01, 0.01, args=(angle,), xtol=1e-16) for angle in q])
    np.testing.assert_allclose(result.path.position[0, :, 2], -np.sin(q + e), rtol=0, atol=1e-9)


def test_fmu_at_loop_gain_five_diverges_plainly(arm_fmu):
    time = np.linspace(0.0, 1.0, 60)
    command = JointPath(time, (np.full((60, 1), 2e-3),))
    wall = _Bilateral(ElasticWall(stiffness=5e5, **WALL))
    with RobotFmu(arm_fmu, "linear") as robot:
        result = couple(loop(robot, wall, ConstantRelaxation(1.0)), command)
    assert result.outcome is Outcome.DIVERGED


LAW = {
    "sheet_thickness_m": 1e-3,
    "tensile_strength_Pa": 1.05e8,
    "tool_diameter_m": 0.01,
    "penetration_stiffness_N_m": 1.2e5,
}


def isf_task(depth: float = 0.006) -> Task:
    part = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("x", 0.3))
    cone = Cone(
        kind="cone",
        radius_m=0.03,
        wall_angle_deg=45.0,
        step_down_m=0.001,
        depth_m=depth,
        feed_m_s=0.1,
        sample_s=0.01,
    )
    return cone.task(part)


def test_isf_force_is_that_of_the_law_where_it_is_steady():
    """Aerens et al.: 470 N axially at R_m 105 MPa, t 1, d 10, dz 1 mm, 45 degrees."""
    task = isf_task()
    answer = IsfForceLawTable(model="isf-force-law", **LAW).process(task).evaluate(task.desired)
    force = task.part.rotation.inv().apply(answer.wrench.force[0])
    x, y, z = task.part.coordinates(task.desired.position[0]).T
    steady = z < -4.5e-3
    assert steady.sum() > 100
    np.testing.assert_allclose(force[steady, 2], 470.0, atol=0.5)
    outward = np.column_stack([x, y]) / np.hypot(x, y)[:, None]
    radial = np.sum(force[:, :2] * outward, axis=1)
    # tan((alpha + beta)/2) with cos(beta) = 1 - 2 * 0.0503 / 10
    ratio = np.tan(0.5 * (np.deg2rad(45.0) + np.arccos(1.0 - 2.0 * 0.050253 / 10.0)))
    np.testing.assert_allclose(radial[steady], -470.0 * ratio, rtol=1e-3)
    assert np.all(answer.wrench.wrench[0, z >= 0.0] == 0.0)
    before_lift_off = np.flatnonzero(z < z.min() + 1e-12)[-1]
    assert (
        np.abs(np.diff(force[:before_lift_off, 2])).max() < 0.05 * 470
    )  # ramped in without a jump


def test_isf_force_grows_with_penetration_and_never_pulls():
    task = isf_task()
    law = IsfForceLawTable(model="isf-force-law", **LAW).process(task)
    base = law.evaluate(task.desired).wrench.force[0]
    along = base / np.maximum(np.linalg.norm(base, axis=1), 1e-9)[:, None]
    steady = task.part.coordinates(task.desired.position[0])[:, 2] < -4.5e-3
    for depth in (1e-4, -1e-4, -1.0):
        shift = np.hstack([-depth * along, np.zeros_like(along)])
        force = law.evaluate(task.desired.displaced(shift[None])).wrench.force[0]
        size = np.sum(force * along, axis=1)[steady]
        expected = max(np.linalg.norm(base[steady][0]) + 1.2e5 * depth, 0.0)
        np.testing.assert_allclose(size, expected, rtol=1e-6, atol=1e-9)


def test_isf_law_without_a_wall_asks_for_one():
    task = isf_task()
    bare = Task(task.part, task.desired)
    with pytest.raises(CaseError, match="wall_angle_deg and step_down_m"):
        IsfForceLawTable(model="isf-force-law", **LAW).process(bare)
    table = IsfForceLawTable(model="isf-force-law", wall_angle_deg=45.0, step_down_m=0.02, **LAW)
    with pytest.raises(CaseError, match="larger than a tool of 10 mm can leave"):
        table.process(bare)


def test_every_process_answers_on_the_paths_time_axis(tmp_path):
    task = isf_task(depth=0.001)
    (tmp_path / "record.csv").write_text("time,fx,fy,fz\n0,0,0,0\n99,0,0,1\n")
    wall = FmuBuilder.build_FMU(
        TESTS / "process" / "process_fmus" / "wall_slave.py", dest=tmp_path / "W.fmu"
    )
    program = str(EXAMPLES / "process_template.py")
    coefficients = ("K_tc_Pa", "K_rc_Pa", "K_ac_Pa", "K_te_N_m", "K_re_N_m", "K_ae_N_m")
    tables: dict[str, dict] = {
        "elastic-wall": {"stiffness_N_m": 1e5},
        "external": {"command": ["{python}", program], "time_limit_s": 60.0},
        "fmu": {"file": str(wall), "inputs": {"z": "height"}, "outputs": {"fz": "force"}},
        "isf-force-law": LAW,
        "measured": {"file": str(tmp_path / "record.csv")},
        "milling-force": {
            **{"force": "mean", "engagement": "slot", "cutter_diameter_m": 0.016, "teeth": 2},
            **{"helix_deg": 30.0, "spindle_speed_rpm": 2e4, **dict.fromkeys(coefficients, 1e4)},
        },
    }
    sheet = tomllib.loads((CASES / "cone_fem.toml").read_text())
    tables["sheet-fem"] = sheet["process"] | {"sheet_size_m": [0.1, 0.1], "element_m": 0.005}
    tables["sheet-fem"] |= {"position_m": 0.01}
    untold = set(PROCESSES) - set(tables)
    assert not untold, f"{untold}: expected keys of theirs that fit this path, among these tables"
    for name, table in PROCESSES.items():
        process = table.model_validate(tables[name] | {"model": name}).process(task)
        assert np.array_equal(process.evaluate(task.desired).wrench.time, task.desired.time)
