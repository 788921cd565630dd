"""Coupling in windows against an independent integration, the growth of stability, and balances."""

import numpy as np
import pytest
from cut_in_time import SlotInTime
from scipy.spatial.transform import Rotation
from spring_robot import SpringRobot
from vibrating_robot import VibratingMarch, VibratingRobot

from coupling.errors import SimulationError
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.process import MillingForceTable
from coupling.process.cutting_force import Cutter, CuttingCoefficients
from coupling.robot.contract import Advance
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Loop, Tolerance
from coupling.solve.scheme import Outcome
from coupling.solve.schemes import SCHEMES
from coupling.stability.floquet import vibration_of
from coupling.stability.steady_cut import SteadyCut
from coupling.stability.structure import Structure
from coupling.toolpaths import Task
from coupling.toolpaths.part import tool_path
from elastic_robot.fmi.interface import Mode

PART = Frame(np.zeros(3), Rotation.identity())
TEETH, RPM, RADIUS, FEED = 2, 3000.0, 8e-3, 0.01
PERIOD = 60.0 / RPM / TEETH
TANGENTIAL, RADIAL = 6e8, 2e8


def robot(*modes: tuple[float, float, float, float]) -> VibratingRobot:
    """Two modes: frequency [Hz], damping ratio, stiffness [N/m], angle from x [rad]."""
    total = [np.zeros((2, 2)) for _ in range(3)]
    ways = np.linalg.inv(np.array([[np.cos(m[3]), np.sin(m[3])] for m in modes]).T)
    for (frequency, ratio, stiffness, _), way in zip(modes, ways, strict=True):
        omega, square = 2.0 * np.pi * frequency, np.outer(way, way)
        for matrix, size in zip(total, (1 / omega**2, 2 * ratio / omega, 1.0), strict=True):
            matrix += stiffness * size * square
    return VibratingRobot(*total)


# As soft and as slow as a robot, the second mode across the first but for 15 degrees.
SOFT = robot((14.0, 0.04, 1.2e6, 0.2), (22.0, 0.05, 9.0e5, 0.2 + np.deg2rad(75.0)))
STIFF = robot((1e4, 0.5, 1e13, 0.0), (1e4, 0.5, 1e13, 0.5 * np.pi))


def slot(steps: int, periods: int, depth: float, entry: int = 0, **keys: object):
    """Return task and process of a slot, its depth reached at once or smoothly in so many periods."""
    time = np.arange(steps * periods + 1) * (PERIOD / steps)
    part = np.clip(time / (entry * PERIOD), 0.0, 1.0) if entry else np.ones(len(time))
    smooth = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
    points = np.column_stack([FEED * time, 0.0 * time, -depth * smooth])
    task = Task(PART, tool_path(PART, time, points))
    table = {
        "model": "milling-force",
        "cutter_diameter_m": 2.0 * RADIUS,
        "teeth": TEETH,
        "helix_deg": 0.0,
        "spindle_speed_rpm": RPM,
        "engagement": "slot",
        "K_tc_Pa": TANGENTIAL,
        "K_rc_Pa": RADIAL,
        **dict.fromkeys(("K_ac_Pa", "K_te_N_m", "K_re_N_m", "K_ae_N_m"), 0.0),
        **keys,
    }
    return task, MillingForceTable.model_validate(table).process(task)


def coupled(
    machine: VibratingRobot,
    steps: int,
    periods: int,
    depth: float,
    scheme: str = "anderson",
    **keys,
):
    task, process = slot(steps, periods, depth, **keys)
    desired = task.desired
    loop = Loop(machine, process, "dynamic", SCHEMES[scheme](), Tolerance(1e-7, 5e-8, 1e-5))
    result = couple(loop, JointPath(desired.time, (desired.position[0],)), desired)
    return result, desired


def displacement(result, desired: ToolPath) -> np.ndarray:
    return (result.path.position - desired.position)[0, :, :2]


def by_itself(machine: VibratingRobot, depth: float) -> SlotInTime:
    a, b = machine.rates
    return SlotInTime(TEETH, RPM * np.pi / 30.0, depth, TANGENTIAL, RADIAL, FEED, a, b)


