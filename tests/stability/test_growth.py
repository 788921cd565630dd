"""Growth against other methods: closed forms, semi-discretisation, marching in time."""

from dataclasses import replace

import numpy as np
import pytest
from semi_discretisation import real_states, semi_discretised_growth

from coupling.errors import StabilityError
from coupling.process.cutting_force import Cutter, CuttingCoefficients
from coupling.stability.floquet import PeriodOperator, growth_of, vibration_of
from coupling.stability.limit import first_border
from coupling.stability.marching import march
from coupling.stability.steady_cut import ProcessDamping, SteadyCut
from coupling.stability.structure import Structure, ToolMode
from coupling.stability.zero_order import ZeroOrder

ALUMINIUM = CuttingCoefficients(6.0e8, 2.0e8, 0.0, 2.0e4, 1.0e4, 0.0)
# Two robot-like modes along directions that the cut couples, and a third that is overdamped.
SOFT = [
    (14.0, 0.03, 1.2e6, (1.0, 0.2)),
    (22.0, 0.05, 9.0e5, (-0.3, 1.0)),
    (60.0, 1.6, 2.0e6, (0.5, 0.5)),
]


def structure() -> Structure:
    """Return modes given by frequency [Hz], damping ratio, stiffness [N/m] and direction."""
    parts = []
    for frequency, ratio, stiffness, direction in SOFT:
        omega = 2.0 * np.pi * frequency
        a = np.array([[0.0, 1.0], [-(omega**2), -2.0 * ratio * omega]])
        way = np.array(direction) / np.linalg.norm(direction)
        b, c = np.zeros((2, 6)), np.zeros((2, 2))
        b[1, :2], c[:, 0] = omega**2 / stiffness * way, way
        parts.append(Structure._of_states(a, b, c))
    return Structure.in_series(*parts)


def milling(
    rpm: float, depth: float, arc: str = "slot", teeth: int = 2, helix: float = 0.0
) -> SteadyCut:
    start, end = {"slot": (0.0, np.pi), "up": (0.0, 0.9), "down": (2.2, np.pi)}[arc]
    cutter = Cutter(radius=8e-3, teeth=teeth, helix=helix, speed=rpm * np.pi / 30.0)
    return SteadyCut(cutter, ALUMINIUM, start, end, depth)


@pytest.mark.parametrize(
    "cut",
    [
        milling(900.0, 2e-3),
        milling(3000.0, 4e-3, "up"),
        milling(1500.0, 3e-3, "down", helix=0.5),
        milling(6000.0, 6e-3, helix=0.5),
        replace(
            milling(1200.0, 3e-3, "up", teeth=3, helix=0.5),
            pitch=tuple(np.deg2rad([90.0, 120.0, 150.0])),
        ),
    ],
    ids=["slow slot", "up", "helical down", "helical slot", "variable pitch"],
)
def test_semi_discretisation_converges_to_the_same_growth(cut):
    exact = growth_of(structure(), cut)
    steps = 32
    coarse, fine = (
        abs(semi_discretised_growth(structure(), cut, n) - exact) for n in (steps, 3 * steps)
    )
    scale = abs(exact) + 0.1
    assert fine < 0.02 * scale
    # Of first order at least, which is what a step in which an edge leaves the cut has.
    assert fine < 0.4 * coarse or coarse < 1e-4 * scale


def test_more_points_do_not_change_the_growth():
    for cut in (
        milling(900.0, 2e-3, helix=0.5),
        milling(3000.0, 4e-3, "down"),
        milling(400.0, 1e-3),
    ):
        growth = [
            (operator := PeriodOperator.of(structure(), cut, refined)).growth(operator.multipliers)
            for refined in (1.0, 2.0)
        ]
        assert growth[0] == pytest.approx(growth[1], rel=1e-3, abs=1e-5)


def test_the_largest_multipliers_of_a_large_operator_are_the_largest_of_all():
    for cut in (milling(20.0, 1e-3), milling(8.0, 3e-3, "up", helix=0.5)):
        operator = PeriodOperator.of(structure(), cut)
        every = np.abs(np.linalg.eigvals(operator.matrix))
        assert len(operator.multipliers) < 10 < len(every)
        assert np.abs(operator.multipliers).max() == pytest.approx(every.max(), rel=1e-9)


def test_four_straight_teeth_in_a_slot_are_a_constant_so_that_zero_order_is_exact():
    quick = ZeroOrder.of(structure(), milling(1000.0, 1e-3, teeth=4))
    for rpm in (300.0, 700.0, 1500.0, 4000.0):
        cut = milling(rpm, 1e-3, teeth=4)
        exact = first_border(structure(), cut, 0.2, quick)
        assert quick.limit(cut.cutter.tooth_period) == pytest.approx(exact, rel=3e-3)


