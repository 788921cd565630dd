"""The stiffness that sheet-fem states: K = -dF/dx of every tool, its own displacement alone."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from places import CASES
from scipy.spatial.transform import Rotation

pytest.importorskip("numba")

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.process import PROCESSES
from coupling.sheet_fem.forming import SheetModel, SheetSettings
from coupling.sheet_fem.material import Material
from coupling.sheet_fem.mesh import SheetMesh
from coupling.sheet_fem.schedule import Schedule
from coupling.toolpaths import Task
from coupling.toolpaths.part import tool_path

ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
THICKNESS, RADIUS = 1e-3, 5e-3
REACH = RADIUS + 0.5 * THICKNESS

# Displacement of central differences [m].  From one to the other side of it some contact points set
# in and some layers yield: over it the tangent changes by its own relative size, about 1e-3.
NUDGE = 3e-7
AGREES = 1e-3


def felt(force) -> np.ndarray:
    """Return -dF/dx by central differences of a function of the displacement."""
    columns = [(force(NUDGE * e) - force(-NUDGE * e)) / (-2.0 * NUDGE) for e in np.eye(3)]
    return np.stack(columns, axis=-1)


def not_negative(stiffness: np.ndarray) -> np.ndarray:
    """Return what of a symmetric matrix pushes back."""
    values, vectors = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
    return vectors @ np.diag(values.clip(0.0)) @ vectors.T


def assert_agrees(found: np.ndarray, expected: np.ndarray):
    np.testing.assert_allclose(found, expected, atol=AGREES * np.abs(expected).max())


def assert_symmetric_and_not_negative(stiffness: np.ndarray):
    size = np.abs(stiffness).max()
    np.testing.assert_allclose(stiffness, stiffness.swapaxes(-1, -2), atol=1e-12 * size)
    assert np.linalg.eigvalsh(stiffness).min() > -1e-12 * size


FAR, NEAR = np.array([2e-3, 1e-3, -1e-4]), np.array([4e-6, 2e-6, -2e-6])


@pytest.mark.parametrize(("friction", "move"), [(0.0, FAR), (0.1, FAR), (0.1, NEAR)], ids=str)
@pytest.mark.parametrize("whole", [True, False])
def test_stiffness_is_the_derivative_of_the_force_with_the_history_before_it(friction, move, whole):
    """A tool that has pressed and travels along the sheet; with friction the symmetric part.

    The sheet slides along it, or by 4 um only in part.
    """
    settings = SheetSettings(friction=friction, window=0.012)
    sheet = SheetModel(SheetMesh((0.04, 0.04), (10, 10), THICKNESS), ALUMINIUM, settings)
    above, pressed = (sheet.sphere(np.array([0, 0, REACH - d]), RADIUS) for d in (0.0, 3e-4))
    there = pressed.center + move
    state = sheet.equilibrium(sheet.flat(), (above,), (pressed,), sheet.everywhere()).state

    def moved(displacement):
        after = sheet.sphere(there + displacement, RADIUS)
        box = sheet.everywhere() if whole else sheet.window(there)
        return sheet.equilibrium(state, (pressed,), (after,), box)

    stiffness = sheet.reaction(moved(np.zeros(3)))
    expected = felt(lambda d: moved(d).forces[0])
    if friction == 0.0:
        np.testing.assert_allclose(expected, expected.T, atol=AGREES * expected.max())
    assert_agrees(stiffness, 0.5 * (expected + expected.T))
    assert_symmetric_and_not_negative(stiffness)


def test_two_tools_feel_their_own_and_each_other_s_displacement():
    """Spheres on both faces, 5 mm apart.

    Sideways the sheet pushes either farther off, as from a crest; of the own reaction that is left out.
    """
    sheet = SheetModel(SheetMesh((0.04, 0.04), (10, 10), THICKNESS), ALUMINIUM)
    places = np.array([[2e-3, 1e-3, REACH - 4e-4], [-3e-3, 0.0, -REACH + 1e-4]])
    start = places + np.array([[0, 0, 4e-4], [0, 0, -1e-4]])

    def forces(displacements):
        before = tuple(sheet.sphere(place, RADIUS) for place in start)
        after = tuple(sheet.sphere(place, RADIUS) for place in places + displacements)
        return sheet.equilibrium(sheet.flat(), before, after, sheet.everywhere())

    stiffness = sheet.reaction(forces(np.zeros((2, 3))))
    for tool in range(2):
        only = np.eye(2)[tool][:, None]
        mine, others = (
            felt(lambda d, k=k, o=only: forces(o * d).forces[k]) for k in (tool, 1 - tool)
        )
        assert np.linalg.eigvalsh(mine)[0] < -AGREES * mine.max()
        found = stiffness.reshape(2, 3, 2, 3)[:, :, tool]
        assert_agrees(found[tool], not_negative(mine))
        assert np.abs(others).max() > 0.1 * np.abs(mine).max()
        assert_agrees(found[1 - tool], others)
        assert_symmetric_and_not_negative(found[tool])


def process(part: Frame, path: ToolPath, **changes):
    data = tomllib.loads((CASES / "cone_fem.toml").read_text())["process"]
    data |= {"sheet_size_m": [0.04, 0.04], "element_m": 0.005, "position_m": 0.002}
    return PROCESSES["sheet-fem"].model_validate(data | changes).process(Task(part, path))


TURNED = Frame(np.array([1.6, -0.3, 0.8]), Rotation.from_rotvec([0.3, -0.5, 0.9]))


@pytest.fixture(scope="module")
def stroke():
    """A plunge, a travel and the way up on a turned part, and which sample's position is moved."""
    points = 1e-3 * np.array(
        [[-2, 1, 2], [-2, 1, 0.5], [-2, 1, -0.3], [0, 1, -0.4], [1, 1, -0.4], [1, 1, 2], [1, 1, 3]]
    )
    path = tool_path(TURNED, np.arange(7.0), points)
    positions = np.array([0, 1, 2, 3, 5, 6])  # sample 4 is between two of them
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    every = Schedule(positions, arc)
    model = replace(process(TURNED, path, force_factor=1.3), schedule=every)
    return model, path, model.evaluate(path)