def test_a_cut_begins_where_its_robot_stands_wherever_the_first_guess_begins():
    """To the windows' tolerance, in all rows: what a tooth meets first was made from there."""
    task, process = slot(30, 8, 1e-3)
    desired = task.desired
    loop = Loop(SOFT, process, "dynamic", SCHEMES["anderson"](), Tolerance(1e-7, 5e-8, 1e-5))
    command = JointPath(desired.time, (desired.position[0],))
    aside = desired.displaced(np.array([0.0, 2e-4, 0.0, 0.0, 0.0, 0.0]))
    here, there = (couple(loop, command, start) for start in (desired, aside))
    np.testing.assert_allclose(there.path.position, here.path.position, atol=1e-7)
    np.testing.assert_allclose(
        there.response.wrench.wrench[:, 1:], here.response.wrench.wrench[:, 1:], atol=0.5
    )


def errors_of(steps: tuple[int, ...], depth: float, periods: int = 24, fine: int = 120):
    expected = by_itself(SOFT, depth).motion(periods, fine)
    for count in steps:
        result, desired = coupled(SOFT, count, periods, depth)
        assert result.converged
        difference = displacement(result, desired) - expected[:: fine // count, :2]
        yield np.abs(difference).max() / np.abs(expected[:, :2]).max()


def test_a_stable_cut_is_that_of_an_integration_by_itself():
    (error,) = errors_of((30,), 1e-3)
    assert error < 1e-3


def test_a_cut_that_edges_leave_is_that_of_an_integration_by_itself_with_second_order():
    """Chattering: errors fall to a quarter at half the step."""
    coarse, fine = errors_of((15, 30), 12e-3)
    assert fine < 0.02
    assert coarse / fine > 3.0


@pytest.mark.parametrize("depth", [2e-3, 4e-3])
def test_a_vibration_grows_or_decays_as_linear_stability_has_it(depth):
    """The change from period to period, behind a slow entry, against the Floquet exponent."""
    result, desired = coupled(SOFT, 24, 100, depth, entry=50)
    u = displacement(result, desired)
    change = np.linalg.norm(u[24:] - u[:-24], axis=1)[24 * 64 : 24 * 94]
    highest = change.reshape(5, -1).max(axis=1)  # every six periods
    assert highest.max() < 0.5 * FEED * PERIOD
    growth = np.polyfit(6 * PERIOD * np.arange(5), np.log(highest), 1)[0]
    a, b = SOFT.rates
    structure = Structure._of_states(a, np.hstack([b, np.zeros((4, 4))]), np.eye(2, 4))
    cutter = Cutter(RADIUS, TEETH, 0.0, RPM * np.pi / 30.0)
    coefficients = CuttingCoefficients(TANGENTIAL, RADIAL, 0.0, 0.0, 0.0, 0.0)
    vibration = vibration_of(structure, SteadyCut(cutter, coefficients, 0.0, np.pi, depth))
    assert growth == pytest.approx(vibration.growth, rel=0.1, abs=0.5)
    assert (growth < 0.0) == vibration.is_stable


@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_scheme_leads_to_the_same_cut(scheme):
    reference, desired = coupled(SOFT, 12, 20, 2e-3)
    result, _ = coupled(SOFT, 12, 20, 2e-3, scheme)
    assert result.converged
    np.testing.assert_allclose(
        displacement(result, desired), displacement(reference, desired), rtol=0, atol=1e-8
    )


def test_a_stiff_robot_meets_the_forces_of_the_steady_feed():
    result, _ = coupled(STIFF, 24, 8, 2e-3)
    steady = slot(24, 8, 2e-3)[1].evaluate(slot(24, 8, 2e-3)[0].desired).wrench.before[0]
    np.testing.assert_allclose(result.response.wrench.before[0], steady, rtol=0, atol=1e-3)
    chip, depth, rows = FEED * PERIOD, 2e-3, slice(24 * 4 + 1, 24 * 8 + 1)
    expected = TEETH * depth * chip / 4.0 * np.array([-RADIAL, TANGENTIAL])
    mean = result.response.wrench.before[0, rows, :2].mean(axis=0)
    np.testing.assert_allclose(mean, expected, rtol=1e-4)


def test_the_work_of_the_cut_is_what_springs_masses_and_dampers_have_got():
    machine, periods, steps = SOFT, 40, 24
    result, desired = coupled(machine, steps, periods, 2e-3)
    u, step = displacement(result, desired), PERIOD / steps
    force = result.response.wrench.behind[0, :-1, :2]
    a, b = machine.rates
    states = [np.zeros(4)]
    work = taken = 0.0
    parts = 40
    for k, push in enumerate(force):
        state = states[-1]
        for _ in range(parts):  # the states between, by the middle of short steps
            h = step / parts
            middle = state + 0.5 * h * (a @ state + b @ push)
            state = state + h * (a @ middle + b @ push)
            work += h * push @ middle[2:]
            taken += h * middle[2:] @ machine.damping @ middle[2:]
        states.append(state)
        assert np.abs(state[:2] - u[k + 1]).max() < 1e-7
    u_end, v_end = state[:2], state[2:]
    kept = 0.5 * (v_end @ machine.mass @ v_end + u_end @ machine.stiffness @ u_end)
    assert work == pytest.approx(kept + taken, rel=1e-4)
    assert taken > 0.05 * work


class Springs:
    """A tool on springs alone along a path: the force moves it at once."""

    def __init__(self, desired: ToolPath, compliance: float) -> None:
        self.desired, self.compliance = desired, compliance

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        return self.advance(wrench, False)

    def march(self, command: JointPath, start: WrenchHistory, end: float, mode: Mode) -> Advance:
        return self.advance

    def advance(self, loads: WrenchHistory, is_repeat: bool) -> ToolPath:
        path = self.desired.at_rows(np.searchsorted(self.desired.time, loads.instants))
        moved = np.zeros((1, len(path.time), 6))
        moved[..., :3] = self.compliance * loads.before[..., :3]
        return path.displaced(moved)


def test_a_robot_that_is_all_springs_is_coupled_in_windows_too():
    task, process = slot(12, 10, 2e-3, helix_deg=30.0)
    machine = Springs(task.desired, 5e-7)
    tolerance = Tolerance(1e-7, 5e-8, 1e-5)
    loop = Loop(machine, process, "quasistatic", SCHEMES["anderson"](), tolerance)
    command = JointPath(task.desired.time, (task.desired.position[0],))
    result = couple(loop, command, task.desired)
    assert result.converged
    same = process.evaluate(result.path).wrench.before
    np.testing.assert_allclose(result.response.wrench.before, same, rtol=0, atol=0.1)


def test_a_window_that_never_converges_is_told_with_the_forces_on_the_path_without_it():
    """A tool that runs away ten times as far at every look."""

    class Away(VibratingMarch):
        size = 1e-6

        def advance(self, loads: WrenchHistory, is_repeat: bool) -> ToolPath:
            Away.size *= -3.0
            return super().advance(loads, is_repeat).displaced(np.array([Away.size, 0, 0, 0, 0, 0]))

    class Runaway(VibratingRobot):
        def march(self, command, start, end, mode):
            return Away(self, command).advance

        def simulate(self, command, wrench, mode):
            return SOFT.simulate(command, wrench, mode)

    machine = Runaway(SOFT.mass, SOFT.damping, SOFT.stiffness)
    result, desired = coupled(machine, 12, 4, 1e-3)
    assert not result.converged
    assert result.outcome in (Outcome.DIVERGED, Outcome.EXHAUSTED)
    assert "does not converge" in result.reason
    expected = slot(12, 4, 1e-3)[1].evaluate(desired).wrench.wrench
    np.testing.assert_array_equal(result.response.wrench.wrench, expected)


def test_a_robot_without_windows_is_refused():
    task, process = slot(12, 4, 1e-3)
    loop = Loop(SpringRobot(np.eye(3) * 1e-7), process, "dynamic")
    with pytest.raises(SimulationError, match="window by window"):
        couple(loop, JointPath(task.desired.time, (task.desired.position[0],)), task.desired)
