"""The backing plate: a rigid plane with a round hole, on which the sheet lies."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("numba")

from coupling.sheet_fem.forming import SheetModel, SheetSettings
from coupling.sheet_fem.material import Material
from coupling.sheet_fem.mesh import SheetMesh
from tests.helpers.full_matrix import full_of

ELASTIC = Material(70e9, 0.33, 3e8, 1.0, 0.0)  # as long as nothing yields
ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
THICKNESS, RADIUS = 1e-3, 5e-3
REACH = RADIUS + 0.5 * THICKNESS
SIDE, ELEMENTS = 0.1, 40
D = 70e9 * THICKNESS**3 / (12.0 * (1.0 - 0.33**2))


def round_clamp(radius: float) -> np.ndarray:
    """Return what may move in a sheet that is clamped outside of a circle."""
    start = SheetMesh((SIDE, SIDE), (ELEMENTS, ELEMENTS), THICKNESS).control_points()
    inside = np.linalg.norm(start[..., :2], axis=-1) < radius
    return np.repeat(inside[..., None], 3, axis=2)


def plunged(material, depth: float, opening: float | None, free=None, side: float = SIDE):
    mesh = SheetMesh((side, side), (ELEMENTS, ELEMENTS), THICKNESS)
    sheet = SheetModel(mesh, material, SheetSettings(opening_radius=opening, window=0.5), free)
    above, below = (sheet.sphere(np.array([0.0, 0.0, REACH - d]), RADIUS) for d in (0.0, depth))
    return sheet, sheet.equilibrium(sheet.flat(), (above,), (below,), sheet.everywhere())


def surface(sheet: SheetModel, found) -> tuple[np.ndarray, np.ndarray]:
    """Return distance from the axis and height of the midsurface at the elements' corners."""
    points = found.state.points
    corners = 0.25 * (points[:-1, :-1] + points[1:, :-1] + points[:-1, 1:] + points[1:, 1:])
    return np.linalg.norm(corners[..., :2], axis=-1).ravel(), corners[..., 2].ravel()


def deflection_per_force(opening: float, clamp: float) -> float:
    """Return w(0) / F of a thin plate on a ring at `opening`, clamped at `clamp`.

    Biharmonic, axially symmetric: w = F r^2 ln(r) / (8 pi D) + A + B r^2 inside of the ring and
    C + E ln(r) + G r^2 + H r^2 ln(r) outside, [Timoshenko1959] chapter 3.  At the ring w vanishes
    on both sides, slope and radial moment agree; at the clamp w and slope vanish.
    """
    a, b, nu = opening, clamp, 0.33

    def rows(r):
        """w, slope and radial curvature w'' + nu w'/r of 1, r^2, ln r, r^2 ln r."""
        log = np.log(r)
        w = np.array([1.0, r**2, log, r**2 * log])
        slope = np.array([0.0, 2 * r, 1 / r, 2 * r * log + r])
        second = np.array([0.0, 2.0, -1 / r**2, 2 * log + 3.0])
        return w, slope, second + nu * slope / r

    (w_a, s_a, m_a), (w_b, s_b, _) = rows(a), rows(b)
    load = 1.0 / (8.0 * np.pi * D)  # of r^2 ln r inside
    matrix, right = np.zeros((6, 6)), np.zeros(6)
    matrix[0, :2], right[0] = w_a[:2], -load * w_a[3]
    matrix[1, 2:] = w_a
    matrix[2, :2], matrix[2, 2:], right[2] = s_a[:2], -s_a, -load * s_a[3]
    matrix[3, :2], matrix[3, 2:], right[3] = m_a[:2], -m_a, -load * m_a[3]
    matrix[4, 2:], matrix[5, 2:] = w_b, s_b
    return abs(float(np.linalg.solve(matrix, right)[0]))


def test_the_closed_form_has_the_known_limits():
    """Clamped at the ring: F a^2 / (16 pi D); without any annulus's help (3+nu)/(1+nu) as much."""
    clamped = 0.02**2 / (16.0 * np.pi * D)
    assert deflection_per_force(0.02, 0.02 * (1 + 1e-5)) == pytest.approx(clamped, rel=1e-3)
    assert clamped < deflection_per_force(0.02, 0.05) < 3.33 / 1.33 * clamped


def test_elastic_sheet_in_an_opening_bends_as_a_plate_on_a_ring():
    """Small deflection of a disc clamped at 45 mm on a plate with a hole of 20 mm."""
    opening, clamp = 0.02, 0.045
    sheet, found = plunged(ELASTIC, 8e-5, opening, round_clamp(clamp))
    radius, height = surface(sheet, found)
    center = height[np.argmin(radius)]
    assert np.all(found.state.plastic[..., 3] == 0.0)
    measured = -center / found.forces[0, 2]
    # Control points inside the circle move: the clamp is between the last of them and the next.
    h = SIDE / ELEMENTS
    least, most = (deflection_per_force(opening, clamp + d) for d in (-0.5 * h, 0.5 * h))
    assert most / least < 1.03
    assert measured == pytest.approx(0.5 * (least + most), rel=0.03)
    outside = (radius > opening + h) & (radius < clamp - h)
    assert np.all(height[outside] > 0.0), "the sheet lifts off the plate"


