"""Milling forces against closed forms, symmetries, the power balance and the resolution in time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from steady_feed import ALUMINIUM, RADIUS

from coupling.errors import CaseError
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.process import MillingForceTable
from coupling.process.cut_course import CutCourse
from coupling.toolpaths import GcodePath, Task
from coupling.toolpaths.apt import AptPath
from coupling.toolpaths.part import tool_path

PART = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("xyz", [0.3, -0.2, 0.5]))
HEADING = np.array([0.6, 0.8])  # of the feed in the part's x-y plane
LEFT = np.array([-0.8, 0.6])
FEED = 0.1


def task(period: float = 1e-4, duration: float = 0.06) -> Task:
    time = np.arange(round(duration / period) + 1) * period
    points = np.column_stack([np.outer(FEED * time, HEADING), np.full(len(time), -3e-3)])
    return Task(PART, tool_path(PART, time, points))


KEYS = {
    "model": "milling-force",
    "cutter_diameter_m": 2 * RADIUS,
    "teeth": 2,
    "helix_deg": 30.0,
    "spindle_speed_rpm": 20000.0,
    "engagement": "slot",
    **{f"{name}_Pa": getattr(ALUMINIUM, name) for name in ("K_tc", "K_rc", "K_ac")},
    **{f"{name}_N_m": getattr(ALUMINIUM, name) for name in ("K_te", "K_re", "K_ae")},
}


def milling(of: Task, **keys: object):
    return MillingForceTable.model_validate({**KEYS, **keys}).process(of)


def in_cut(wrench: np.ndarray) -> np.ndarray:
    """Return forces along the feed, to its left and up, from those in base axes."""
    force = PART.rotation.inv().apply(wrench[:, :3])
    return np.column_stack([force[:, :2] @ HEADING, force[:, :2] @ LEFT, force[:, 2]])


def test_steady_feed_gives_the_mean_force_in_the_parts_axes():
    of = task()
    force = in_cut(milling(of, force="mean").evaluate(of.desired).wrench.wrench[0])
    c, a, N, K = FEED * 60.0 / 20000.0 / 2.0, 3e-3, 2, ALUMINIUM
    expected = [
        -N * a * (K.K_rc * c / 4 + K.K_re / np.pi),
        N * a * (K.K_tc * c / 4 + K.K_te / np.pi),
    ]
    np.testing.assert_allclose(force[20:, :2], np.tile(expected, (len(force) - 20, 1)), rtol=1e-9)


def test_the_tooth_resolved_history_has_the_mean_force_and_the_tooth_frequency():
    of = task()
    mean = in_cut(milling(of, force="mean").evaluate(of.desired).wrench.wrench[0])[-1]
    force = in_cut(milling(of).evaluate(of.desired).wrench.before[0])[31:571]  # 36 teeth of 1.5 ms
    np.testing.assert_allclose(force.mean(axis=0), mean, rtol=2e-3)
    spectrum = np.abs(np.fft.rfft(force[:, 1] - force[:, 1].mean()))
    assert np.argmax(spectrum) / (540 * 1e-4) == pytest.approx(20000.0 / 60.0 * 2.0)


def test_the_history_converges_with_the_time_resolution():
    """Impulses over 0.6 ms from steps of 0.12, 0.06 and 0.03 ms: second order at least."""

    def impulses(parts: int) -> np.ndarray:
        of = task(6e-4 / parts, duration=0.03)
        force = in_cut(milling(of).evaluate(of.desired).wrench.before[0])[1:, :2]
        return force.reshape(-1, parts, 2).mean(axis=1)

    fine = impulses(160)
    error = [np.sqrt(np.mean((impulses(parts) - fine) ** 2)) for parts in (5, 10, 20)]
    assert error[0] < 5e-3 * np.abs(fine).max()
    assert error[0] / error[1] > 3.0
    assert error[1] / error[2] > 3.0


def test_force_grows_with_the_actual_depth():
    of = task()
    process = milling(of, force="mean")
    deeper = of.desired.displaced(
        np.hstack([np.tile(PART.rotation.apply([0.0, 0.0, -3e-4]), (601, 1)), np.zeros((601, 3))])
    )
    base, more = (process.evaluate(path).wrench.force[0, 50:] for path in (of.desired, deeper))
    np.testing.assert_allclose(more, 1.1 * base, rtol=1e-9)


def test_no_force_in_the_air():
    of = task()
    high = np.hstack(
        [np.tile(PART.rotation.apply([0.0, 0.0, 3.1e-3]), (601, 1)), np.zeros((601, 3))]
    )
    for force in ("mean", "tooth-passing"):
        wrench = milling(of, force=force).evaluate(of.desired.displaced(high)).wrench.wrench[0]
        assert np.all(wrench == 0.0)


def test_chip_follows_the_actual_feed():
    """A tool that runs ahead by 10 % of its speed cuts chips thicker by 10 %; edges stay."""
    of = task()
    ahead = np.zeros((601, 6))
    ahead[:, :3] = PART.rotation.apply(
        np.column_stack([np.outer(0.1 * FEED * of.desired.time, HEADING), np.zeros(601)])
    )
    process = milling(of, force="mean", K_te_N_m=0.0, K_re_N_m=0.0, K_ae_N_m=0.0)
    base, more = (
        process.evaluate(path).wrench.force[0, 50:]
        for path in (of.desired, of.desired.displaced(ahead))
    )
    np.testing.assert_allclose(more, 1.1 * base, rtol=1e-9)


@pytest.mark.parametrize(("engagement", "side"), [("up", 1.0), ("down", -1.0)])
def test_a_tool_nearer_to_the_material_cuts_wider(engagement, side):
    """Offset by 1 mm towards the material: the force of a cut set 1 mm wider."""
    of = task()
    offset = np.zeros((601, 6))
    offset[:, :3] = PART.rotation.apply([*(1e-3 * side * LEFT), 0.0])
    narrow = milling(of, engagement=engagement, radial_depth_m=4e-3)
    wide = milling(of, engagement=engagement, radial_depth_m=5e-3)
    moved, set_wider = (
        narrow.evaluate(of.desired.displaced(offset)).wrench.wrench[0],
        wide.evaluate(of.desired).wrench.wrench[0],
    )
    np.testing.assert_allclose(moved[1:], set_wider[1:], rtol=0, atol=1e-6)
    assert np.abs(set_wider - narrow.evaluate(of.desired).wrench.wrench[0]).max() > 10.0


def test_regeneration_a_wave_of_the_tooth_frequency_leaves_the_chip_alone():
    """Tool and last surface move alike: the chip, and so the force, is that of the steady feed."""
    of = task()
    wave = np.zeros((601, 6))
    sway = 2e-5 * np.sin(2.0 * np.pi * of.desired.time / 1.5e-3)
    wave[:, :3] = PART.rotation.apply(np.column_stack([np.outer(sway, HEADING), np.zeros(601)]))
    process = milling(of)
    steady, moved = (
        in_cut(process.evaluate(path).wrench.wrench[0])[40:]
        for path in (of.desired, of.desired.displaced(wave))
    )
    np.testing.assert_allclose(moved, steady, rtol=0, atol=1e-6 * np.abs(steady).max())
    half = np.zeros((601, 6))
    sway = 2e-5 * np.sin(2.0 * np.pi * of.desired.time / 3e-3)
    half[:, :3] = PART.rotation.apply(np.column_stack([np.outer(sway, HEADING), np.zeros(601)]))
    changed = in_cut(process.evaluate(of.desired.displaced(half)).wrench.wrench[0])[40:]
    assert np.abs(changed - steady).max() > 20.0


def test_feed_directions_of_a_standing_tool_are_those_of_its_last_feed():
    time = np.linspace(0.0, 1.0, 11)
    x = np.clip(time - 0.3, 0.0, 0.4) * 0.1
    of = Task(PART, tool_path(PART, time, np.column_stack([0 * x, -x, 0 * x - 1e-3])))
    directions = milling(of, force="mean").milling.feed_directions()
    np.testing.assert_allclose(directions, np.tile([0.0, -1.0], (11, 1)), atol=1e-12)


@pytest.mark.parametrize("force", ["mean", "tooth-passing"])
def test_edge_forces_go_and_come_with_the_feed_of_a_tool_that_stops_in_its_slot(force):
    """N a (K_tc c/4 + K_te/pi min(c / 5 um, 1)) across the feed, a revolution of 3 ms after another."""
    time = np.arange(8010) * 1e-4
    feed = 2e-2 * np.sin(2.0 * np.pi * time / 0.8) ** 2  # it stands at 0.4 s
    points = np.column_stack([np.outer(np.cumsum(feed) * 1e-4, HEADING), np.full(8010, -3e-3)])
    of = Task(PART, tool_path(PART, time, points))
    across = in_cut(milling(of, force=force).evaluate(of.desired).wrench.before[0])[:, 1]
    c, a, N, K = feed * 60.0 / 20000.0 / 2.0, 3e-3, 2, ALUMINIUM
    expected = N * a * (K.K_tc * c / 4 + K.K_te / np.pi * np.minimum(c / 5e-6, 1.0))
    revolutions, expected = (values.reshape(267, 30).mean(axis=1) for values in (across, expected))
    assert np.abs(np.diff(expected)).max() < 8.0 < 80.0 < expected.max()
    np.testing.assert_allclose(revolutions, expected, rtol=0, atol=1.5)


BAD_KEYS = [
    ({"radial_depth_m": 1e-3}, "none for a slot or a stock, got 0.001 for slot"),
    ({"engagement": "up"}, "expected a depth for up and down, .* got none for up"),
    ({"engagement": "down", "radial_depth_m": 0.02}, "at most cutter_diameter_m"),
]


@pytest.mark.parametrize(("keys", "words"), BAD_KEYS)
def test_contradicting_keys_are_refused(keys, words):
    with pytest.raises(ValueError, match=words):
        milling(task(), **keys)


def test_samples_too_far_apart_for_the_teeth_are_refused():
    with pytest.raises(CaseError, match=r"at most 0\.25 ms apart, .* 1\.5 ms, got 0\.5 ms"):
        milling(task(5e-4))
    milling(task(5e-4), force="mean")


def test_a_plunge_alone_has_no_feed():
    of = task()
    still = Task(PART, tool_path(PART, of.desired.time, np.zeros((601, 3))))
    with pytest.raises(CaseError, match="never moves"):
        milling(still)


def levels(offset: float = 0.0, of_second: float = 0.0) -> tuple[Task, ToolPath]:
    """Return two slots above each other, 3 and 5 mm deep, and the path of a tool that is off [m]."""
    time = np.arange(2401) * 1e-3
    x = 0.05 * np.concatenate(
        [np.linspace(0, 1, 1001), np.linspace(1, 0, 401), np.linspace(0, 1, 999)]
    )
    z = np.select([time < 1.0, time < 1.4], [-3e-3, 2e-3], -5e-3)
    points = np.column_stack([x, 0 * x, z])
    of = Task(PART, tool_path(PART, time, points))
    away = np.where(time < 1.2, offset, of_second)[:, None] * PART.rotation.apply([0.0, 0.0, -1.0])
    return of, of.desired.displaced(np.hstack([away, np.zeros((len(time), 3))]))


def test_a_second_level_is_as_deep_as_the_robot_sags_more_than_in_the_first():
    """The floor below it was made by the tool that sagged as well."""
    engagement = {"engagement": "stock", "force": "mean"}
    of, as_desired = levels()
    process = milling(of, **engagement)
    (middle,) = np.flatnonzero(of.desired.time == 2.0)

    def force(path: ToolPath) -> np.ndarray:
        return process.evaluate(path).wrench.wrench[0][middle]

    exact = force(as_desired)
    np.testing.assert_allclose(force(levels(3e-4, 3e-4)[1]), exact, rtol=1e-6)
    deeper = force(levels(3e-4, 7e-4)[1])
    np.testing.assert_allclose(deeper[:3], 1.2 * exact[:3], rtol=1e-6)


@pytest.mark.parametrize(
    "keys", [{"engagement": "slot"}, {"engagement": "down", "radial_depth_m": 4e-3}]
)
def test_a_stated_engagement_is_as_deep_as_what_the_level_before_has_left(keys):
    """Slots of 3 and 5 mm above each other: the second one is 2 mm deep, the way back cuts nothing."""
    of, as_desired = levels()
    wrench = milling(of, force="mean", **keys).evaluate(as_desired).wrench.wrench[0]
    first, back, second = (wrench[round(1e3 * at)] for at in (0.5, 1.2, 2.0))
    np.testing.assert_allclose(second[:3], first[:3] * 2.0 / 3.0, rtol=5e-3)
    assert not back.any()


@pytest.mark.parametrize(("engagement", "side"), [("up", 1.0), ("down", -1.0)])
def test_a_block_beside_the_path_is_milled_as_it_is_stated(engagement, side):
    of = task(duration=0.12)
    corner = Frame(np.zeros(3), Rotation.from_euler("z", np.arctan2(*HEADING[::-1])))
    # The block's sides are along the part's axes: the path is turned to its x axis.
    turned = PART.coordinates(of.desired.position[0]) @ corner.rotation.as_matrix()
    along_x = Task(PART, tool_path(PART, of.desired.time, turned))
    edge = side * (RADIUS - 4e-3)
    raw = [[-1.0, min(edge, side)], [1.0, max(edge, side)]]
    met, stated = (
        milling(along_x, force="mean", **keys).evaluate(along_x.desired).wrench.wrench[0][600:]
        for keys in (
            {"engagement": "stock", "stock_m": raw},
            {"engagement": engagement, "radial_depth_m": 4e-3},
        )
    )
    np.testing.assert_allclose(met, stated, rtol=0, atol=0.01 * np.abs(stated).max())


def test_a_material_a_specific_force_and_six_coefficients_are_alike_and_exclude_each_other():
    of = task()
    assert milling(of, **NONE_STATED, material="aluminium-7075").milling.coefficients.K_tc == 767e6
    force = {"kc11_Pa": 7e8, "kienzle_exponent": 0.25}
    kienzle = milling(of, **NONE_STATED, **force).milling
    chip = 2.0 / np.pi * FEED * kienzle.cutter.tooth_period
    expected = 7e8 * chip * (chip / 1e-3) ** -0.25
    assert kienzle.coefficients.K_tc * chip + kienzle.coefficients.K_te == pytest.approx(expected)
    for keys, words in (
        ({"material": "aluminium-7075"}, "got material and K_tc_Pa"),
        ({**NONE_STATED}, "got none"),
        ({**NONE_STATED, "material": "aluminum-7075"}, "aluminium-7075"),
        ({"K_re_N_m": None}, "K_re_N_m: expected all six"),
        ({**NONE_STATED, "kc11_Pa": 7e8}, "give both"),
    ):
        with pytest.raises(ValueError, match=words):
            milling(of, **keys)


NONE_STATED = {key: None for key in KEYS if key.startswith("K_")}


def test_the_course_of_a_slot_is_that_of_its_feed_and_depth():
    of = task(duration=0.12)
    course = CutCourse.of(milling(of, engagement="stock").milling)
    middle, chip = 900, FEED * 60.0 / 20000.0 / 2.0
    assert course.feed_per_tooth[middle] == pytest.approx(chip) == course.peak_chip[middle]
    assert course.mean_chip[middle] == pytest.approx(chip * 2.0 / np.pi)
    assert course.removal_rate[middle] == pytest.approx(2.0 * RADIUS * 3e-3 * FEED)
    K = ALUMINIUM
    power = K.K_tc * course.removal_rate[middle] + 3e-3 * K.K_te * course.cutting_speed
    assert course.power[middle] == pytest.approx(
        power
    )  # two teeth: one is in the slot at all times


@pytest.mark.parametrize("force", ["mean", "tooth-passing"])
def test_edges_on_the_end_press_upwards_and_take_the_power_of_what_they_remove(force):
    """Down a ramp, back up and down it again through the air of its slot, where the end has nothing.

    N R (K_rc d + s K_re) upwards and the power pi R^2 v K_tc + s N R^2/2 omega K_te, d being the descent
    v from tooth to tooth and s what it is over 5 um.
    """
    there = np.linspace(0.0, 0.02, 2001)
    way = np.concatenate([there, there[-2::-1], there[1:]])
    points = np.column_stack([np.outer(way, HEADING), -0.02 * way])
    of = Task(PART, tool_path(PART, np.arange(len(way)) * 1e-4, points))
    both = [
        milling(of, force=force, engagement="stock", end_edge_m=length) for length in (0.0, RADIUS)
    ]
    without, within = (process.evaluate(of.desired).wrench for process in both)
    added = (within.before - without.before)[0]
    pushed, turned = (PART.rotation.inv().apply(added[:, s]) for s in (slice(0, 3), slice(3, 6)))
    rate, omega, K = 0.02 * FEED, 20000.0 * np.pi / 30.0, ALUMINIUM
    share = rate * 1.5e-3 / 5e-6
    thrust = 2 * RADIUS * (K.K_rc * rate * 1.5e-3 + share * K.K_re)
    power = np.pi * RADIUS**2 * rate * K.K_tc + share * RADIUS**2 * omega * K.K_te
    down = (within.instants > 0.02) & (within.instants < 0.19)
    assert np.count_nonzero(down) > 1000
    np.testing.assert_allclose(pushed[down, 2], thrust, rtol=0.02)
    np.testing.assert_allclose(pushed[down, :2], 0.0, atol=1e-6)
    np.testing.assert_allclose(turned[down, 2] * omega, power, rtol=0.02)
    np.testing.assert_allclose(added[within.instants > 0.21], 0.0, atol=1e-9)
    greater, smaller = (CutCourse.of(process.milling).power[300:1700] for process in both[::-1])
    np.testing.assert_allclose(greater - smaller, power, rtol=0.02)


@pytest.mark.parametrize(
    ("line", "stated", "words"),
    [
        ("S12000 M3", None, ""),
        ("S12000 M3", 12000.0, ""),
        ("S20000 M3", 12000.0, "expected 20000, as line 2 of pocket.ngc has it, got 12000"),
        ("M3", None, "none in a program"),
        ("S12000 M4", None, "line 2: expected M3, got M4"),
        ("S12000 M5", None, "line 2: expected no feed behind M5"),
        ("G96 S300 M3", None, "got m/min, as G96 has it"),
        ("S1=12000 M1=3", None, ""),
        ("S1=20000 M1=3", 12000.0, "expected 20000, as line 2 of pocket.ngc has it, got 12000"),
        ("S1=12000 M1=4", None, "line 2: expected M3, got M4"),
        ("S0 M3", None, "expected a speed of the spindle above 0"),
    ],
)
def test_the_speed_of_a_program_is_used_and_not_contradicted(tmp_path, line, stated, words):
    program = tmp_path / "pocket.ngc"
    program.write_text(f"G21 G90 G94\n{line}\nG0 X0 Y0 Z5\nG1 Z-1 F600\nX5\nX10\nM30\n")
    table = GcodePath.model_validate({"kind": "gcode", "file": str(program)})
    of = table.task(PART)
    keys = {"engagement": "stock", "force": "mean", "spindle_speed_rpm": stated}
    if words:
        with pytest.raises(CaseError, match=words):
            milling(of, **keys)
    else:
        speed = milling(of, **keys).milling.cutter.speed
        assert speed == pytest.approx(12000.0 * 2.0 * np.pi / 60.0)
    program.write_text("G21 G90 G94\nS9000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F600\nX5\nS8000\nX10\nM30\n")
    changes = GcodePath.model_validate({"kind": "gcode", "file": str(program)}).task(PART)
    with pytest.raises(CaseError, match=r"got 9000 1/min in line 2 .* and 8000 in line 6"):
        milling(changes, **{**keys, "spindle_speed_rpm": None})


@pytest.mark.parametrize(
    ("lines", "stated", "words"),
    [
        ("SPINDL/RPM,12000,CLW", None, ""),
        ("SPINDL/ 12000.000, RPM, CLW", 12000.0, ""),
        ("SPINDLE/12000", None, ""),
        ("SPINDL/ON,RANGE,2,MAXRPM,18000,RPM,12000,CLW", None, ""),
        ("SPINDL/12000,CLW\nSPINDL/OFF\nSPINDL/ON", None, ""),
        ("SPINDL/9000\nSPINDL/12000", None, ""),
        ("SPINDL/20000,CLW", 12000.0, "expected 20000, as line 1 of part.cls has it, got 12000"),
        ("SPINDL/OFF", None, "expected no feed behind SPINDL/OFF"),
        ("SPINDL/12000,CCLW", None, "expected CLW, got CCLW"),
        ("SPINDL/SMM,300", None, "got SMM, a cutting speed"),
        ("SPINDL/12000,900", None, "expected one speed, got 2"),
        ("SPINDL/FAST", None, "got 'FAST'"),
        ("SPINDL/0", None, "expected a speed of the spindle above 0"),
        ("SPINDL/NAN", None, "got 'NAN'"),
        ("", None, "none in a program"),
    ],
)
def test_the_speed_of_an_apt_file_is_used_and_not_contradicted(tmp_path, lines, stated, words):
    file = tmp_path / "part.cls"
    moves = "UNITS/MM\nRAPID\nGOTO/0,0,5\nFEDRAT/MMPM,600\nGOTO/0,0,-1\nGOTO/10,0,-1\n"
    file.write_text(f"{lines}\n{moves}FINI\n")
    of = AptPath.model_validate({"kind": "apt", "file": str(file)}).task(PART)
    keys = {"engagement": "stock", "force": "mean", "spindle_speed_rpm": stated}
    if words:
        with pytest.raises(CaseError, match=words):
            milling(of, **keys)
    else:
        speed = milling(of, **keys).milling.cutter.speed
        assert speed == pytest.approx(12000.0 * 2.0 * np.pi / 60.0)
