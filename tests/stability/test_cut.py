"""The gain of a cut: the derivative of its force, its mean, its corners, the damping of its flanks."""

import numpy as np
import pytest
from steady_feed import steady_wrench

from coupling.process.cutting_force import Cutter, CuttingCoefficients, Engagement
from coupling.stability.steady_cut import ProcessDamping, SteadyCut

STEEL = CuttingCoefficients(1.9e9, 0.8e9, 0.35e9, 3.0e4, 4.5e4, 2.0e3)
ARCS = {"slot": (0.0, np.pi), "up": (0.0, 1.0), "down": (2.4, np.pi)}


def cut_of(arc: str, helix: float, teeth: int = 3, **more: object) -> SteadyCut:
    cutter = Cutter(radius=8e-3, teeth=teeth, helix=helix, speed=500.0)
    return SteadyCut(cutter, STEEL, *ARCS[arc], 4e-3, **more)


@pytest.mark.parametrize("helix", [0.0, 0.5, 1.2])
@pytest.mark.parametrize("arc", ARCS)
def test_the_gain_is_the_derivative_of_the_teeths_force_by_the_chip(arc, helix):
    cut = cut_of(arc, helix)
    (channel,) = cut.channels
    time = np.random.default_rng(1).uniform(0.0, cut.period, 40)
    gain = cut.gain(channel, time)

    def force(chip: np.ndarray) -> np.ndarray:
        ones = np.ones(len(time))
        engaged = Engagement(
            np.tile(chip, (len(time), 1)), *(v * ones for v in ARCS[arc]), 4e-3 * ones
        )
        return steady_wrench(cut.cutter, STEEL, engaged, time)

    feed, size = np.array([1.0, 0.0]), 1e-3
    # Chips that stay above zero in the whole arc: the force is then linear in them.
    middle = np.array([np.sin(np.mean(ARCS[arc])), np.cos(np.mean(ARCS[arc]))])
    base = middle if arc != "slot" else feed
    along = (force(base * (1.0 + size)) - force(base)) / size
    np.testing.assert_allclose(gain @ base, along, rtol=1e-6, atol=1e-3)


@pytest.mark.parametrize("helix", [0.0, 0.5])
@pytest.mark.parametrize("arc", ARCS)
def test_the_mean_gain_is_the_mean_over_a_turn(arc, helix):
    cut = cut_of(arc, helix)
    (channel,) = cut.channels
    nodes, weights = np.polynomial.legendre.leggauss(20)
    total = np.zeros((6, 2))
    for begin, end in channel.pieces:
        time = begin + 0.5 * (1.0 + nodes) * (end - begin)
        share = 0.5 * weights * (end - begin) / cut.period
        total += np.einsum("t,tij->ij", share, cut.gain(channel, time))
    # Forces and the moment about the axis; the other moments depend on where along the edge it cuts.
    np.testing.assert_allclose(
        cut.mean_gain[[0, 1, 2, 5]], total[[0, 1, 2, 5]], rtol=1e-10, atol=1e-4
    )


def test_pieces_are_where_teeth_are_in_the_cut():
    (channel,) = cut_of("down", 0.0, teeth=2).channels
    pieces = 500.0 * channel.pieces
    np.testing.assert_allclose(pieces, [[2.4, np.pi]], atol=1e-9)
    assert cut_of("up", 0.5).at_depth(0.0).channels == ()


def test_a_flank_damps_by_the_volume_that_it_indents():
    flank = ProcessDamping(indentation=1.5e14, wear_land=1e-4, friction=0.3)
    cut = cut_of("slot", 0.0, teeth=4, damping=flank)
    channel = cut.channels[-1]
    assert channel.delay is None
    gain = cut.gain(channel, np.array([1e-4]))[0, :2] / cut.depth
    radial = 0.5 * 1.5e14 * 1e-8 / (8e-3 * 500.0)
    # Four straight teeth in a slot: two a quarter turn apart, so the same at all times.
    np.testing.assert_allclose(gain, radial * np.array([[-1.0, -0.3], [0.3, -1.0]]), rtol=1e-12)