def test_the_least_depth_of_one_mode_is_that_of_altintas_and_budak():
    """2 k zeta (1 + zeta) over the mean gain by depth along the mode, N K_r / 4 in a slot."""
    k, zeta = 1.3e6, 0.02
    tool = Structure.of_modes([ToolMode(900.0, zeta, k)])
    along_feed = replace(tool, driving=tool.driving * [1, 0, 0, 0, 0, 0])
    quick = ZeroOrder.of(along_feed, milling(5000.0, 1e-3, teeth=4))
    expected = 2.0 * k * zeta * (1.0 + zeta) / (4.0 * 2.0e8 / 4.0)
    assert quick.least(milling(5000.0, 1e-3, teeth=4), 600.0, 1200.0) == pytest.approx(
        expected, rel=4e-3
    )


def test_even_pitch_is_no_pitch():
    cut = milling(1100.0, 3e-3, "up", helix=0.5)
    stated = replace(cut, pitch=(np.pi, np.pi))
    assert growth_of(structure(), stated) == pytest.approx(growth_of(structure(), cut), rel=1e-4)


def test_damping_by_the_flank_is_damping_of_the_structure_where_it_is_constant():
    flank = ProcessDamping(indentation=1.5e14, wear_land=8e-5)
    cut = milling(600.0, 3e-3, teeth=4)
    a, b, c = real_states(structure())
    damped = replace(cut, damping=flank)
    gain = damped.gain(damped.channels[-1], np.array([1e-4]))[0]
    # u' = C A x, as a force moves no tip at once.
    slowed = Structure._of_states(a + b @ gain @ c @ a, b, c)
    expected = growth_of(slowed, cut)
    assert growth_of(structure(), damped) == pytest.approx(expected, rel=1e-4)
    assert expected < growth_of(structure(), cut)


def test_a_tool_in_series_adds_its_compliance():
    tool = Structure.of_modes([ToolMode(1200.0, 0.03, 2.0e7)])
    both = Structure.in_series(structure(), tool)
    s, push = 2j * np.pi * np.array([20.0, 1150.0]), np.eye(6)[:, :2]
    expected = structure().answer(s, push) + tool.answer(s, push)
    np.testing.assert_allclose(both.answer(s, push), expected)
    omega = 2.0 * np.pi * 1200.0
    direct = omega**2 / 2.0e7 / (s[1] ** 2 + 0.06 * omega * s[1] + omega**2)
    np.testing.assert_allclose(
        tool.answer(s, push)[1], direct * np.eye(2), atol=1e-12 * abs(direct)
    )


@pytest.mark.parametrize("arc", ["slot", "up", "down"])
@pytest.mark.parametrize("share", [0.85, 1.15])
def test_marching_in_time_judges_as_the_multipliers_15_percent_off_the_border(arc, share):
    cut = milling(1400.0, 1e-3, arc, helix=0.5)
    limit = first_border(structure(), cut, 0.1)
    marched = march(structure(), cut.at_depth(share * limit), 1e-4, 1.4)
    assert marched.is_stable == (share < 1.0)


def test_a_large_vibration_leaves_the_cut_and_no_longer_grows():
    cut = milling(1400.0, 1e-3)
    deep = cut.at_depth(3.0 * first_border(structure(), cut, 0.1))
    marched = march(structure(), deep, 1e-4, 2.5)
    assert not marched.is_stable
    assert marched.out_of_cut[-20:].mean() > 0.05
    later, earlier = marched.change[-30:], marched.change[-60:-30]
    assert later.max() < 1.5 * earlier.max()


def test_the_limit_is_the_first_border_from_below():
    """Low immersion: the cut is unstable between two depths and stable again beyond."""
    tip = Structure.of_modes([ToolMode(922.0, 0.011, 1.34e6)])
    along = replace(tip, driving=tip.driving * [1, 0, 0, 0, 0, 0])
    cutter = Cutter(radius=4e-3, teeth=2, helix=0.8, speed=18000.0 * np.pi / 30.0)
    cut = SteadyCut(cutter, ALUMINIUM, np.pi - np.arccos(0.9), np.pi, 1e-3)
    limit = first_border(along, cut, 0.015)
    assert growth_of(along, cut.at_depth(0.98 * limit)) < 0.0 < growth_of(along, cut.at_depth(2e-3))
    assert growth_of(along, cut.at_depth(3e-3)) < 0.0 < growth_of(along, cut.at_depth(6e-3))
    assert 1.2e-3 < limit < 2e-3


def test_what_moves_freely_is_no_chatter():
    """A gear inside its backlash stays where it is: a multiplier of one, growth of nothing."""
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    a[2:, :2] = np.diag([-(80.0**2), 0.0])
    a[2:, 2:] = np.diag([-8.0, -3.0])
    b, c = np.zeros((4, 6)), np.zeros((2, 4))
    b[2, 0], b[3, 1], c[0, 0], c[1, 1] = 1e-2, 1e-2, 1.0, 1.0
    free = Structure._of_states(a, b, c)
    cut = milling(9000.0, 1e-5)
    assert abs(growth_of(free, cut)) < 1e-6
    assert vibration_of(free, cut).is_stable


def test_a_cut_too_slow_for_its_fastest_mode_is_refused_with_the_speed():
    whistling = Structure.of_modes([ToolMode(2.0e5, 0.01, 1e7)])
    with pytest.raises(StabilityError, match="raise the speed"):
        growth_of(whistling, milling(60.0, 1e-3))
