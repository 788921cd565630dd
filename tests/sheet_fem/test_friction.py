"""Coulomb friction between a sphere and the sheet."""

import tomllib
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from places import CASES
from scipy.spatial.transform import Rotation

pytest.importorskip("numba")

from coupling.path.frame import Frame
from coupling.path.linear import interpolate_rows
from coupling.process import PROCESSES
from coupling.sheet_fem.contact import elastic_slip
from coupling.sheet_fem.forming import SheetModel, SheetSettings
from coupling.sheet_fem.material import Material
from coupling.sheet_fem.mesh import SheetMesh
from coupling.sheet_fem.state import SheetState
from coupling.toolpaths import Task
from coupling.toolpaths.part import tool_path
from tests.helpers.full_matrix import full_of

ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
THICKNESS, RADIUS = 1e-3, 5e-3
REACH = RADIUS + 0.5 * THICKNESS
SLIP = 0.01 * THICKNESS


def model(friction: float, side: float = 0.02, elements: int = 10, **settings) -> SheetModel:
    mesh = SheetMesh((side, side), (elements, elements), THICKNESS)
    return SheetModel(mesh, ALUMINIUM, SheetSettings(friction=friction, **settings))


def bedded(friction: float) -> SheetModel:
    """Return a sheet on a rigid plane without a hole: hardly anything bends or stretches."""
    return model(friction, side=0.005, elements=10, opening_radius=1e-6)


def dragged(sheet: SheetModel, *places: tuple[float, float, float]):
    """Return the equilibria of a tool that goes from place to place, the whole sheet solved."""
    found, state = [], sheet.flat()
    tools = [sheet.sphere(np.array(place), RADIUS) for place in places]
    for before, after in pairwise(tools):
        found.append(sheet.equilibrium(state, (before,), (after,), sheet.everywhere()))
        state = found[-1].state
    return found


vectors = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).map(np.array)


def slipped(drift, normal, distance, length):
    slip, tangent = np.empty(3), np.empty((3, 3))
    elastic_slip(drift, normal, distance, length, slip, tangent)
    return slip, tangent


@given(vectors, vectors, st.sampled_from([0.1, 10.0]))
def test_slip_is_tangential_never_beyond_its_length_and_dissipates(drift, direction, length):
    """|s| <= length is the cone |t| <= mu p; s . (P drift - s) >= 0 is the work lost."""
    if np.linalg.norm(direction) < 1e-3:
        return
    normal = direction / np.linalg.norm(direction)
    slip, _ = slipped(drift, normal, 1.3, length)
    along = drift - normal * (normal @ drift)
    assert np.linalg.norm(slip) <= length * (1.0 + 1e-12)
    assert abs(slip @ normal) < 1e-12
    assert slip @ (along - slip) >= -1e-14
    np.testing.assert_allclose(np.cross(slip, along), 0.0, atol=1e-12)
    if np.linalg.norm(along) < length:
        np.testing.assert_allclose(slip, along, atol=1e-14)


@pytest.mark.parametrize("length", [0.2, 20.0])  # slides; sticks
def test_slip_tangent_is_the_derivative_by_the_place_of_the_point(length):
    center, start = np.array([0.1, -0.2, 5.0]), np.array([0.3, 0.1, 0.4])
    moved, old = np.array([1.5, -0.7, -0.9]), np.array([0.05, 0.02, 0.0])

    def at(point):
        apart = center - point
        distance = np.linalg.norm(apart)
        drift = old + point - start - moved
        return slipped(drift, apart / distance, distance, length)

    point = np.array([0.6, -0.3, 0.2])
    step = 1e-6
    numeric = np.column_stack(
        [(at(point + e)[0] - at(point - e)[0]) / (2.0 * step) for e in step * np.eye(3)]
    )
    np.testing.assert_allclose(at(point)[1], numeric, atol=1e-8 * max(1.0, length))