def test_stated_stiffness_is_that_of_the_answer_in_base_axes_with_the_force_factor(stroke):
    """Only that sample is moved: what is before it stays, what comes after is not read."""
    model, path, answer = stroke

    def force(displacement):
        deviation = np.zeros((1, 7, 6))
        deviation[0, 3, :3] = displacement
        return model.evaluate(path.displaced(deviation)).wrench.force[0, 3]

    assert answer.stiffness.shape == (7, 3, 3)
    assert_agrees(answer.stiffness[3], not_negative(felt(force)))
    assert_symmetric_and_not_negative(answer.stiffness)


def test_between_two_positions_it_is_interpolated_as_the_force_is(stroke):
    model, _, answer = stroke
    arc, stiffness, force = model.schedule.arc, answer.stiffness, answer.wrench.force[0]
    share = (arc[4] - arc[3]) / (arc[5] - arc[3])
    for values in (stiffness, force):
        between = (1.0 - share) * values[3] + share * values[5]
        np.testing.assert_allclose(values[4], between, rtol=1e-9, atol=1e-12 * np.abs(values).max())


def test_between_two_positions_the_tool_is_held_by_the_stated_stiffness(stroke):
    """F(x + d) = F(x) - K d there, and none rather than one that pulls; other samples stay."""
    model, path, answer = stroke
    normal = TURNED.rotation.apply([0.0, 0.0, 1.0])
    for displacement in (np.array([2e-6, -1e-6, 3e-6]), -2e-5 * normal, 1e-2 * normal):
        deviation = np.zeros((1, 7, 6))
        deviation[0, 4, :3] = displacement
        moved = model.evaluate(path.displaced(deviation))
        force = answer.wrench.force[0, 4] - answer.stiffness[4] @ displacement
        if displacement @ normal > 1e-3:
            force = np.zeros(3)
            assert np.all(moved.stiffness[4] == 0.0)
        np.testing.assert_allclose(moved.wrench.force[0, 4], force, atol=1e-9)
        others = np.arange(7) != 4
        assert np.array_equal(moved.wrench.force[0, others], answer.wrench.force[0, others])


def test_a_tool_in_the_air_feels_nothing(stroke):
    _, _, answer = stroke
    assert np.all(answer.stiffness[[0, 1, 5, 6]] == 0.0)
    assert np.trace(answer.stiffness[3]) > 1e4
