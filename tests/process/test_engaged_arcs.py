"""Arcs of a mill in the cut, from the stock that its path removes, against closed forms."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupling.process.engaged_arcs import Arcs, RemovedStock
from coupling.process.stock import RawStock

R = 8e-3
FEED = 0.05  # [m/s]
SOLID = RawStock(0.0)
Point = tuple[float, float, float]


def path(points: Sequence[Point], step: float = 2e-4) -> tuple[np.ndarray, np.ndarray]:
    """Return times and places of a tip along lines between points [mm]."""
    corners = 1e-3 * np.array(points, dtype=float)
    pieces = [corners[:1]]
    for a, b in pairwise(corners):
        count = max(int(np.linalg.norm(b - a) / step), 1)
        pieces.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    tips = np.vstack(pieces)
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(tips, axis=0), axis=1)))
    return way / FEED, tips


def removed(
    points: Sequence[Point], raw: RawStock = SOLID, cell: float | None = None
) -> RemovedStock:
    return RemovedStock(*path(points), raw, R, cell)


def last(stock: RemovedStock, before_end: float = 1e-3) -> Arcs:
    """Return the arcs a way before the path's end [m]."""
    return stock.at(np.array([stock.time[-1] - before_end / FEED]))


def degrees(arcs: Arcs) -> list[tuple[float, float, float]]:
    """Return start, end [deg] and depth [mm] of the arcs at one time."""
    return [
        (float(np.rad2deg(start)), float(np.rad2deg(end)), 1e3 * float(depth))
        for start, end, depth in zip(arcs.start[0], arcs.end[0], arcs.depth[0], strict=True)
        if end > start
    ]


def block(low: Sequence[float], high: Sequence[float]) -> RawStock:
    return RawStock(0.0, 1e-3 * np.array(low), 1e-3 * np.array(high))


def test_a_path_through_solid_stock_is_a_slot():
    assert degrees(last(removed([(0, 0, -3), (30, 0, -3)]))) == [
        pytest.approx((0.0, 180.0, 3.0), abs=1e-6)
    ]


@pytest.mark.parametrize("width", [0.5, 4.0, 8.0, 12.0])
def test_half_immersed_up_and_down_arcs_follow_from_the_width(width):
    """arccos(1 - a/R) from the side of the material, which is left of the feed in up milling."""
    arc = np.rad2deg(np.arccos(1.0 - 1e-3 * width / R))
    left = block((-100, 8.0 - width), (100, 100))
    right = block((-100, -100), (100, width - 8.0))
    ((*up, _),) = degrees(last(removed([(0, 0, -3), (30, 0, -3)], left)))
    ((*down, _),) = degrees(last(removed([(0, 0, -3), (30, 0, -3)], right)))
    assert up == pytest.approx([0.0, arc], abs=0.2)
    assert down == pytest.approx([180.0 - arc, 180.0], abs=0.2)


def test_a_finishing_pass_meets_what_the_pass_before_has_left():
    """6 mm deep beside two slots of 3 mm each: as deep as both, as wide as its side step."""
    points = [(0, 0, -3), (40, 0, -3), (40, 0, 5), (0, 0, 5), (0, 0, -6), (40, 0, -6)]
    points += [(40, 0.5, -6), (0, 0.5, -6)]
    arc = np.rad2deg(np.arccos(1.0 - 0.5 / 8.0))
    # Back along -x, the wall is on the right.
    ((start, end, depth),) = degrees(last(removed(points), 0.02))
    assert (start, end, depth) == pytest.approx((180.0 - arc, 180.0, 6.0), abs=0.2)


def test_the_second_level_of_a_slot_is_as_deep_as_its_step():
    points = [(0, 0, -3), (40, 0, -3), (40, 0, 5), (0, 0, 5), (0, 0, -5), (40, 0, -5)]
    assert degrees(last(removed(points), 0.02)) == [pytest.approx((0.0, 180.0, 2.0), abs=1e-6)]


def test_an_inner_corner_takes_the_arc_of_its_radii():
    """At the middle's radius r in a wall of radius w: cos(angle) = (w^2 - r^2 - R^2) / (2 r R)."""
    turn = np.linspace(-90.0, 0.0, 91)
    rough, fine = 10.0, 10.5

    def corner(radius: float, z: float) -> list[Point]:
        around = [
            (radius * float(np.cos(a)), radius * float(np.sin(a)), z) for a in np.deg2rad(turn)
        ]
        return [(-30.0, -radius, z), *around, (radius, 30.0, z)]

    points = [*corner(rough, -3.0), (rough, 30, 5), (-30, -fine, 5), *corner(fine, -3.0)]
    wall = rough + 8.0
    arc = np.rad2deg(np.arccos((wall**2 - fine**2 - 64.0) / (2.0 * fine * 8.0)))
    stock = removed(points)
    middle = np.argmin(
        np.linalg.norm(stock.tips - 1e-3 * fine * np.array([0.5**0.5, -(0.5**0.5), 0]), axis=1)
        + (stock.time < 0.5 * stock.time[-1])
    )
    ((start, end, depth),) = degrees(stock.at(stock.time[middle : middle + 1]))
    assert (start, end, depth) == pytest.approx((180.0 - arc, 180.0, 3.0), abs=0.4)
    assert arc > 1.25 * np.rad2deg(np.arccos(1.0 - 0.5 / 8.0))  # wider than along a straight wall


