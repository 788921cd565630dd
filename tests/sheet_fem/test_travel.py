"""A sheet's last move, carried along with its tools: where the next equilibrium is looked for."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("numba")

from coupling.sheet_fem import forming
from coupling.sheet_fem.box import Box
from coupling.sheet_fem.contact import Sphere
from coupling.sheet_fem.equilibrium import find_equilibrium
from coupling.sheet_fem.forming import SheetModel, SheetSettings
from coupling.sheet_fem.interface import Interface
from coupling.sheet_fem.material import Material
from coupling.sheet_fem.mesh import SheetMesh
from coupling.sheet_fem.travel import Increment

ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
THICKNESS, RADIUS = 1e-3, 5e-3
REACH = RADIUS + 0.5 * THICKNESS
SIDE = 0.06


def dent(place: np.ndarray) -> np.ndarray:
    """Moves of a sheet about a tool at the origin that has gone along x [m]; (..., 2) -> (..., 3)."""
    x, y = place[..., 0] / 0.012, place[..., 1] / 0.012
    bell = 1e-4 * np.exp(-(x**2) - y**2)
    return bell[..., None] * np.stack([1.0 + x, y - 0.5 * x, -2.0 + 3.0 * x - y], axis=-1)


def grid(elements: int) -> SheetMesh:
    return SheetMesh((SIDE, SIDE), (elements, elements), THICKNESS)


def spheres(centers: np.ndarray) -> tuple[Sphere, ...]:
    """Return tools at places [m], (tools, 3)."""
    return tuple(Sphere(center, RADIUS, 1e13, 3e-6, 0.0, 1e-5, np.zeros(3)) for center in centers)


def everywhere(elements: int) -> Box:
    return Box(0, elements + 2, 0, elements + 2)


def error(elements: int, first: float, angle: float, scale: float) -> float:
    """Largest error of what is carried along with a tool that turns and goes farther [m]."""
    mesh = grid(elements)
    way = 2e-3 * np.array([np.cos(first), np.sin(first), 0.0])
    end = np.array([1e-3, -2e-3, 4e-3])
    begin, turned = end - way, Rotation.from_euler("z", first)
    flat = mesh.control_points()[..., :2]
    into = turned.as_matrix()[:2, :2]
    moved = dent((flat - end[:2]) @ into) @ turned.as_matrix().T
    after = Rotation.from_euler("z", first + angle)
    goes = end + scale * 2e-3 * after.as_matrix()[:, 0]
    found = Increment(begin[None], end[None], moved).predict_moves(
        mesh, spheres(goes[None]), everywhere(elements)
    )
    into = after.as_matrix()[:2, :2]
    expected = scale * dent((flat - goes[:2]) @ into) @ after.as_matrix().T
    inner = np.abs(flat).max(axis=-1) < 0.02  # what comes from outside of the sheet is not known
    return float(np.abs(found - expected)[inner].max())


@pytest.mark.parametrize("first", [0.0, 2.5, -3.0])
@pytest.mark.parametrize(("angle", "scale"), [(0.0, 1.0), (0.3, 1.4), (-0.45, 0.6)])
def test_a_move_goes_along_turns_and_grows_with_the_tool_s_way(first, angle, scale):
    """A dent given in the tool's axes is found in them again, but for linear interpolation."""
    h = 1e-5
    x, y = np.meshgrid(*2 * [np.linspace(-0.03, 0.03, 121)], indexing="ij")
    place, steps = np.stack([x, y], axis=-1), h * np.eye(2)
    bent = [(dent(place + s) - 2.0 * dent(place) + dent(place - s)) / h**2 for s in steps]
    # In turned axes second derivatives and components mix: by the norms.
    largest = np.linalg.norm(np.stack(bent), axis=(0, -1)).max() * 2.0
    for elements in (40, 80):
        size = SIDE / elements
        assert 0.0 < error(elements, first, angle, scale) < scale * size**2 / 8.0 * largest
    assert scale * size**2 / 8.0 * largest < 0.01 * np.abs(dent(place)).max()


def test_only_the_box_moves():
    mesh, box = grid(20), Box(5, 12, 4, 15)
    tool, way = np.array([[0.0, 0.0, 4e-3]]), np.array([[1e-3, 0.0, 0.0]])
    travel = Increment(tool - way, tool, np.ones((22, 22, 3)))
    found = travel.predict_moves(mesh, spheres(tool + way), box)
    expected = np.zeros((22, 22, 3))
    expected[5:12, 4:15] = 1.0
    np.testing.assert_allclose(found, expected, atol=1e-12)


WAY = np.array([[2e-3, 0.0, 0.0], [2e-3, 0.0, 0.0]])


