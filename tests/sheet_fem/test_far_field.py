"""The sheet away from the tools: coarse splines, condensed onto the interface of the box about them."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("numba")

from coupling.sheet_fem import assembly
from coupling.sheet_fem.banded import GeneralBanded, SymmetricBanded
from coupling.sheet_fem.border import Bordered
from coupling.sheet_fem.box import Box
from coupling.sheet_fem.coarse import CoarseSplines, refinement
from coupling.sheet_fem.forming import SheetModel, SheetSettings
from coupling.sheet_fem.interface import Interface
from coupling.sheet_fem.macro_elements import MacroElements, fill_cells
from coupling.sheet_fem.material import Material
from coupling.sheet_fem.mesh import SheetMesh
from tests.helpers.full_matrix import full_of

ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
THICKNESS, RADIUS = 1e-3, 5e-3
REACH = RADIUS + 0.5 * THICKNESS


def model(window: float, elements: int = 24, side: float = 0.06, friction: float = 0.0):
    mesh = SheetMesh((side, side), (elements, elements), THICKNESS)
    return SheetModel(mesh, ALUMINIUM, SheetSettings(window=window, friction=friction))


def spline(control: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Evaluate uniform quadratic splines, element k from k to k + 1, by their definition."""
    value = np.zeros(len(at))
    for k, weight in enumerate(control):
        s = at - (k - 2)  # its support is 0..3
        value += weight * np.select(
            [(s >= 0) & (s < 1), (s >= 1) & (s < 2), (s >= 2) & (s < 3)],
            [0.5 * s**2, 0.5 * (-2 * s**2 + 6 * s - 3), 0.5 * (3 - s) ** 2],
        )
    return value


@pytest.mark.parametrize("factor", [1, 2, 3, 4])
def test_a_coarse_spline_is_the_sum_of_fine_ones(factor):
    rng = np.random.default_rng(2)
    coarse = rng.normal(size=7)
    fine = refinement(5, factor) @ coarse
    at = np.linspace(0.0, 5.0, 200, endpoint=False)
    np.testing.assert_allclose(spline(fine, factor * at), spline(coarse, at), atol=1e-13)