@pytest.mark.parametrize("ahead", [7.0, 4.0, 1.0])
def test_entry_into_a_block_begins_in_the_middle(ahead):
    """Its face is met between asin(d/R) and 180 deg less that."""
    stock = removed([(-20, 0, -2), (20, 0, -2)], block((0, -50), (100, 50)))
    time = np.array([(20.0 - ahead) * 1e-3 / FEED])
    first = np.rad2deg(np.arcsin(ahead / 8.0))
    ((start, end, _),) = degrees(stock.at(time))
    assert (start, end) == pytest.approx((first, 180.0 - first), abs=0.8)


def test_a_step_in_the_stock_makes_two_arcs_of_two_depths():
    points = [(0, 0, -2), (40, 0, -2), (40, 0, 5), (0, 8, 5), (0, 8, -4), (40, 8, -4)]
    arcs = degrees(last(removed(points), 0.02))
    assert [depth for *_, depth in arcs] == pytest.approx([4.0, 2.0], abs=1e-6)
    assert arcs[0][1] == pytest.approx(90.0, abs=0.3) == arcs[1][0]


def test_a_ramp_is_as_deep_as_its_tip():
    stock = removed([(0, 0, 0), (40, 0, -4)])
    for share in (0.3, 0.61, 0.9):
        time = share * stock.time[-1:]
        depth = -np.interp(time, stock.time, stock.tips[:, 2])
        assert stock.at(time).depth.max() == pytest.approx(float(depth[0]), rel=1e-6)


def section_of_discs(tips: np.ndarray, row: int, feed: np.ndarray) -> float:
    """Return the section in front of a tip in stock from which discs at all places before are taken."""
    phi = (np.arange(90) + 0.5) * np.pi / 90
    outward = np.outer(np.sin(phi), feed) + np.outer(np.cos(phi), [-feed[1], feed[0]])
    points = tips[row, :2] + R * (1.0 + 1e-6) * outward
    away = np.linalg.norm(points[:, None] - tips[None, :row, :2], axis=2)
    floor = np.where(away < R, tips[:row, 2], 0.0).min(axis=1)
    return float(R * np.sum(np.sin(phi) * np.maximum(floor - tips[row, 2], 0.0)) * np.pi / 90)


@pytest.mark.parametrize("depth", [0.6e-3, 3e-3])
@pytest.mark.parametrize("kind", ["helix", "ramps"])
def test_a_helical_or_a_zigzag_entry_is_as_deep_as_the_pass_before_has_left_it(kind, depth):
    """Three passes down, whatever the layers of the stock: at each place within 8 % of the largest."""
    share = np.linspace(0.0, 4.0, 1601)
    height = -depth * np.minimum(share / 3.0, 1.0)
    if kind == "helix":
        plane = 5e-3 * np.column_stack([np.cos(2 * np.pi * share), np.sin(2 * np.pi * share)])
    else:
        plane = np.column_stack([24e-3 * np.abs((share + 1.0) % 2.0 - 1.0), 0.0 * share])
    tips = np.column_stack([plane, height])
    stock = RemovedStock(share, tips, SOLID, R)
    rows = np.arange(31, 1600, 37)
    ways = plane[rows + 1] - plane[rows - 1]
    exact = [
        section_of_discs(tips, row, way / np.linalg.norm(way))
        for row, way in zip(rows.tolist(), ways, strict=True)
    ]
    sections = stock.at(share[rows]).section(R)
    np.testing.assert_allclose(sections / max(exact), np.array(exact) / max(exact), atol=0.08)
    assert np.mean(sections) == pytest.approx(np.mean(exact), rel=0.02)


def test_a_path_over_what_is_removed_already_cuts_nothing():
    points = [(0, 0, -3), (40, 0, -3), (40, 0, 5), (0, 0, 5), (0, 0, -3), (40, 0, -3)]
    stock = removed(points)
    way_back = stock.time > stock.time[-1] - 0.038 / FEED
    assert not stock.at(stock.time[way_back]).is_cut.any()
    assert not removed([(0, 0, 1), (40, 0, 1)]).at(np.array([0.1])).is_cut.any()


def test_arcs_converge_with_the_width_of_the_raster():
    left, exact = block((-100, 4.0), (100, 100)), np.arccos(0.5)
    errors = [
        abs(float(last(removed([(0, 0, -3), (30, 0, -3)], left, R / n)).end[0, 0]) - exact)
        for n in (8, 16, 32, 64)
    ]
    assert errors[0] > 2.0 * errors[1] > 3.0 * errors[2]
    assert errors[3] < 2e-3


places = st.tuples(st.floats(0.0, 40.0), st.floats(0.0, 40.0))


@settings(max_examples=15, deadline=None)
@given(st.lists(places, min_size=2, max_size=5), st.floats(0.5, 6.0))
def test_the_volume_removed_is_the_removal_rate_over_time(corners, depth):
    """Whatever the path, as long as it enters from the side."""
    points = [(-20.0, 20.0, -depth), *((x, y, -depth) for x, y in corners)]
    removal = removed(points, block((0, -50), (60, 90))).removal
    section = removal.arcs.section(R)
    rate = float(np.sum(section * removal.length))
    assert rate == pytest.approx(removal.volume, rel=0.02, abs=0.01 * depth * 1e-3 * R**2)