@pytest.mark.parametrize(
    "goes",
    [
        WAY[:1],
        2.1 * WAY,
        0.45 * WAY,
        0.0 * WAY,
        WAY @ Rotation.from_euler("z", 0.6).as_matrix().T,
        np.array([[0.0, 0.0, -2e-3], [0.0, 0.0, -2e-3]]),
        np.array([[2e-3, 0.0, 0.0], [2e-3, 0.0, -6e-4]]),
        np.array([[2e-3, 0.0, 0.0], [1.4e-3, 0.0, 0.0]]),
    ],
    ids=["a tool less", "longer", "shorter", "rest", "corner", "plunge", "one sinks", "one lags"],
)
def test_tools_that_do_not_go_on_as_they_came_tell_nothing(goes):
    mesh, end = grid(10), np.array([[0.0, 0.0, 4e-3], [0.0, 1e-3, -4e-3]])
    travel = Increment(end - WAY, end, np.ones((12, 12, 3)))
    assert travel.predict_moves(mesh, spheres(end + WAY), everywhere(10)) is not None
    assert travel.predict_moves(mesh, spheres(end[: len(goes)] + goes), everywhere(10)) is None


def test_a_plunge_goes_on_without_turning():
    """Microns along the sheet are no direction there."""
    mesh, end = grid(10), np.array([[0.0, 0.0, 4e-3]])
    came, goes = np.array([[2e-6, 0.0, -1e-4]]), np.array([[-1e-6, 2e-6, -1e-4]])
    moved = np.random.default_rng(2).normal(size=(12, 12, 3))
    found = Increment(end - came, end, moved).predict_moves(
        mesh, spheres(end + goes), everywhere(10)
    )
    np.testing.assert_allclose(found[1:-1, 1:-1], moved[1:-1, 1:-1], atol=0.02)


def test_an_interface_is_found_again_from_the_moves_of_its_edge():
    sheet = SheetModel(grid(24), ALUMINIUM, SheetSettings(window=0.012))
    interface = sheet.assemble.interface(sheet.window(np.zeros(2)))
    assert isinstance(interface, Interface)
    moves = interface.at_edge(np.random.default_rng(4).normal(size=interface.size))
    np.testing.assert_allclose(interface.at_edge(interface.fitted(moves)), moves, atol=1e-2)


def travelled(sheet: SheetModel, keep):
    """Press and travel in a curve; `keep` gives the state from which each position begins."""
    places = [(-6e-3, 0.0, d) for d in (0.0, 3e-4)]
    places += [(-6e-3 + s, 0.5 * s**2 / 0.03, 3e-4) for s in np.arange(1, 6) * 2.5e-3]
    tools = [sheet.sphere(np.array([x, y, REACH - depth]), RADIUS) for x, y, depth in places]
    state, box, iterations, forces = sheet.flat(), None, [], []
    for before, after in pairwise(tools):
        box = sheet.near(box, after.center[None])
        found = sheet.equilibrium(keep(state), (before,), (after,), box)
        state = found.state
        iterations.append(found.iterations)
        forces.append(found.forces[0])
    return np.array(forces), sum(iterations[-3:]), state


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_from_where_it_is_expected_a_sheet_comes_to_the_same_equilibrium_in_fewer_iterations(
    friction,
):
    settings = SheetSettings(window=0.012, friction=friction)
    sheet = SheetModel(grid(24), ALUMINIUM, settings)
    with_it, fewer, shape = travelled(sheet, lambda state: state)
    without, more, other = travelled(sheet, lambda state: replace(state, travel=None))
    # Coarse elements outside of the window are linear about states that differ a little.
    np.testing.assert_allclose(with_it, without, atol=5e-3 * np.abs(without).max())
    assert np.abs(shape.points - other.points).max() < 2e-6
    assert fewer < 0.85 * more


def test_a_guess_that_leads_away_is_left(monkeypatch):
    """The sheet is expected far below the tool, which would have nothing to press on."""
    sheet = SheetModel(grid(24), ALUMINIUM, SheetSettings(window=0.012))
    tried = []

    def find(assemble, state, spheres, box, settings, guess):
        found = find_equilibrium(assemble, state, spheres, box, settings, guess)
        tried.append((guess is not None, found is not None))
        return found

    def misled(state):
        if state.travel is None:
            return state
        wrong = state.travel.displacements - [0.0, 0.0, 1e-3]
        return replace(state, travel=state.travel._replace(displacements=wrong))

    monkeypatch.setattr(forming, "find_equilibrium", find)
    found, _, shape = travelled(sheet, misled)
    assert (True, False) in tried
    assert (False, False) not in tried, "without the guess no step needs to be cut"
    without, _, other = travelled(sheet, lambda state: replace(state, travel=None))
    np.testing.assert_allclose(found, without, atol=5e-3 * np.abs(without).max())
    assert np.abs(shape.points - other.points).max() < 2e-6