def test_an_element_s_blend_is_that_of_the_grid():
    splines = CoarseSplines.of((8, 12))
    rng = np.random.default_rng(3)
    coarse = rng.normal(size=(4, 5, 3))
    fine = splines.fine(coarse)
    for i, j in ((0, 0), (3, 7), (6, 10), (7, 11)):
        corner = coarse[i // 4 : i // 4 + 3, j // 4 : j // 4 + 3].reshape(9, 3)
        own = fine[i : i + 3, j : j + 3].reshape(9, 3)
        np.testing.assert_allclose(splines.blend[i % 4, j % 4] @ corner, own, atol=1e-14)


def test_a_grid_that_cannot_be_cut_into_fours_is_cut_into_what_divides_it():
    assert [CoarseSplines.of((n, 12)).factor for n in (8, 10, 9)] == [4, 2, 1]


@pytest.mark.parametrize("general", [False, True])
@pytest.mark.parametrize(
    ("elements", "apart", "spread"), [(1, 0, 1), (4, 12, 1), (60, 1, 1), (6, 12, 3)]
)
def test_a_bordered_band_is_solved_as_the_full_matrix(elements, apart, spread, general):
    """Of fewer and more rows, and a narrower and a wider band, than are solved for at once."""
    rng = np.random.default_rng(5)
    index = np.array([spread * np.arange(27) + apart * e for e in range(elements)])
    parts = rng.normal(size=(elements, 27, 27))
    parts = parts + parts.swapaxes(1, 2) + 40.0 * np.eye(27)
    if general:
        parts += 0.5 * rng.normal(size=parts.shape)
    n, m, width = int(index.max()) + 1, 5, 26 * spread
    full = np.zeros((n + m, n + m))
    for rows, part in zip(index, parts, strict=True):
        full[np.ix_(rows, rows)] += part
    held = np.setdiff1d(np.arange(n), index)
    full[held, held] = 1.0
    across, outer = rng.normal(size=(n, m)), 30.0 * np.eye(m)
    across[: n // 3] = 0.0
    full[:n, n:], full[n:, :n], full[n:, n:] = across, across.T, outer
    band = GeneralBanded if general else SymmetricBanded
    matrix = Bordered(band.of(index, parts, n, width), across, outer)
    right = rng.normal(size=(n + m, 3))
    np.testing.assert_allclose(matrix.solve(right), np.linalg.solve(full, right), rtol=1e-9)
    np.testing.assert_allclose(full_of(matrix) @ right[:, 0], full @ right[:, 0], rtol=1e-12)


@pytest.mark.parametrize("band", [GeneralBanded, SymmetricBanded])
def test_a_stiffness_that_is_no_number_has_factors_that_are_none(band):
    """No shift makes it definite: to look for one would not end."""
    index, parts = np.arange(27)[None], np.full((1, 27, 27), np.nan)
    half = band.of(index, parts, 27, 26).factor().forward(np.ones((27, 1)))
    assert not np.all(np.isfinite(half))


@pytest.mark.parametrize("plate", [False, True])
def test_cells_do_what_the_fine_sheet_does_to_moves_of_coarse_splines(plate):
    """A bent and partly plastic sheet, half of its elements in one evaluation and half in another."""
    settings = SheetSettings(opening_radius=0.012, edge_radius=4e-3) if plate else SheetSettings()
    sheet = SheetModel(SheetMesh((0.06, 0.06), (24, 24), THICKNESS), ALUMINIUM, settings)
    assemble, free, splines = sheet.assemble, sheet.mesh.clamped(), CoarseSplines.of((24, 24))
    rng = np.random.default_rng(11)
    flat = sheet.flat()
    radius = np.linalg.norm(flat.points[..., :2], axis=-1)
    points = flat.points + 2e-6 * rng.normal(size=free.shape) * free
    points[..., 2] -= 1e-3 * np.clip(1.0 - radius / 0.02, 0.0, None) ** 2 + 1e-6
    moved = replace(deepcopy(flat), points=points)
    whole = assemble(assemble.everywhere, flat, (), moved)
    assert 0.05 < np.mean(moved.plastic[..., 3] > 0.0) < 0.95

    each, places = MacroElements.none(36), np.argwhere(np.ones((6, 6)))
    sheet_and_plate = assemble._shell, assemble._surface, splines.blend
    force, stiffness = np.zeros((36, 27)), np.zeros((36, 27, 27))
    chosen = rng.random((24, 24)) < 0.5
    for outside in (chosen, ~chosen):
        history = np.empty_like(moved.plastic), np.empty_like(moved.stretch)
        acting = outside, places, points, flat.plastic, each.force, each.stiffness
        fill_cells(*sheet_and_plate, *acting, *history)
        force += each.force
        stiffness += each.stiffness
        np.testing.assert_allclose(history[0][outside], moved.plastic[outside], atol=1e-14)
        np.testing.assert_allclose(history[1][outside], moved.stretch[outside], rtol=1e-14)

    moves = ~splines.touching(~free)
    coarse = rng.normal(size=moves.shape) * moves
    followed = np.einsum(
        "eij,ej->ei", stiffness, coarse.reshape(-1, 3)[splines.patches].reshape(-1, 27)
    )
    fine = whole.residual, full_of(whole.stiffness) @ splines.fine(coarse).ravel()
    for found, nodal in zip((force, followed), fine, strict=True):
        at_splines = np.zeros((coarse.size // 3, 3))
        np.add.at(at_splines, splines.patches, found.reshape(-1, 9, 3))
        expected = np.einsum(
            "iI,ijk,jJ->IJk", splines.along_x, nodal.reshape(free.shape), splines.along_y
        )
        scale = np.abs(expected[moves]).max()
        np.testing.assert_allclose(
            at_splines.reshape(coarse.shape)[moves], expected[moves], atol=1e-11 * scale
        )


def test_a_condensed_far_field_answers_as_all_coarse_and_fine_unknowns_together():
    """A box about the middle of a bent sheet, against the whole stiffness in the same space of moves."""
    sheet = model(0.012)
    assemble, free = sheet.assemble, sheet.mesh.clamped()
    rng = np.random.default_rng(7)
    state = sheet.flat()
    state = replace(state, points=state.points + 1e-7 * rng.normal(size=state.points.shape) * free)
    whole = assemble(assemble.everywhere, state, (), state)
    columns = full_of(whole.stiffness).T
    box = Box(8, 18, 9, 19)
    interface = Interface.of(CoarseSplines.of((24, 24)), box, free)
    inside = box.inside(free.shape)
    # Moves: each control point of the box alone; each coarse spline with a part outside, truncated.
    moves = []
    for x, y in np.argwhere(inside):
        for k in range(3):
            moves.append(np.zeros(free.shape))
            moves[-1][x, y, k] = 1.0
    for place in np.argwhere((interface.outer >= 0) | (interface.inner >= 0)):
        coarse = np.zeros(interface.outer.shape)
        coarse[tuple(place)] = 1.0
        moves.append(np.where(inside[..., None], 0.0, interface.splines.fine(coarse)))
    space = np.array([move.ravel() for move in moves])
    assert np.linalg.matrix_rank(space) == len(space)
    push = np.zeros(free.shape)
    push[13, 14, 2] = 1.0
    reduced = space @ np.array(columns) @ space.T
    expected = space.T @ np.linalg.solve(reduced, space @ (push.ravel() - whole.residual))

    after = replace(
        state,
        far_field=assemble.linear(interface, state, state, 0.0),
        at_interface=np.zeros(interface.size),
    )
    after.far_field.carry(after.at_interface, after.points)
    found = assemble(box, state, (), after)
    at_interface = np.zeros(interface.size)
    step = found.stiffness.solve(
        np.concatenate([push[inside].ravel(), at_interface]) - found.residual
    )
    points = after.points.copy()
    after.far_field.carry(step[3 * box.size :], points)
    points[inside] += step[: 3 * box.size].reshape(-1, 3)
    # What is at rest outside moves at once: the box is then seen from another place by so much.
    np.testing.assert_allclose(
        (points - state.points).ravel(), expected, atol=2e-3 * np.abs(expected).max()
    )


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_what_is_coarse_changes_the_force_little(friction):
    """A plunge and a travel, against the whole sheet fine: 3 % of the force, 2 % of the depth."""
    forces, points = [], []
    for window in (0.015, 0.1):
        sheet = model(window, friction=friction)
        state, before = sheet.flat(), sheet.sphere(np.array([-4e-3, 0.0, REACH]), RADIUS)
        box = None
        for x, depth in ((-4e-3, 3e-4), (-4e-3, 8e-4), (0.0, 8e-4), (4e-3, 8e-4)):
            tool = sheet.sphere(np.array([x, 1e-3, REACH - depth]), RADIUS)
            box = sheet.near(box, tool.center[None])
            found = sheet.equilibrium(state, (before,), (tool,), box)
            state, before = found.state, tool
            forces.append(found.forces[0])
        points.append(state.points)
    coarse, fine = np.array(forces[:4]), np.array(forces[4:])
    assert np.abs(coarse - fine).max() > 0.0
    assert np.linalg.norm(coarse - fine, axis=1).max() < 0.03 * np.linalg.norm(fine, axis=1).max()
    assert np.abs(points[0] - points[1]).max() < 0.02 * 8e-4 + 1e-5


def test_cells_that_did_not_bend_are_not_computed_again_and_would_be_the_same():
    sheet = model(0.015)
    before = sheet.sphere(np.array([-6e-3, 0.0, REACH]), RADIUS)
    pressed = sheet.sphere(np.array([-6e-3, 0.0, REACH - 5e-4]), RADIUS)
    box = sheet.near(None, pressed.center[None])
    state = sheet.equilibrium(sheet.flat(), (before,), (pressed,), box).state
    assemble = sheet.assemble
    known = assemble.linear(assemble.interface(box), state, replace(state, far_field=None), 0.0)
    state = replace(state, far_field=known, at_interface=np.zeros(known.interface.size))
    interface = assemble.interface(sheet.window(np.array([8e-3, 0.0])))
    kept = assemble.linear(interface, state, state, 2e-5)
    anew = assemble.linear(interface, state, replace(state, far_field=None), 2e-5)
    same = np.all(kept.cells.stiffness == known.cells.stiffness, axis=(1, 2))
    assert 0.1 < same.mean() < 0.9
    # Of cells in equilibrium little follows the interface's unknowns.
    scale = np.abs(anew.stiffness).max()
    np.testing.assert_allclose(kept.stiffness, anew.stiffness, atol=1e-4 * scale)


def test_about_the_same_box_cells_that_lie_partly_in_it_are_kept_too(monkeypatch):
    """About a box one row farther on other elements of them lie outside: they are computed anew."""
    sheet = model(0.012, 40, 0.1)
    before = sheet.sphere(np.array([3e-3, -2e-3, REACH]), RADIUS)
    pressed = sheet.sphere(np.array([3e-3, -2e-3, REACH - 5e-4]), RADIUS)
    box = sheet.near(None, pressed.center[None])
    state = sheet.equilibrium(sheet.flat(), (before,), (pressed,), box).state
    assemble, computed = sheet.assemble, []
    fill_cells = assembly.fill_cells

    def count(shell, surface, blend, outside, places, *rest):
        computed.append(len(places))
        fill_cells(shell, surface, blend, outside, places, *rest)

    monkeypatch.setattr(assembly, "fill_cells", count)
    same = assemble.linear(assemble.interface(box), state, state, np.inf)
    assert sum(computed) == 0
    anew = assemble.linear(assemble.interface(box), state, replace(state, far_field=None), np.inf)
    partly = ~anew.whole & np.any(anew.cells.stiffness != 0.0, axis=(1, 2))
    assert np.any(partly)
    scale = np.abs(anew.cells.stiffness).max()
    np.testing.assert_allclose(same.cells.stiffness, anew.cells.stiffness, atol=2e-3 * scale)
    computed.clear()
    farther = assemble.interface(box._replace(first_x=box.first_x + 1, last_x=box.last_x + 1))
    kept = assemble.linear(farther, state, state, np.inf)
    assert sum(computed) > 0
    fresh = assemble.linear(farther, state, replace(state, far_field=None), np.inf)
    np.testing.assert_allclose(kept.cells.stiffness, fresh.cells.stiffness, atol=2e-3 * scale)


def test_a_box_is_the_same_after_its_far_field_is_made_linear():
    """So that its elements need not be computed again."""
    sheet = model(0.012, 40, 0.1)
    before = sheet.sphere(np.array([0.0, 0.0, REACH]), RADIUS)
    pressed = sheet.sphere(np.array([0.0, 0.0, REACH - 5e-4]), RADIUS)
    box = sheet.near(None, pressed.center[None])
    state = sheet.equilibrium(sheet.flat(), (before,), (pressed,), box).state
    assemble = sheet.assemble
    interface = assemble.interface(box)
    after = deepcopy(state)
    after.at_interface[:] += 1e-6 * np.random.default_rng(3).normal(size=interface.size)
    after.far_field.carry(after.at_interface, after.points)
    seen = assemble.inside(box, state, (pressed,), after)
    residual, tangent = seen.residual.copy(), seen.tangent.lower.copy()
    points = after.points.copy()
    far_field = assemble.linear(interface, state, after, 0.0)
    far_field.carry(np.zeros(interface.size), after.points)
    assert np.abs(after.points - points).max() > 0.0
    again = assemble.inside(box, state, (pressed,), after)
    for now, then in ((again.residual, residual), (again.tangent.lower, tangent)):
        np.testing.assert_allclose(now, then, rtol=0.0, atol=1e-12 * np.abs(then).max())


def test_the_edge_moves_as_the_rest_of_the_far_field_does():
    """What the elements of a box see of the points outside of it is carried alone in the same way."""
    sheet = model(0.012, 40, 0.1)
    pressed = sheet.sphere(np.array([0.0, 4e-3, REACH - 5e-4]), RADIUS)
    box = sheet.near(None, pressed.center[None])
    state = sheet.flat()
    interface = sheet.assemble.interface(box)
    far_field = sheet.assemble.linear(interface, state, state, 0.0)
    at_interface = 1e-4 * np.random.default_rng(4).normal(size=interface.size)
    points, edge = state.points.copy(), state.points.copy()
    far_field.carry(at_interface, points)
    far_field.carry_edge(at_interface, edge)
    seen = box.grown(2, state.points.shape)
    np.testing.assert_allclose(
        edge[seen.first_x : seen.last_x, seen.first_y : seen.last_y],
        points[seen.first_x : seen.last_x, seen.first_y : seen.last_y],
        atol=1e-16,
    )
    assert np.abs(edge - state.points).max() > 1e-6
