"""Cutting coefficients and run-out from slots: recovered, predicted, refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command_line import status
from fixture_store import stored
from places import EXAMPLES, ROOT

from coupling.case.file import load_case
from coupling.errors import IdentifyError
from coupling.files.toml_file import document
from coupling.identification.cutting import results
from coupling.identification.cutting.fit import CuttingFit, fitted_slots, slot_forces
from coupling.identification.cutting.results import identify_cutting
from coupling.identification.cutting.slots import MeasuredSlots, SlotCutter
from coupling.process.cutting_force import CuttingCoefficients

SLOTS = ROOT / "examples" / "identify" / "slots.csv"
MILL = SlotCutter(16e-3, 2, float(np.deg2rad(45.0)), 6000.0, 3e-3)
TRUE = np.array([9e8, 2.5e8, 1.5e8, 1.6e4, 1.9e4, 1.5e4])
FEEDS = np.array([300.0, 600.0, 900.0, 1500.0]) / 6e4
OPTIONS = [
    "--diameter-mm",
    "16",
    "--teeth",
    "2",
    "--helix-deg",
    "45",
    "--rpm",
    "6000",
    "--depth-mm",
    "3",
]


def fitted(cutter: SlotCutter, slots: MeasuredSlots) -> CuttingFit:
    """What fits slots; the same in several tests."""
    return stored(fitted_slots, cutter, slots)


@pytest.fixture(autouse=True)
def _fitted_once(monkeypatch):
    monkeypatch.setattr(results, "fitted_slots", fitted)


def test_coefficients_and_run_out_are_recovered_from_a_slots_forces():
    exact = CuttingFit(TRUE, TRUE, 1.2e-5, 0.0, np.ones(5)).predicted(MILL, FEEDS)
    fit = fitted(MILL, exact)
    np.testing.assert_allclose(fit.values, TRUE, rtol=1e-4)
    assert fit.run_out == pytest.approx(1.2e-5, rel=1e-4)
    # What a dynamometer shows too much is told from the forces.
    shown = np.array([1.1, 1.1, 1.0, 1.05, 1.1])
    wrong = CuttingFit(TRUE, TRUE, 1.2e-5, 0.0, shown).predicted(MILL, FEEDS)
    fit = fitted(MILL, wrong)
    np.testing.assert_allclose(fit.values, TRUE, rtol=0.08)
    assert abs(fit.run_out - 1.2e-5) < fit.run_out_half
    np.testing.assert_allclose(
        fit.predicted(MILL, FEEDS).passing[:, :2], wrong.passing[:, :2], rtol=0.02
    )


def test_a_tooth_that_is_worn_more_is_told_from_the_forces():
    """Its edge bears 30 % more than the mean, where it runs out most: coefficients are those of all.

    Edges that are alike and usually round count as measurements: they move coefficients by 5 %.
    """
    worn = CuttingFit(TRUE, TRUE, 1.2e-5, 0.0, np.ones(5), 0.3).predicted(MILL, FEEDS)
    fit = fitted(MILL, worn)
    assert fit.edge_difference == pytest.approx(0.3, abs=0.06)
    np.testing.assert_allclose(fit.values, TRUE, rtol=0.06)
    # Alone, without run-out, all that differs from tooth to tooth are the edges.
    even, uneven = (
        slot_forces(CuttingCoefficients(*TRUE), 0.0, MILL, FEEDS, d) for d in (0.0, 0.3)
    )
    np.testing.assert_allclose(uneven[0], even[0], rtol=1e-12)
    np.testing.assert_allclose(even[1], 0.0, atol=1e-9)
    assert np.all(uneven[1][:, :2] > 10.0)


def test_without_run_out_the_teeths_amplitudes_are_the_closed_form():
    """Two teeth without edge forces: a c/2 (K_tc^2 + K_rc^2)^1/2 sin(l)/l, l the lag over the depth."""
    cut_only = CuttingCoefficients(*TRUE[:3].tolist(), 0.0, 0.0, 0.0)
    mean, once, passing = slot_forces(cut_only, 0.0, MILL, FEEDS)
    np.testing.assert_allclose(once, 0.0, atol=1e-9)
    # Means: a N c/4 K_tc across, -a N c/4 K_rc along, a N c/pi K_ac axially.
    chip = 2.0 * MILL.depth * MILL.chip(FEEDS)[:, None]
    factors = np.array([0.25, -0.25, 1.0 / np.pi]) * TRUE[:3]
    np.testing.assert_allclose(mean, chip * factors, rtol=1e-3)
    lag = np.tan(MILL.helix) / 8e-3 * MILL.depth
    size = 0.5 * MILL.depth * MILL.chip(FEEDS) * np.hypot(*TRUE[:2]) * np.sin(lag) / lag
    np.testing.assert_allclose(passing[:, 0], size, rtol=5e-3)
    np.testing.assert_allclose(passing[:, 1], size, rtol=5e-3)


def test_a_tooth_that_runs_out_leaves_means_that_are_not_straight_in_the_feed():
    """A tooth that misses the cut has no edge force: least at the smallest chip."""
    alone, both = (
        slot_forces(CuttingCoefficients(*TRUE), e, MILL, FEEDS)[0] for e in (0.0, 1.6e-5)
    )
    missing = 1.0 - np.abs(both[:, 1]) / np.abs(alone[:, 1])
    assert np.all(np.diff(missing) < 0.0)
    assert missing[0] > 0.15 > 0.06 > missing[-1]
    # The chips that it leaves are cut by the other: what does not depend on edges stays.
    cut_only = CuttingCoefficients(*TRUE[:3].tolist(), 0.0, 0.0, 0.0)
    alone, both = (slot_forces(cut_only, e, MILL, FEEDS)[0] for e in (0.0, 1.6e-5))
    np.testing.assert_allclose(both[:, 0], alone[:, 0], rtol=0.03)


def test_roundness_of_the_edges_is_told_from_the_forces():
    """Edges that act at chips of 16 um: with the usual 8 um for all, coefficients are 12 % off."""
    exact = CuttingFit(TRUE, TRUE, 1.2e-5, 0.0, np.ones(5), 0.0, 1.6e-5).predicted(MILL, FEEDS)
    fit = fitted(MILL, exact)
    assert 1.2e-5 < fit.roundness < 1.6e-5  # the usual one counts as a measurement, too
    np.testing.assert_allclose(fit.values, TRUE, rtol=0.06)


@pytest.mark.parametrize(
    ("held_out", "mean"), [(0, 10.0), (1, 7.0), (2, 7.0)], ids=["300", "600", "900"]
)
def test_a_measured_feed_is_predicted_by_the_others(held_out, mean):
    """Means within 10 N, the teeth's amplitudes within 10 %; once a revolution in the plane 15 %.

    At 300 mm/min, beyond the others, the roundness that predicts once a revolution costs 3 N of a mean.
    """
    measured = MeasuredSlots.read(SLOTS, MILL)
    others = fitted(MILL, measured.only([k for k in range(len(measured.feed)) if k != held_out]))
    feed = measured.feed[held_out : held_out + 1]
    predicted = others.predicted(MILL, feed)
    assert np.abs(predicted.mean[0] - measured.mean[held_out]).max() < mean
    ratio = predicted.passing[0, :2] / measured.passing[held_out, :2]
    assert np.abs(ratio - 1.0).max() < 0.10
    ratio = predicted.once[0, :2] / measured.once[held_out, :2]
    assert np.abs(ratio - 1.0).max() < 0.15


def test_columns_and_signs_of_the_axes_are_told_apart(tmp_path):
    text = SLOTS.read_text()
    header, *rows = [line for line in text.splitlines() if not line.startswith("#")]
    swap = {"x": "y", "y": "x"}
    names = [
        name[:-1] + swap.get(name[-1], name[-1]) if "_" in name[:-1] else name
        for name in header.split(",")
    ]
    file = tmp_path / "swapped.csv"
    file.write_text("\n".join([",".join(names), *rows]))
    a, b = (MeasuredSlots.read(path, MILL) for path in (SLOTS, file))
    assert (a.axes, b.axes) == (("+x", "+y", "+z"), ("+y", "+x", "+z"))
    np.testing.assert_array_equal(a.mean, b.mean)


def test_the_command_writes_keys_that_a_case_reads(tmp_path, capsys):
    target = tmp_path / "coefficients.toml"
    assert status("identify", SLOTS, *OPTIONS, "-o", target) == 0
    keys = document(target, IdentifyError)
    assert keys["K_tc_Pa"] == pytest.approx(8.47e8, rel=0.02)
    assert keys["runout_m"] == pytest.approx(1.49e-5, rel=0.02)
    figures = json.loads(target.with_suffix(".json").read_text())
    assert len(figures["predictions"]) == 4 * 8
    first_screen = capsys.readouterr().out
    assert "IDENTIFIED: a mean force at a feed that was not used" in first_screen
    assert len(first_screen.splitlines()) <= 15


def _milling_case(folder, helix):
    text = (EXAMPLES / "cases" / "milling_20000.toml").read_text()
    case = folder / "slot.toml"
    case.write_text(text.replace("helix_deg         = 30.0", f"helix_deg         = {helix}"))
    return case


def test_coefficients_and_run_out_are_written_into_a_case(tmp_path, capsys):
    """Beside it, as a case that loads; of another cutter, or elsewhere, they are refused."""
    case = _milling_case(tmp_path, 45.0)
    assert status("identify", SLOTS, *OPTIONS, "--case", case) == 0
    target = tmp_path / "slot_identified.toml"
    assert f"elastic-robot compensate {target}" in capsys.readouterr().out
    process = load_case(target).resolved["process"]
    assert process["runout_m"] == pytest.approx(1.49e-5, rel=0.02)
    assert process["runout_deg"] == 0.0
    assert process["K_tc_Pa"] == pytest.approx(8.47e8, rel=0.02)
    assert "# ramps in, feeds along x, ramps out" in target.read_text()
    target.unlink()
    for words, said in (
        (("--case", _milling_case(tmp_path, 30.0)), "process.helix_deg: expected 45"),
        (("--case", case, "-o", tmp_path / "sub" / "x.toml"), "names its files"),
        (
            ("--case", EXAMPLES / "cases" / "cone.toml", "-o", EXAMPLES / "cases" / "x.toml"),
            "milling-force",
        ),
    ):
        assert status("identify", SLOTS, *OPTIONS, *words) == 2
        assert said in " ".join(capsys.readouterr().err.split())
    assert not target.exists()
    assert not (EXAMPLES / "cases" / "x.html").exists()


def test_forces_that_do_not_follow_the_feeds_are_refused():
    """Every other row of another depth: one left out is predicted to no better than a third."""
    exact = CuttingFit(TRUE, TRUE, 1.2e-5, 0.0, np.ones(5)).predicted(MILL, FEEDS)
    mixed = replace(exact, mean=exact.mean * np.array([[0.4], [1.6]] * 2))
    assert not identify_cutting(MILL, exact).refusal
    assert "half of the mean forces" in identify_cutting(MILL, mixed).refusal


@pytest.mark.parametrize(
    ("lines", "words", "options"),
    [
        (("feed_mm_min,mean_x",), "--diameter-mm, --teeth", ()),
        (None, "amplitude_120Hz_x", ("--rpm", "7200")),
        (None, "--teeth: expected a number", ("--teeth", "0")),
        (None, "--helix-deg", ("--helix-deg", "95")),
        (("300,1,1,1", "600,2,2,2"), "three feeds", OPTIONS),
        (("300,1,1,1", "300,2,2,2", "600,3,3,3"), "each once", OPTIONS),
        (("300,3,1,1", "600,2,0.9,2", "900,1,0.8,3"), "that falls", OPTIONS),
        (("300,x,1,1",), "expected a finite number", OPTIONS),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path, capsys, lines, words, options):
    file = SLOTS
    if lines is not None:
        amplitudes = ",".join(f"amplitude_{f}Hz_{axis}" for f in (100, 200) for axis in "xyz")
        file = tmp_path / "slots.csv"
        rows = [line if "mean" in line else f"{line},1,1,1,1,1,1" for line in lines]
        head = [] if "mean" in lines[0] else [f"feed_mm_min,mean_x,mean_y,mean_z,{amplitudes}"]
        file.write_text("\n".join([*head, *rows, *(["1,1"] if "mean" in lines[0] else [])]) + "\n")
    given = dict(zip(OPTIONS[::2], OPTIONS[1::2], strict=True)) if options else {}
    given |= dict(zip(options[::2], options[1::2], strict=True))
    flat = [word for pair in given.items() for word in pair]
    target = tmp_path / "out.toml"
    assert status("identify", file, *flat, "-o", target) == 2
    assert words in capsys.readouterr().err.replace("\n", " ")
    assert not target.exists()


def test_more_teeth_have_their_own_frequency(tmp_path):
    three = SlotCutter(10e-3, 3, 0.5, 6000.0, 2e-3)
    exact = CuttingFit(TRUE, TRUE, 5e-6, 0.0, np.ones(5)).predicted(three, FEEDS)
    fit = fitted(three, exact)
    np.testing.assert_allclose(fit.values, TRUE, rtol=1e-4)
    assert fit.run_out == pytest.approx(5e-6, rel=1e-3)