def test_sheet_lies_on_the_plate_and_moves_the_clamp_to_the_opening():
    """A deep, plastic plunge: outside of the hole it sinks by less than 10 um, within the penalty.

    Without a plate it sinks far more there, and is softer by a third; a sheet clamped all around the
    hole is hardly stiffer than one that lies on the plate, lifts off and slides.
    """
    opening, depth = 0.02, 1.5e-3
    sheet, on_plate = plunged(ALUMINIUM, depth, opening)
    radius, height = surface(sheet, on_plate)
    outside = radius > opening + 0.5 * SIDE / ELEMENTS
    assert height[outside].min() > -1e-5
    _, without = plunged(ALUMINIUM, depth, None)
    assert surface(sheet, without)[1][outside].min() < -3e-4
    _, clamped = plunged(ALUMINIUM, depth, None, round_clamp(opening))
    forces = [found.forces[0, 2] for found in (without, on_plate, clamped)]
    assert forces[0] < 0.67 * forces[1]
    assert 0.95 * forces[2] < forces[1] < forces[2]


def test_plate_and_clamps_carry_the_tool():
    """The plate's force is what the sheet's own forces leave over: it pushes up only."""
    opening = 0.02
    sheet, found = plunged(ALUMINIUM, 1e-3, opening)
    free = SheetModel(sheet.mesh, ALUMINIUM, free=np.ones((ELEMENTS + 2, ELEMENTS + 2, 3), bool))
    state = replace(found.state, slip=())  # at rest: its stresses follow from its plastic strains
    internal = free.assemble(free.everywhere(), state, (), state).residual
    internal = internal.reshape(state.points.shape)
    held = ~sheet.mesh.clamped()[..., 0]
    radius = np.linalg.norm(sheet.flat().points[..., :2], axis=-1)
    ring = ~held & (radius > 0.5 * opening)
    # Where neither tool nor clamp acts, what the sheet carries comes from the plate.
    plate = internal[ring, 2]
    assert plate.sum() > 0.5 * found.forces[0, 2]
    assert plate.min() > -1e-3 * plate.sum()
    total = internal[held, 2].sum() + plate.sum()
    assert total == pytest.approx(found.forces[0, 2], rel=1e-3)


def sunk_onto(edge: float, opening: float, depth: float):
    """Return a flat sheet pushed down by a depth, and a function of its points: what acts on it."""
    mesh = SheetMesh((0.06, 0.06), (24, 24), THICKNESS)
    sheet = SheetModel(mesh, ELASTIC, SheetSettings(opening_radius=opening, edge_radius=edge))
    flat = sheet.flat()

    def pushed(points: np.ndarray):
        after = replace(
            flat, points=points, plastic=flat.plastic.copy(), stretch=flat.stretch.copy()
        )
        return sheet.assemble(sheet.everywhere(), flat, (), after)

    return pushed, flat.points - [0.0, 0.0, depth]


def test_a_sunk_sheet_is_borne_by_the_edge_as_by_its_torus():
    """Force on the ring that is 0.3 mm deep in a torus, beyond a plate without an edge.

    Closed form: pressure k (p - s/2) with the penetration p(r) = R - |(r - r_p, R - depth)|,
    R = edge + t/2, r_p where the plate is plane, times its vertical share, over the ring.
    """
    edge, opening, depth = 4e-3, 0.016, 3e-4
    vertical = []
    for plate in ((edge, opening), (0.0, opening + edge)):
        pushed, points = sunk_onto(*plate, depth)
        residual = pushed(points).residual.reshape(points.shape)
        inner = (
            np.linalg.norm(points[..., :2], axis=-1) < 0.026
        )  # nothing else acts on a flat sheet
        vertical.append(-residual[inner, 2].sum())
    tube, plane = edge + 0.5 * THICKNESS, opening + edge
    stiffness, smoothing = 0.3 * 70e9 / THICKNESS, 0.003 * THICKNESS
    r = np.linspace(plane - tube, plane, 100_001)
    distance = np.hypot(r - plane, tube - depth)
    p = np.maximum(tube - distance, 0.0)
    size = np.where(p < smoothing, 0.5 * p**2 / smoothing, p - 0.5 * smoothing) * stiffness
    expected = np.trapezoid(2.0 * np.pi * r * size * (tube - depth) / distance, r)
    # The ring is 1.6 mm wide, with contact points 0.3 mm apart.
    assert vertical[0] - vertical[1] == pytest.approx(expected, rel=0.02)


def test_the_tangent_of_a_rounded_edge_is_the_derivative_of_its_force():
    """Central differences along a random change of a sheet that is pushed onto the edge askew."""
    pushed, points = sunk_onto(4e-3, 0.016, 1e-4)
    free = SheetMesh((0.06, 0.06), (24, 24), THICKNESS).clamped()
    points[..., 0] += 3e-4
    change = np.random.default_rng(16).normal(size=points.shape) * free
    h = 1e-9
    forces = [pushed(points + sign * h * change).residual for sign in (1.0, -1.0)]
    expected = full_of(pushed(points).stiffness) @ change.ravel()
    np.testing.assert_allclose(
        (forces[0] - forces[1]) / (2.0 * h), expected, atol=1e-5 * np.abs(expected).max()
    )