@pytest.mark.parametrize("drag", [3e-6, 4e-4])  # sticks; slides
def test_whole_tangent_with_friction_is_the_derivative_of_the_residual(drag):
    """Unsymmetric, and so tried with two vectors: K d from central differences, and K^-1 K d = d."""
    sheet = model(0.3, side=0.02, elements=5)
    rng = np.random.default_rng(5)
    flat = sheet.flat()
    tool = sheet.sphere(np.array([1e-3, 2e-3, REACH - 2e-4]), RADIUS)
    tool = tool._replace(displacement=np.array([drag, -0.5 * drag, -drag]))
    old = sheet.assemble.no_slip(tool)
    old[...] = 1e-6 * rng.normal(size=old.shape)
    before = replace(flat, slip=(old,))
    points = flat.points + 1e-5 * rng.normal(size=flat.points.shape)

    def assembled(points):
        after = SheetState(
            points, flat.plastic.copy(), flat.stretch.copy(), (sheet.assemble.no_slip(tool),)
        )
        return sheet.assemble(sheet.everywhere(), before, (tool,), after)

    stiffness = assembled(points).stiffness
    moving = sheet.mesh.clamped()
    step = 1e-10
    for _ in range(3):
        direction = np.where(moving, rng.normal(size=points.shape), 0.0)
        ahead = assembled(points + step * direction).residual
        behind = assembled(points - step * direction).residual
        numeric = (ahead - behind) / (2.0 * step)
        exact = full_of(stiffness) @ direction.ravel()
        assert np.linalg.norm(numeric - exact) < 1e-5 * np.linalg.norm(exact)
        np.testing.assert_allclose(stiffness.solve(exact), direction.ravel(), atol=1e-8)
    other = np.where(moving, rng.normal(size=points.shape), 0.0).ravel()
    there, back = other @ exact, direction.ravel() @ full_of(stiffness) @ other
    assert abs(there - back) > 1e-6 * abs(there), "friction makes it unsymmetric"


def test_a_dragged_tool_feels_mu_times_its_normal_force():
    """Rigid limit: F_t = mu F_n against the motion, with a moment R F_t about the centre.

    The contact angle is sqrt(2 h / R) = 0.06 at most: its square is what normals differ by.
    """
    mu = 0.2
    *_, found = dragged(
        bedded(mu), (0.0, 0.0, REACH + 1e-5), (0.0, 0.0, REACH - 1e-5), (3e-4, 4e-4, REACH - 1e-5)
    )
    force, moment = found.forces[0], found.moments[0]
    assert force[2] > 20.0
    drag = mu * force[2] * np.array([-0.6, -0.8])
    np.testing.assert_allclose(force[:2], drag, atol=0.005 * mu * force[2])
    np.testing.assert_allclose(
        moment, RADIUS * np.array([drag[1], -drag[0], 0.0]), atol=0.005 * RADIUS * mu * force[2]
    )


def test_a_tool_that_moves_less_than_the_slip_length_sticks():
    """F_t = mu F_n u / length below it, and back at zero where the tool turns back."""
    mu, height = 0.2, REACH - 1e-5
    found = dragged(
        bedded(mu), (0, 0, REACH + 1e-5), (0, 0, height), (0.3 * SLIP, 0, height), (0, 0, height)
    )
    there, back = found[1].forces[0], found[2].forces[0]
    assert -there[0] == pytest.approx(0.3 * mu * there[2], rel=0.03)
    assert abs(back[0]) < 0.003 * mu * back[2]


def test_friction_opposes_the_motion_and_turns_round_with_it():
    mu, height = 0.1, REACH - 1e-5
    found = dragged(
        bedded(mu), (0, 0, REACH + 1e-5), (0, 0, height), (2e-4, 0, height), (0, 0, height)
    )
    assert -found[1].forces[0, 0] == pytest.approx(mu * found[1].forces[0, 2], rel=0.01)
    assert found[2].forces[0, 0] == pytest.approx(mu * found[2].forces[0, 2], rel=0.01)


def test_each_of_two_tools_has_friction_of_its_own():
    """A clamped sheet pinched between two: the one that travels is braked, the other sticks.

    What also holds it is the dent that both have squeezed into the sheet, as it does without friction.
    """
    mu, depth = 0.2, 2e-5
    sheet = model(mu, side=0.005, elements=10)
    smooth = model(0.0, side=0.005, elements=10)
    above, below = (
        [sheet.sphere(np.array([0.0, 0.0, side * height]), RADIUS) for side in (1.0, -1.0)]
        for height in (REACH, REACH - depth)
    )
    pinch = (tuple(above), tuple(below))
    pinched = sheet.equilibrium(sheet.flat(), *pinch, sheet.everywhere())
    slippery = smooth.equilibrium(smooth.flat(), *pinch, smooth.everywhere())
    there = sheet.sphere(np.array([1e-4, 0.0, REACH - depth]), RADIUS)
    for moved, k in (((there, below[1]), 0), ((below[0], there._replace(center=-there.center)), 1)):
        found = sheet.equilibrium(pinched.state, tuple(below), moved, sheet.everywhere())
        without = [tool._replace(friction=0.0) for tool in (*below, *moved)]
        dent = smooth.equilibrium(
            slippery.state, tuple(without[:2]), tuple(without[2:]), smooth.everywhere()
        )
        normal = abs(found.forces[:, 2])
        way = 1.0 - 2.0 * k  # of the tool that travels, along x
        assert normal.min() > 20.0
        drag = -way * (found.forces[k, 0] - dent.forces[k, 0])
        assert drag == pytest.approx(mu * normal[k], rel=0.02)
        assert abs(found.forces[1 - k, 0]) < 0.1 * mu * normal[1 - k]


