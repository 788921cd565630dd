"""The sheet's mechanics against closed forms and finite differences."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("numba")

from coupling.sheet_fem.assembly import Assembler
from coupling.sheet_fem.banded import SymmetricBanded
from coupling.sheet_fem.contact import Surface
from coupling.sheet_fem.forming import SheetModel, SheetSettings
from coupling.sheet_fem.material import Material, hollomon_prestrain, yield_stress
from coupling.sheet_fem.mesh import SheetMesh, basis, gauss, midpoints
from coupling.sheet_fem.return_mapping import plane_stress
from coupling.sheet_fem.section import CrossSection, section
from coupling.sheet_fem.shell import Shell
from coupling.sheet_fem.state import SheetState
from tests.helpers.full_matrix import full_of

ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
ELASTIC = Material(70e9, 0.33, 1e15, 1.0, 0.0)
THICKNESS = 1e-3
# 1e-3 of the first yield stress times the thickness squared [N].
NEWTON_TOLERANCE = 1e-3 * 180e6 * 0.00057**0.229 * THICKNESS**2


def gauss_layers(count: int) -> np.ndarray:
    return np.array(np.polynomial.legendre.leggauss(count))


def resultants(
    material: Material, strain: np.ndarray, plastic: np.ndarray, layers: int = 5
) -> tuple[np.ndarray, np.ndarray]:
    """Return forces and moments, and their derivative, of (da11, da22, 2 da12)/2, b11, b22, 2 b12."""
    result, tangent, after = np.empty(6), np.empty((6, 6)), np.empty_like(plastic)
    a = np.array([1.0 + 2.0 * strain[0], 1.0 + 2.0 * strain[1], strain[2]])
    b = np.array([strain[3], strain[4], 0.5 * strain[5]])
    cross = CrossSection(material, THICKNESS, gauss_layers(layers))
    section(cross, a, b, plastic, result, tangent, after)
    return result, tangent


@pytest.mark.parametrize("amplitude", [0.0, 1e-9, 1e-4, 0.2])
def test_section_tangent_is_the_derivative_of_its_forces(amplitude):
    """Central differences; from the flat sheet over nearly equal stretches to 20 % strain."""
    rng = np.random.default_rng(3)
    strain = amplitude * rng.normal(size=6) * [1, 1, 1, 700, 700, 700]
    plastic = np.zeros((5, 4))
    _, tangent = resultants(ALUMINIUM, strain, plastic)
    steps = np.array([1e-7, 1e-7, 1e-7, 1e-4, 1e-4, 1e-4])
    numeric = np.column_stack(
        [
            (
                resultants(ALUMINIUM, strain + e, plastic)[0]
                - resultants(ALUMINIUM, strain - e, plastic)[0]
            )
            / (2.0 * h)
            for e, h in zip(np.diag(steps), steps, strict=True)
        ]
    )
    scale = np.sqrt(np.outer(np.diag(tangent), np.diag(tangent)))
    np.testing.assert_allclose(numeric / scale, tangent / scale, atol=2e-7)
    np.testing.assert_allclose(tangent / scale, tangent.T / scale, atol=1e-14)


def returned(material: Material, strain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    stress, tangent, after = np.empty(3), np.empty((3, 3)), np.empty(4)
    plane_stress(material, strain, np.zeros(4), stress, tangent, after)
    return stress, after


@pytest.mark.parametrize("plastic_strain", [1e-6, 1e-3, 0.3])
def test_uniaxial_tension_follows_the_hardening_curve(plastic_strain):
    """With lateral strain -nu sigma/E - eps_p/2 the stress is (sigma(eps_p), 0, 0)."""
    E, nu = ALUMINIUM.youngs_modulus, ALUMINIUM.poisson_ratio
    sigma, _ = yield_stress(ALUMINIUM, plastic_strain)
    strain = np.array([sigma / E + plastic_strain, -nu * sigma / E - 0.5 * plastic_strain, 0.0])
    stress, after = returned(ALUMINIUM, strain)
    np.testing.assert_allclose(stress, [sigma, 0.0, 0.0], atol=1e-9 * sigma)
    assert after[3] == pytest.approx(plastic_strain, rel=1e-8)


def test_pure_shear_yields_at_the_von_mises_stress():
    """sqrt(3) tau = sigma_y for an ideally plastic metal."""
    ideal = Material(70e9, 0.33, 100e6, 1.0, 0.0)
    stress, _ = returned(ideal, np.array([0.0, 0.0, 0.05]))
    np.testing.assert_allclose(stress, [0.0, 0.0, 100e6 / np.sqrt(3.0)], rtol=1e-12, atol=1e-3)


@pytest.mark.parametrize("exponent", [0.0, 0.1, 0.229, 0.6, 1.0])
@pytest.mark.parametrize("prestrain", [1e-6, 5e-4, 0.05])
def test_flow_ends_on_the_yield_surface_however_far_it_was_beyond(exponent, prestrain):
    rng = np.random.default_rng(7)
    metal = Material(70e9, 0.33, 180e6, prestrain, exponent)
    flowed = 0
    for size in np.geomspace(1e-5, 1.0, 120):
        before = np.array([*(0.01 * rng.normal(size=2)), 0.0, 0.3 * rng.random()])
        after, stress, tangent = np.empty(4), np.empty(3), np.empty((3, 3))
        plane_stress(metal, before[:3] + size * rng.normal(size=3), before, stress, tangent, after)
        s1, s2, s12 = stress
        mises = np.sqrt(s1**2 - s1 * s2 + s2**2 + 3.0 * s12**2)
        limit, _ = yield_stress(metal, after[3])
        assert mises <= limit * (1.0 + 1e-9)
        if after[3] > before[3]:
            assert mises == pytest.approx(limit, rel=1e-12)
            flowed += 1
    assert flowed > 60


def test_hollomon_meets_hooke_at_its_prestrain():
    prestrain = hollomon_prestrain(70e9, 180e6, 0.2)
    assert 180e6 * prestrain**0.2 == pytest.approx(70e9 * prestrain, rel=1e-12)


@pytest.mark.parametrize("overshoot", [1.5, 4.0, 20.0])
def test_plastic_bending_moment_of_a_wide_strip(overshoot):
    """Ideally plastic, incompressible: M = M_p (1 - (kappa_y / kappa)^2 / 3), plane strain.

    M_p = (2 / sqrt 3) sigma_0 t^2 / 4; yield starts at kappa_y = 2 (2 / sqrt 3) sigma_0 / (E' t)
    with E' = E / (1 - nu^2) = 4 E / 3.  Curvatures are small, so that logarithms do not matter.
    """
    E, sigma = 70e9, 1e6
    metal = Material(E, 0.5 - 1e-9, sigma, 1.0, 0.0)
    limit = 2.0 / np.sqrt(3.0) * sigma
    kappa_y = 2.0 * limit / (4.0 / 3.0 * E * THICKNESS)
    strain = np.array([0.0, 0.0, 0.0, overshoot * kappa_y, 0.0, 0.0])
    moment = resultants(metal, strain, np.zeros((200, 4)), layers=200)[0][3]
    expected = limit * THICKNESS**2 / 4.0 * (1.0 - 1.0 / (3.0 * overshoot**2))
    assert moment == pytest.approx(expected, rel=1e-3)
    five = resultants(metal, strain, np.zeros((5, 4)))[0][3]
    assert five == pytest.approx(expected, rel=0.06)  # what five layers cost


def model(
    side: float, elements: int, material: Material = ALUMINIUM, free: bool = False
) -> SheetModel:
    mesh = SheetMesh((side, side), (elements, elements), THICKNESS)
    mask = np.ones((elements + 2, elements + 2, 3), dtype=bool) if free else None
    return SheetModel(mesh, material, SheetSettings(), mask)


def moved(sheet: SheetModel, points: np.ndarray, *spheres) -> SheetState:
    """Return the flat sheet with its control points elsewhere, for its history to be written."""
    slip = tuple(sheet.assemble.no_slip(sphere) for sphere in spheres)
    return replace(sheet.flat(), points=points, slip=slip)


def residual(sheet: SheetModel, points: np.ndarray, *spheres) -> tuple[np.ndarray, SymmetricBanded]:
    """Return unbalanced forces and the stiffness of the whole sheet from its flat state."""
    flat = moved(sheet, sheet.flat().points, *spheres)
    after = moved(sheet, points, *spheres)
    found = sheet.assemble(sheet.everywhere(), flat, spheres, after)
    return found.residual, found.stiffness


def test_patch_test_uniform_plastic_stretch_is_in_equilibrium():
    """An affine map, 10 % and plastic, leaves no force on inner control points."""
    sheet = model(0.02, 5, free=True)
    stretch = np.array([[1.1, 0.04, 0.0], [-0.02, 0.95, 0.0], [0.3, 0.1, 1.0]])
    points = sheet.flat().points @ stretch.T
    unbalanced = residual(sheet, points)[0].reshape(points.shape)
    inner = np.max(np.abs(unbalanced[2:-2, 2:-2]))
    assert inner < 1e-10 * np.max(np.abs(unbalanced))


def test_a_turned_sheet_carries_no_load():
    """Rigid motion: forces vanish beside those of a stretch of 1e-6."""
    from scipy.spatial.transform import Rotation

    sheet = model(0.02, 4, free=True)
    flat = sheet.flat().points
    turned = Rotation.from_rotvec([0.4, -0.7, 0.2]).apply(flat.reshape(-1, 3)).reshape(flat.shape)
    reference = np.max(np.abs(residual(sheet, flat * (1.0 + 1e-6))[0]))
    assert np.max(np.abs(residual(sheet, turned + 0.1)[0])) < 1e-6 * reference


def test_whole_tangent_is_the_derivative_of_the_residual():
    """Bent, yielding and pressed by the tool; central differences along random directions."""
    sheet = model(0.02, 4)
    rng = np.random.default_rng(5)
    points = sheet.flat().points
    points = points + 1e-4 * rng.normal(size=points.shape)
    tool = sheet.sphere(np.array([1e-3, 2e-3, 5.3e-3]), 5e-3)
    _, stiffness = residual(sheet, points, tool)
    moving = SheetMesh((0.02, 0.02), (4, 4), THICKNESS).clamped()
    for _ in range(3):
        direction = np.where(moving, rng.normal(size=points.shape), 0.0)
        step = 1e-9
        ahead, _ = residual(sheet, points + step * direction, tool)
        behind, _ = residual(sheet, points - step * direction, tool)
        numeric = (ahead - behind) / (2.0 * step)
        exact = full_of(stiffness) @ direction.ravel()
        assert np.linalg.norm(numeric - exact) < 2e-6 * np.linalg.norm(exact)


def cantilever_deflection(elements: int) -> float:
    """Return tip deflection over F L^3 / (3 E I) of a strip clamped at one end; nu = 0."""
    E, length, width = 70e9, 0.05, 0.05 / elements * 2
    mesh = SheetMesh((length, width), (elements, 2), THICKNESS)
    size = mesh.element_size
    free = np.ones((elements + 2, 4, 3), dtype=bool)
    free[:2] = False
    none = np.zeros((elements, 2, 1), dtype=bool)
    metal = Material(E, 0.0, 1e15, 1.0, 0.0)
    assemble = Assembler(
        Shell(CrossSection(metal, THICKNESS, gauss_layers(2)), basis(gauss(2), size)),
        Surface(basis(midpoints(1), size), 0.5 * THICKNESS, none, np.inf, 0.0, 1.0, 1.0),
        mesh.elements,
        free,
    )
    points = mesh.control_points()
    flat = SheetState(points, np.zeros((elements, 2, 4, 2, 4)), np.ones((elements, 2, 4)))
    found = assemble(assemble.everywhere, flat, (), deepcopy(flat))
    load = np.zeros(points.shape)
    # A uniform line load at the edge, where the spline values are 1/2, 1/2; shares along y.
    load[-2:, :, 2] = 0.5 * np.array([1 / 6, 5 / 6, 5 / 6, 1 / 6]) / 2.0
    bent = found.stiffness.solve(load.ravel()).reshape(points.shape)
    tip = float(bent[-2:, 1:3, 2].mean())
    return tip / (length**3 / (3.0 * E * width * THICKNESS**3 / 12.0))


def test_cantilever_converges_to_the_beam_with_second_order():
    errors = [abs(cantilever_deflection(n) - 1.0) for n in (8, 16, 32)]
    assert errors[-1] < 2e-3
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(orders > 1.7), (errors, orders)


def test_clamped_square_plate_under_a_central_force():
    """Small deflection w = 0.00560 F a^2 / D [Timoshenko1959, table 35]."""
    side, elements = 0.1, 40
    sheet = model(side, elements, ELASTIC)
    _, stiffness = residual(sheet, sheet.flat().points)
    load = np.zeros((elements + 2, elements + 2, 3))
    # At the middle, a corner of four elements, the four splines around it are 1/4.
    load[20:22, 20:22, 2] = 0.25
    bent = stiffness.solve(load.ravel()).reshape(load.shape)
    D = ELASTIC.youngs_modulus * THICKNESS**3 / (12.0 * (1.0 - ELASTIC.poisson_ratio**2))
    assert bent[20:22, 20:22, 2].mean() * D / side**2 == pytest.approx(0.00560, rel=0.01)


def test_a_state_that_does_not_converge_is_not_kept():
    from coupling.sheet_fem.equilibrium import NewtonSettings, find_equilibrium

    sheet = model(0.03, 6)
    tool = sheet.sphere(np.array([0.0, 0.0, 4.5e-3]), 5e-3)
    state = moved(sheet, sheet.flat().points, tool)
    copies = [array.copy() for array in (state.points, state.plastic, state.stretch)]
    hasty = NewtonSettings(1e-9, largest_step=1e-3, unchanged=1.0, linear=1.0, max_iterations=2)
    assert find_equilibrium(sheet.assemble, state, (tool,), sheet.everywhere(), hasty) is None
    for before, after in zip(copies, (state.points, state.plastic, state.stretch), strict=True):
        assert np.array_equal(before, after)


def test_tool_force_balances_the_sheet():
    """The force on the sphere is the sum of what the clamps hold: they are found independently."""
    free = model(0.03, 6, free=True)
    held = model(0.03, 6)
    tool = held.sphere(np.array([2e-3, 0.0, 5.0e-3]), 5e-3)
    above = held.sphere(np.array([2e-3, 0.0, 5.6e-3]), 5e-3)
    found = held.equilibrium(held.flat(), (above,), (tool,), held.everywhere())
    reactions, _ = residual(free, found.state.points)
    total = reactions.reshape(-1, 3).sum(axis=0)
    np.testing.assert_allclose(total, 0.0, atol=1e-9 * found.forces[0, 2])
    inner = reactions.reshape(8, 8, 3)[2:-2, 2:-2].sum(axis=(0, 1))
    # Each of the 16 control points that move is in balance within Newton's tolerance.
    np.testing.assert_allclose(-inner, found.forces[0], rtol=0.0, atol=4.0 * NEWTON_TOLERANCE)


@pytest.mark.parametrize("depth", [4.7e-6, 4.95e-6, 5e-4])
def test_the_force_is_that_of_the_tool_s_own_contact(depth):
    """Though the first step is one against a softer contact: also where nothing has to move."""
    sheet = model(0.03, 12)
    above, tool = (sheet.sphere(np.array([0.0, 0.0, 5.5e-3 - d]), 5e-3) for d in (-1e-4, depth))
    found = sheet.equilibrium(sheet.flat(), (above,), (tool,), sheet.everywhere())
    flat = moved(sheet, sheet.flat().points, tool)
    own = sheet.assemble(sheet.everywhere(), flat, (tool,), moved(sheet, found.state.points, tool))
    assert own.wrenches[0, 2] > 0.0
    np.testing.assert_allclose(found.forces[0], own.wrenches[0, :3], rtol=1e-12, atol=1e-12)
