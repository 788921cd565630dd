"""Speeds that change along a way: never above a piece's feed, smooth, and hardly slower than that."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupling.toolpaths.travel import Travel

# Length [m], feed [m/s], whether the tool rests behind it, and for how long [s].
PIECE = st.tuples(
    st.floats(1e-5, 0.02), st.floats(1e-3, 0.5), st.booleans(), st.sampled_from([0.0, 0.0, 0.3])
)
ways = settings(max_examples=60, derandomize=True, deadline=None)


def seen(travel: Travel, rows: int = 20_001):
    """Times, ways, and the speeds over each step."""
    time = np.linspace(0.0, travel.rests[-1], rows)
    way = travel.at(time)
    return time, way, np.diff(way) / time[1]


def at_rest(length: float, feed: float, blend: float, time: np.ndarray) -> np.ndarray:
    """The way from rest to rest at one feed, from its ramps 10 u^3 - 15 u^4 + 6 u^5, by quadrature."""
    duration = max(length / feed - blend, 0.0) + 2.0 * blend
    fine = np.linspace(0.0, duration, 400_001)
    near = np.clip(np.minimum(fine, duration - fine) / blend, 0.0, 1.0)
    speed = length / (duration - blend) * near**3 * (10.0 - 15.0 * near + 6.0 * near**2)
    way = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * fine[1]))
    return np.interp(time, fine, way)


@pytest.mark.parametrize("length", [1e-4, 5e-3, 0.01, 0.0101, 0.2])
def test_a_single_feed_is_a_start_a_constant_speed_and_a_stop(length):
    """Its pieces do not matter; what is shorter than a blend at the feed takes two blends."""
    whole = Travel.along(np.array([length]), np.array([0.05]), 0.2)
    parts = Travel.along(np.full(7, length / 7), np.full(7, 0.05), 0.2)
    assert whole.rests == pytest.approx([max(length / 0.05, 0.2) + 0.2], rel=1e-14)
    time = np.linspace(0.0, whole.rests[-1], 300)
    np.testing.assert_allclose(whole.at(time), at_rest(length, 0.05, 0.2, time), atol=1e-9 * length)
    np.testing.assert_allclose(parts.at(time), whole.at(time), atol=1e-14 * length)


@ways
@given(st.lists(PIECE, min_size=1, max_size=25), st.floats(0.01, 0.4))
def test_the_speed_is_never_above_the_feed_of_the_piece_it_is_in(pieces, blend):
    length, feed, stops, waits = (np.array(column) for column in zip(*pieces, strict=True))
    travel = Travel.along(length, feed, blend, stops, waits)
    _, way, speed = seen(travel)
    ends = np.cumsum(length)
    first, last = (
        np.searchsorted(ends, way[a:b] - c) for a, b, c in ((0, -1, -1e-12), (1, None, 1e-12))
    )
    within = first == last
    assert np.all(speed >= -1e-12)
    assert np.all(speed[within] <= feed[first[within]] * (1.0 + 1e-7))
    assert way[-1] == pytest.approx(ends[-1], rel=1e-15)
    np.testing.assert_allclose(travel.at(travel.rests), np.sort(travel.at(travel.rests)))
    stops[-1] = True
    rest = np.unique(travel.at(travel.rests).round(13))
    np.testing.assert_allclose(rest, np.unique(ends[stops].round(13)), atol=1e-12)


@ways
@given(st.lists(PIECE, min_size=1, max_size=25), st.floats(0.01, 0.4))
def test_way_speed_and_its_rate_are_continuous(pieces, blend):
    """|v'| <= 1.875 f/b as of a start, |v''| <= 2 * 10/sqrt(3) f/b^2, whatever feeds meet."""
    length, feed, stops, waits = (np.array(column) for column in zip(*pieces, strict=True))
    travel = Travel.along(length, feed, blend, stops, waits)
    rows = min(int(50 * travel.rests[-1] / blend) + 2, 100_000)
    time, _, speed = seen(travel, rows)
    step, largest = time[1], feed.max()
    rate, bend = np.diff(speed) / step, np.diff(speed, 2) / step**2
    assert np.abs(rate).max() <= 1.875 * largest / blend * (1.0 + 1e-6) + 1e-9
    assert np.abs(bend).max() <= 20.0 / np.sqrt(3.0) * largest / blend**2 * (1.0 + 1e-6) + 1e-6


def test_a_slower_feed_is_reached_at_its_border_and_left_there():
    """Each ramp of 0.2 s lies in the faster piece, which costs a part of half a blend."""
    travel = Travel.along(np.array([0.1, 0.02, 0.1]), np.array([0.05, 0.02, 0.05]), 0.2)
    time, way, speed = seen(travel, 54_001)
    slow = (way[1:] > 0.1 + 1e-6) & (way[:-1] < 0.12 - 1e-6)
    np.testing.assert_allclose(speed[slow], 0.02, rtol=1e-6)
    ramp = (speed < 0.05 - 1e-9) & (time[1:] > 0.2) & (time[1:] < travel.rests[-1] - 0.2)
    changes = way[1:][ramp][[0, -1]]
    np.testing.assert_allclose(changes, [0.1 - 0.2 * 0.035, 0.12 + 0.2 * 0.035], atol=5e-5)
    lost = 2 * (
        0.1 - 0.1 * 0.02 / 0.05
    )  # half a blend at 0.02 m/s, which at 0.05 m/s takes 40 % of it
    assert travel.rests[-1] == pytest.approx(5.0 + 0.2 + lost, rel=1e-12)


def test_a_feed_in_every_line_takes_hardly_longer_than_the_feeds_say():
    """20 lines of 1 mm at 1001 to 1020 mm/min, and 2000 whose feed swings by a third."""
    feed = np.arange(1001, 1021) / 60_000
    travel = Travel.along(np.full(20, 1e-3), feed, 0.2)
    assert travel.rests[-1] - 0.2 == pytest.approx((1e-3 / feed).sum(), rel=3e-3)
    feed = 0.03 + 0.01 * np.sin(np.arange(2000) / 50.0)
    travel = Travel.along(np.full(2000, 5e-4), feed, 0.2)
    assert travel.rests[-1] - 0.2 == pytest.approx((5e-4 / feed).sum(), rel=0.06)
    _, _, speed = seen(travel)
    assert speed[1000:-1000].min() > 0.0199


def test_many_pieces_are_planned_in_arrays():
    """A feed on each of 100 000 lines: within it, and to the end."""
    generator = np.random.default_rng(1)
    feed = generator.uniform(0.04, 0.06, 100_000)
    travel = Travel.along(np.full(100_000, 2e-4), feed, 0.2)
    time = np.arange(0.0, travel.rests[-1], 0.004)
    way = travel.at(time)
    speed = np.diff(way) / 0.004
    assert travel.rests[-1] < 20.0 / 0.04 + 0.3
    most = feed[np.clip((way[:-1] / 2e-4).astype(int), 0, 99_999)]
    assert (speed <= most * (1 + 1e-9)).mean() > 0.99  # others cross into a line that is faster
    assert way[-1] == pytest.approx(20.0, abs=1e-3)