STROKE = (
    (-3e-3, 0.0, REACH + 1e-5), (-3e-3, 0.0, REACH - 4e-4), (-1e-3, 5e-4, REACH - 4e-4),
    (1e-3, 1e-3, REACH - 4e-4), (3e-3, 1e-3, REACH - 4e-4),
)  # fmt: skip


@pytest.fixture(scope="module")
def strokes():
    """Return the equilibria of a stroke in a free sheet over the coefficient of friction."""
    coefficients = (0.0, 1e-9, 0.1, 0.3)
    return {mu: dragged(model(mu, side=0.03, elements=12), *STROKE) for mu in coefficients}


def test_no_friction_is_the_limit_of_little(strokes):
    """The general matrix and its solver against the symmetric ones."""
    for none, little in zip(strokes[0.0], strokes[1e-9], strict=True):
        np.testing.assert_allclose(little.forces, none.forces, atol=1e-3)
        np.testing.assert_allclose(little.state.points, none.state.points, atol=1e-8)
        assert np.all(none.moments == 0.0)
        assert all(slip.size == 0 for slip in none.state.slip)


@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_stroke_in_a_yielding_sheet_is_braked_within_the_cone(strokes, mu):
    """The force against the stroke is mu F_n = mu F / sqrt(1 + mu^2) more than without friction."""
    for place, there, found, none in zip(
        STROKE[1:-1], STROKE[2:], strokes[mu][1:], strokes[0.0][1:], strict=True
    ):
        along = np.subtract(there, place)
        along /= np.linalg.norm(along)
        size = np.linalg.norm(found.forces[0])
        braking = -(found.forces[0] - none.forces[0]) @ along
        assert braking == pytest.approx(mu * size / np.sqrt(1.0 + mu**2), rel=0.005)
        slip = found.state.slip[0]
        assert np.max(np.linalg.norm(slip, axis=-1)) <= SLIP * (1.0 + 1e-9)


def test_a_tool_that_travels_does_not_feel_the_slip_length(strokes, monkeypatch):
    """A tenth and ten times of it: the force changes by less than a two-thousandth."""
    for length in (0.1 * SLIP, 10.0 * SLIP):
        monkeypatch.setattr("coupling.sheet_fem.forming._SLIP", length / THICKNESS)
        found = dragged(model(0.3, side=0.03, elements=12), *STROKE)
        for here, there in zip(found[1:], strokes[0.3][1:], strict=True):
            np.testing.assert_allclose(here.forces, there.forces, atol=5e-4 * there.forces[0, 2])


def test_slip_is_forgotten_out_of_contact(strokes):
    slip = strokes[0.3][-1].state.slip[0]
    touched = np.argwhere(np.any(slip != 0.0, axis=(2, 3)))
    middle = (touched + 0.5) * 0.0025 - 0.015
    assert np.max(np.linalg.norm(middle - [3e-3, 1e-3], axis=1)) < 3.5e-3


def test_a_point_that_loses_contact_in_an_iteration_loses_its_slip():
    sheet = model(0.3, elements=5)
    flat = sheet.flat()
    away = sheet.sphere(np.array([0.0, 0.0, REACH + 1e-3]), RADIUS)
    before = replace(flat, slip=(sheet.assemble.no_slip(away),))
    after = replace(flat, slip=(sheet.assemble.no_slip(away) + 1e-6,))
    sheet.assemble(sheet.everywhere(), before, (away,), after)
    assert np.all(after.slip[0] == 0.0)


def test_the_case_s_coefficient_reaches_the_tool_at_its_tip():
    """Along a stroke in +x: mu F_z more against it, and hardly a moment about the TCP from that."""
    text = (CASES / "cone_fem.toml").read_text()
    small = {"sheet_size_m": [0.04, 0.04], "element_m": 0.004, "position_m": 0.002}
    data = tomllib.loads(text)["process"] | small
    part = Frame(np.array([1.0, 0.2, 0.3]), Rotation.identity())
    time = np.linspace(0.0, 3.0, 31)
    corners = np.array([[-2e-3, 0, 1e-3], [-2e-3, 0, -4e-4], [2e-3, 0, -4e-4], [2e-3, 0, 1e-3]])
    points = interpolate_rows(time, np.arange(4.0), corners)
    path = tool_path(part, time, points)
    wrenches = [
        PROCESSES["sheet-fem"]
        .model_validate(data | {"friction_coefficient": mu})
        .process(Task(part, path))
        .evaluate(path)
        .wrench.wrench[0]
        for mu in (0.0, 0.2)
    ]
    sliding = (time > 1.5) & (time < 2.0)
    added = (wrenches[1] - wrenches[0])[sliding]
    normal = wrenches[1][sliding, 2]
    np.testing.assert_allclose(-added[:, 0] / normal, 0.2, rtol=0.03)
    assert np.max(np.abs(added[:, 4])) < 0.1 * RADIUS * 0.2 * normal.max()
