"""elastic-robot stability, and what other commands say of a cut that chatters."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import status
from first_screens import GLOSSARY
from titanium_slot import PROCESS

from coupling.case.file import load_case
from coupling.errors import CaseError, StabilityError
from coupling.events import unwatched
from coupling.files.robot_file import find_robot
from coupling.process.cutting_force import Cutter, CuttingCoefficients
from coupling.stability.case_cut import CaseCuts
from coupling.stability.chart import speed_chart
from coupling.stability.clear_chatter import refuse_clear_chatter
from coupling.stability.floquet import growth_of, vibration_of
from coupling.stability.judgement import Judgement
from coupling.stability.path_stability import PathStability, most_different, stability_in_brief
from coupling.stability.steady_cut import SteadyCut
from coupling.stability.structure import Structure, ToolMode
from coupling.stability.zero_order import ZeroOrder

# A slot in titanium with a robot that chatters at 2 mm and does not at 0.5 mm.
SLOT = (
    """
[robot]
description = "fanuc_r2000ic"
home_deg    = [0.0, 10.0, -10.0, 0.0, -70.0, 0.0]

[part]
position_m = [1.6, 0.0, 0.6]

[tool_path]
kind     = "line"
points_m = [[0.0, 0.0, 0.001], [0.004, 0.0, -{depth}], [0.008, 0.0, -{depth}], [0.012, 0.0, 0.001]]
feed_m_s = 0.02
blend_s  = 0.1
sample_s = 0.0015
"""
    + PROCESS
)
ONE = ["--posture-deg", "0,10,-20,0,-60,0", "--feed-deg", "30", "--rpm", "3000"]


pytestmark = pytest.mark.usefixtures("coarse_charts")
AS_COUPLE = ("slot.toml", ("couple", "slot.toml"), unwatched)


def slot(folder: Path, depth: float = 0.002, more: str = "") -> Path:
    file = folder / "slot.toml"
    file.write_text(SLOT.format(depth=depth) + more)
    return file


def judged(folder: Path, *words: object, more: str = "") -> dict:
    out = folder / f"out{len(list(folder.iterdir()))}"
    assert status("stability", slot(folder, more=more), "-o", out, "-v", *words) == 0
    return json.loads((out / "stability.json").read_text())


def test_one_posture_is_judged_by_growth_and_limit(tmp_path, capsys):
    shallow = judged(tmp_path, *ONE, "--depth-mm", "0.5")["points"]
    deep = judged(tmp_path, *ONE, "--depth-mm", "2.0")["points"]
    assert [len(shallow), len(deep)] == [1, 1]
    keys = {
        "time",
        "posture_deg",
        "rpm",
        "depth_m",
        "stable",
        "growth_1_s",
        "frequency_Hz",
        "limit_m",
    }
    assert keys <= set(deep[0])
    assert (shallow[0]["stable"], deep[0]["stable"]) == (True, False)
    assert shallow[0]["growth_1_s"] < 0.0 < deep[0]["growth_1_s"]
    np.testing.assert_allclose(deep[0]["posture_deg"], [0, 10, -20, 0, -60, 0], atol=1e-9)
    # Mean wrenches of both depths press all gears, so that the limit is that of one robot.
    assert shallow[0]["limit_m"] == pytest.approx(deep[0]["limit_m"], rel=5e-3)
    assert 0.5e-3 < deep[0]["limit_m"] < 2e-3
    said = capsys.readouterr().out
    assert re.search(r"stable, limit [\d.]+ mm at 3000 1/min", said)
    assert re.search(r"chatters at [\d.]+ Hz from depth [\d.]+ mm", said)


def test_where_no_limit_was_met_the_depth_that_was_looked_at_is_said(tmp_path, capsys):
    shallow = "\n[stability]\nmax_depth_m = 0.0003\n"
    stable = judged(tmp_path, *ONE, "--depth-mm", "0.2", more=shallow)
    said = capsys.readouterr().out
    assert stable["points"][0]["limit_m"] is None
    assert "Stable up to: > 0.3 mm" in said
    assert "stable, no limit up to 0.3 mm at 3000 1/min" in said


def test_a_cut_that_is_deeper_than_limits_are_looked_for_has_its_limit(tmp_path, capsys):
    shallow = "\n[stability]\nmax_depth_m = 0.0003\n"
    (deep,) = judged(tmp_path, *ONE, "--depth-mm", "2.0", more=shallow)["points"]
    (usual,) = judged(tmp_path, *ONE, "--depth-mm", "2.0")["points"]
    assert not deep["stable"]
    assert deep["limit_m"] == pytest.approx(usual["limit_m"], rel=5e-3)
    assert not re.search(r"from depth inf|than > ", capsys.readouterr().out)


def test_feed_back_and_forth_in_a_slot_is_alike_but_for_the_axial_force(tmp_path):
    """Turned by half a turn chip and force across the axis change sign, the axial force does not."""
    text = SLOT.format(depth=0.002)
    posture = np.deg2rad([0.0, 10.0, -20.0, 0.0, -60.0, 0.0])

    def limit(degrees: float, axial: float) -> float:
        file = tmp_path / "slot.toml"
        file.write_text(text.replace("K_ac_Pa           = 3.0e8", f"K_ac_Pa = {axial}"))
        cuts = CaseCuts(load_case(file))
        placed = cuts.in_posture(posture, np.deg2rad(degrees), 3000.0, 1e-3)
        return Judgement.of(cuts, placed).limit

    # The moment about the axis does not either, with an arm of the cutter's radius alone.
    assert limit(180.0, 0.0) == pytest.approx(limit(0.0, 0.0), rel=0.06)
    assert limit(180.0, 3e8) > 1.1 * limit(0.0, 3e8)
    assert limit(90.0, 3e8) > 1.1 * limit(0.0, 3e8)


def test_a_tool_that_is_softer_than_the_robot_decides(tmp_path):
    tool = "\n[[stability.tool_mode]]\nfrequency_Hz = 60.0\ndamping_ratio = 0.02\nstiffness_N_m = 2e5\n"
    alone = judged(tmp_path, *ONE, "--depth-mm", "1")
    with_tool = judged(tmp_path, *ONE, "--depth-mm", "1", more=tool)
    assert with_tool["points"][0]["limit_m"] < 0.5 * alone["points"][0]["limit_m"]
    assert with_tool["tool_share"] > 0.8
    assert (alone["tool_share"], alone["tool_modes"]) == (0.0, 0)


def test_a_slow_cut_is_judged_with_the_many_waves_of_a_tool(tmp_path):
    """The deepest cuts take too many points: limits are looked for up to less, which is said."""
    more = "pitch_deg = [170.0, 190.0]\n[[stability.tool_mode]]\n"
    more += "frequency_Hz = 1900.0\ndamping_ratio = 0.02\nstiffness_N_m = 1e7\n"
    figures = judged(tmp_path, *ONE[:-1], "1700", "--depth-mm", "2", more=more)
    (point,) = figures["points"]
    assert not point["stable"]
    assert point["limit_m"] < 2e-3 < figures["deepest_m"] < 0.064
    # 67 waves in a turn.
    assert point["frequency_Hz"] == pytest.approx(2000.0, abs=100.0)


def tapped(tmp_path, change=lambda compliance, s: compliance) -> CaseCuts:
    """Return the cuts of a slot with the response of a tool, 600 Hz, 2 %, 2e7 N/m, in its file."""
    frequency = np.arange(100.0, 1500.0, 2.0)
    s, omega = 2j * np.pi * frequency, 2.0 * np.pi * 600.0
    response = change(omega**2 / 2e7 / (s**2 + 0.04 * omega * s + omega**2), s)
    table = np.column_stack([frequency, response.real, response.imag])
    header = "frequency_Hz,xx_real_m_N,xx_imag_m_N"
    np.savetxt(tmp_path / "tap.csv", table, delimiter=",", header=header, comments="")
    return CaseCuts(load_case(slot(tmp_path, more='\n[stability]\ntool_response = "tap.csv"\n')))


def test_a_measured_response_of_the_tool_is_its_mode(tmp_path):
    (mode,) = tapped(tmp_path).tool
    expected = (600.0, 0.02, 2e7)
    np.testing.assert_allclose(
        (mode.frequency, mode.damping_ratio, mode.stiffness), expected, rtol=1e-5
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda h, s: -h, "if motion and force have opposite signs"),
        (lambda h, s: h.conj(), "if their imaginary parts have the opposite sign"),
        (lambda h, s: 1e3 * h, "got 2e.04 N/m; modes of a tool follow it if they are in mm/N"),
        (lambda h, s: 1e6 * h, "if they are in um/N"),
        (lambda h, s: s * h, "if they are velocities over force"),
        (lambda h, s: s**2 * h, "if they are accelerations over force:"),
        (lambda h, s: 0.0 * h, "xx: expected a response, got 0 at all its frequencies"),
        (lambda h, s: 1e300 * h, "no structure moves so"),
        (lambda h, s: 1.0 / h, "that 6 modes at most follow, got one that they miss by 100 %:"),
        (lambda h, s: abs(h) + 0j, "that 6 modes at most follow, got one that they miss"),
    ],
)
def test_a_response_that_no_tool_has_is_refused_by_what_it_looks_like(tmp_path, change, words):
    with pytest.raises(StabilityError, match=words):
        _ = tapped(tmp_path, change).tool


def test_the_path_has_charts_at_its_worst_place(tmp_path, capsys):
    result = judged(tmp_path)
    times = [point["time"] for point in result["points"]]
    assert times == sorted(times)
    worst = result["points"][result["worst"]]
    assert worst["growth_1_s"] == max(point["growth_1_s"] for point in result["points"])
    assert not worst["stable"]
    chart = result["chart"]
    assert len(chart["rpm"]) == len(chart["limit_m"]) == 8
    assert chart["robot_alone_m"] == pytest.approx(chart["zero_order_m"])
    assert len(result["over_feed"]["limit_m"]) == 4
    by_name = {moved["name"]: moved["limit_m"] for moved in result["sensitivities"]}
    assert by_name["damping x 0.5"] < by_name["as in the robot file"] < by_name["damping x 2"]
    said = capsys.readouterr().out
    assert "Stable speeds at 2 mm" in said
    assert "tool decides" in said


def test_a_posture_beyond_the_joints_limits_is_judged_and_remarked(tmp_path, capsys):
    judged(tmp_path, "--posture-deg", "0,10,-20,0,-60,900", "--depth-mm", "1")
    assert re.search(r"Remark: joint 6: expected .* its limits, got 900", capsys.readouterr().out)


def test_a_robot_without_damping_is_judged_and_that_is_said(tmp_path, capsys):
    robot = find_robot("fanuc_r2000ic").read_text()
    robot = re.sub(r"\bdamping\s*=\s*[0-9][0-9.e]*", "damping = 0.0", robot)
    (tmp_path / "undamped.toml").write_text(robot)
    file = slot(tmp_path)
    file.write_text(file.read_text().replace('"fanuc_r2000ic"', '"undamped.toml"'))
    out = tmp_path / "out"
    assert status("stability", file, "-o", out, "-v", *ONE, "--depth-mm", "0.2") == 0
    assert re.search(
        r"Remark: .* states no damping, with which the limit goes", capsys.readouterr().out
    )
    sentence = json.loads((out / "stability.json").read_text())["sentence"]
    assert sentence.endswith("the robot's file states no damping")


@pytest.mark.parametrize("waves", [1e5, 1e9])
def test_a_cut_of_more_waves_than_can_be_looked_at_is_refused_at_once(waves):
    """Whatever their number: their elements are counted before they are made."""
    tip = Structure.of_modes([ToolMode(waves * 100.0, 0.02, 1e7)])
    mill = Cutter(radius=8e-3, teeth=2, helix=0.0, speed=100.0 * np.pi)
    cut = SteadyCut(mill, CuttingCoefficients(6e8, 2e8, 0, 0, 0, 0), 0.0, np.pi, 1e-3)
    with pytest.raises(
        StabilityError, match="raise the speed, or leave out the tool's fastest modes"
    ):
        growth_of(tip, cut)


def test_modes_that_only_creep_have_their_limit():
    """Zero order looks at where they decay where none swings."""
    creeping = Structure(
        -np.array([30.0, 200.0 + 0j]), np.full((2, 6), 1e-6 + 0j), np.ones((2, 2)) + 0j
    )
    mill = Cutter(radius=8e-3, teeth=2, helix=0.0, speed=100.0 * np.pi)
    cut = SteadyCut(mill, CuttingCoefficients(6e8, 2e8, 0, 0, 0, 0), 0.0, np.pi, 1e-6)
    limit = ZeroOrder.of(creeping, cut).limit(mill.tooth_period)
    assert limit > 0.0
    assert growth_of(creeping, cut.at_depth(0.5 * min(limit, 1.0))) < 0.0


def test_speeds_too_slow_for_the_fastest_mode_are_left_out_of_the_chart(tmp_path, monkeypatch):
    monkeypatch.setattr("coupling.stability.chart._SPEEDS", 3)
    more = "\n[stability]\nspindle_rpm = [20.0, 60000.0]\n\n[[stability.tool_mode]]\n"
    more += "frequency_Hz = 3e3\ndamping_ratio = 0.03\nstiffness_N_m = 5e7\n"
    cuts = CaseCuts(load_case(slot(tmp_path, more=more)))
    posture = np.deg2rad([0.0, 10.0, -20.0, 0.0, -60.0, 0.0])
    judgement = Judgement.of(cuts, cuts.in_posture(posture, 0.0, 3000.0, 1e-3))
    chart = speed_chart(judgement, lambda what, done, total: None)
    assert 20.0 < chart.rpm[0] < 6000.0
    shallow = judgement.placed.cut.at_depth(1e-5)
    for rpm in chart.rpm:
        _ = vibration_of(judgement.there.whole, shallow.at_speed(rpm))
    with pytest.raises(StabilityError, match="raise the speed"):
        vibration_of(judgement.there.whole, shallow.at_speed(20.0))


def test_a_cut_is_marched_in_time_where_asked(tmp_path):
    result = judged(tmp_path, *ONE, "--depth-mm", "2", "--march", "2")
    assert result["march"]["stable"] is False
    assert result["march"]["growth_1_s"] > 0.0


def test_what_is_in_the_folder_is_whole_and_not_replaced_unasked(tmp_path, capsys, monkeypatch):
    out, words = tmp_path / "out", (*ONE, "--depth-mm", "1")
    assert status("stability", slot(tmp_path), "-o", out, *words) == 0
    before = (out / "stability.json").read_bytes()
    (out / "notes.txt").write_text("of the user")
    assert status("stability", slot(tmp_path), "-o", out, *words) == 2
    assert "add --overwrite" in capsys.readouterr().err

    def fails(*_: object) -> str:
        raise StabilityError("no page")

    monkeypatch.setattr("coupling.report.result_report.document", fails)
    assert status("stability", slot(tmp_path), "-o", out, *words, "--overwrite") == 2
    assert (out / "stability.json").read_bytes() == before
    assert (out / "report.html").is_file()
    monkeypatch.undo()
    assert status("stability", slot(tmp_path), "-o", out, *words, "--overwrite") == 0
    assert {place.name for place in out.glob("[!.]*")} == {
        "stability.json",
        "report.html",
        "notes.txt",
    }
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("of the user")
    assert status("stability", slot(tmp_path), "-o", tmp_path / "mine", *words, "--overwrite") == 2
    assert "files that are not a result" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--rpm", "3000"], "--posture-deg"),
        ([*ONE], "--depth-mm"),
        ([*ONE, "--depth-mm", "-1"], "expected a number > 0, got -1"),
        ([*ONE, "--depth-mm", "nan"], "--depth-mm"),
        ([*ONE, "--depth-mm", "1e300"], "at most 1000 mm, got 1e+300 mm"),
        (
            [*ONE[:-1], "1e-3", "--depth-mm", "1"],
            "below the radius of the cutter, 8 mm, got 4.8e+05 mm",
        ),
        ([*ONE[:-1], "1e308", "--depth-mm", "1"], "expected at most 1e+06 1/min, got 1e+308"),
        (["--posture-deg", "0,1", "--depth-mm", "1"], "expected 6 angles"),
        (["--posture-deg", "0,1,x,0,0,0", "--depth-mm", "1"], "numbers between commas"),
        ([*ONE, "--depth-mm", "1", "--feed-deg", "inf"], "at most 3600 deg, got inf"),
        ([*ONE, "--depth-mm", "1", "--feed-deg", "1e300"], "at most 3600 deg, got 1e+300"),
        (["--posture-deg", "0,1e9,0,0,0,0", "--depth-mm", "1"], "at most 3600 deg, got 1e+09"),
    ],
)
def test_what_names_no_cut_is_refused(tmp_path, capsys, words, said):
    assert status("stability", slot(tmp_path), "-o", tmp_path / "out", *words) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("\n[stability]\nspindle_rpm = [9000.0, 3000.0]\n", "lowest < highest"),
        ("\n[stability]\nmodes = 3\n", "modes"),
        ("\n[stability]\nmax_depth_m = 1e9\n", "max_depth_m"),
        (
            "\n[[stability.tool_mode]]\nfrequency_Hz = 1e3\ndamping_ratio = 2.0\nstiffness_N_m = 1e7\n",
            "damping_ratio",
        ),
        (
            "\n[stability.process_damping]\nindentation_N_m3 = 0.0\nwear_land_m = 1e-4\n",
            "indentation",
        ),
        (
            "\n[stability.process_damping]\nindentation_N_m3 = 1e14\nwear_land_m = 0.08\n",
            "wear_land_m: expected a number less than or equal to 0.002, got 0.08",
        ),
        (
            "\n[[stability.tool_mode]]\nfrequency_Hz = 1e9\ndamping_ratio = 0.1\nstiffness_N_m = 1e-9\n",
            "(?s)frequency_Hz.*stiffness_N_m",
        ),
        ("\n[stability]\nspindle_rpm = [1e-300, 1e308]\n", "(?s)spindle_rpm 1.*spindle_rpm 2"),
    ],
)
def test_a_wrong_table_is_refused_with_its_key(tmp_path, more, said):
    with pytest.raises(CaseError, match=said):
        load_case(slot(tmp_path, more=more))


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("pitch_deg = [170.0, 180.0]", "360 deg in all"),
        ("pitch_deg = [100.0, 120.0, 140.0]", "expected 2 angles"),
        ("runout_m = 0.008", "less than half"),
        ("runout_m = -1e-6", "runout_m"),
    ],
)
def test_teeth_that_no_cutter_has_are_refused(tmp_path, keys, said):
    file = slot(tmp_path)
    file.write_text(file.read_text().replace("teeth             =", f"{keys}\nteeth ="))
    with pytest.raises(CaseError, match=said):
        load_case(file)


def test_pitch_and_runout_of_the_case_are_those_of_cut_and_stability(tmp_path):
    """One statement for the force and for the chart."""
    file = slot(tmp_path)
    keys = "pitch_deg = [170.0, 190.0]\nrunout_m = 1e-5\nrunout_deg = 30.0"
    file.write_text(file.read_text().replace("teeth             =", f"{keys}\nteeth ="))
    cuts = CaseCuts(load_case(file))
    cutter = cuts.milling.cutter
    assert np.rad2deg(cutter.pitch) == pytest.approx([170.0, 190.0])
    assert cutter.runout == 1e-5
    assert cutter.runout_angle == pytest.approx(np.pi / 6.0)
    assert cutter.period == cutter.turn_period


def test_another_process_is_refused(tmp_path):
    with pytest.raises(StabilityError, match="expected 'milling-force'"):
        CaseCuts(load_case("examples/cases/cone.toml"))
    assert stability_in_brief(load_case("examples/cases/cone.toml")) is None


def test_a_path_that_never_cuts_is_refused_by_the_command_and_passed_over_by_others(
    tmp_path, capsys
):
    file = slot(tmp_path)
    file.write_text(file.read_text().replace("-0.002", "0.0005"))
    assert stability_in_brief(load_case(file)) is None
    assert status("stability", file, "-o", tmp_path / "out") == 2
    assert "stays off the stock" in capsys.readouterr().err


def test_a_robot_that_sags_is_judged_as_deep_as_it_cuts(tmp_path):
    """Programmed 0.5 mm, where it sags by 1.5 mm 2 mm, which chatters; vibrations are no depth."""
    case = load_case(slot(tmp_path, 0.0005))
    path = case.desired
    shift = np.zeros((len(path.time), 6))
    shift[:, 2] = -0.0015 + 0.001 * np.sin(2.0 * np.pi * 43.0 * path.time)
    sagging = path.displaced(shift[None])
    as_programmed, sagged = stability_in_brief(case, path), stability_in_brief(case, sagging)
    assert as_programmed is not None
    assert sagged is not None
    assert (as_programmed.stable, sagged.stable) == (True, False)
    assert as_programmed.depth_m == pytest.approx(0.0005, rel=0.02)
    assert sagged.depth_m == pytest.approx(0.002, rel=0.03)
    assert re.search(r"programmed 0.5 mm, (2|2.0\d|1.9\d) mm by a robot", sagged.sentence)
    assert "the programmed 0.5 mm at 3000 1/min" in sagged.alternative
    lifted = path.displaced(np.array([0.0, 0.0, 0.001, 0.0, 0.0, 0.0]))
    assert stability_in_brief(case, lifted) is None


def test_check_ends_with_a_cut_that_chatters(tmp_path, capsys):
    assert status("check", slot(tmp_path), "-o", tmp_path / "check.html") == 1
    said = capsys.readouterr().out
    assert re.search(
        r"do not run it\.\nThe cut chatters at [\d.]+ Hz from depth [\d.]+ mm at 3000 1/min .*"
        " 2 mm deep, as programmed",
        said,
    )
    assert said.count("The cut chatters") == 1
    assert "elastic-robot stability" in said
    assert status("check", slot(tmp_path, 0.0005), "-v", "-o", tmp_path / "check.html") == 0
    said = capsys.readouterr().out
    assert "chatters" not in said
    first_screen, _ = said.split("To the nearest joint limit", 1)
    assert re.search(r"The cut is stable, limit [\d.]+ mm at 3000 1/min", first_screen)
    assert said.count("The cut is stable") == 1
    assert "was not touched off cuts deeper" in said


def test_a_cut_that_chatters_clearly_is_not_computed(tmp_path, capsys, monkeypatch):
    """Its limits are, in a folder that says so to whoever asks it for a command.

    Other commands say so as well: test_every_command.py.
    """
    monkeypatch.setattr("coupling.run.execute._run", None)  # would fail
    folder = tmp_path / "run"
    assert status("compensate", slot(tmp_path), "-o", folder, "--no-store") == 1
    told = capsys.readouterr().out
    assert re.search(r"Warning: The cut chatters at [\d.]+ Hz .*: no command is computed", told)
    assert "This cut will chatter: do not run it. No command was computed." in told
    again = r"elastic-robot compensate \S+slot.toml -o \S+run --despite-chatter --overwrite"
    assert re.search(again, told)
    assert not GLOSSARY.search(told)
    stored = json.loads((folder / "stability.json").read_text())
    assert stored["instead_of"] == ["compensate", str(tmp_path / "slot.toml"), "-o", str(folder)]
    assert stored["chart"]["rpm"]
    page = (folder / "report.html").read_text()
    (folder / "report.html").unlink()
    assert status("report", folder) == 0
    assert (folder / "report.html").read_text() == page
    assert status("export", folder, "--to", "krl") == 2
    assert "no command computed" in capsys.readouterr().err
    # Made shallower, the same command replaces it.
    assert status("compensate", slot(tmp_path), "-o", folder, "--no-store") == 2
    assert "add --overwrite" in capsys.readouterr().err


def test_what_is_short_along_the_path_is_judged_as_well(tmp_path):
    """Of 3000 cuts three are deep and two go across: equal steps of time would pass them over."""
    (cut, *_) = CaseCuts(load_case(slot(tmp_path))).along_path
    along = [replace(cut, time=float(row)) for row in range(3000)]
    for row in (1234, 1235, 1236):
        along[row] = replace(along[row], cut=cut.cut.at_depth(3.0 * cut.cut.depth))
    for row in (77, 78):
        along[row] = replace(along[row], feed=cut.feed + 1.5)
    chosen = [int(each.time) for each in most_different(along, 8)]
    assert chosen == sorted(chosen)
    assert len(chosen) == 8
    assert {1234, 1235, 1236} & set(chosen)
    assert {77, 78} & set(chosen)
    assert len(most_different([cut] * 5, 8)) == 5


def test_a_cut_is_clear_only_if_it_chatters_where_its_force_lifts_the_tool(tmp_path, monkeypatch):
    """2 mm chatter, 1.5 mm do not: a tool that is lifted by more is judged where it will be."""
    case = load_case(slot(tmp_path))
    up = CaseCuts(case).base_from_part[:, 2]

    def is_refused(lift: float) -> bool:
        monkeypatch.setattr(Judgement, "_mean_displacement", lift * up)
        path = PathStability.of(CaseCuts(case), 4)
        assert not path.is_stable
        return path.chatters_clearly

    assert [is_refused(lift) for lift in (-1e-3, 0.0, 1e-4, 5e-4, 3e-3)] == [True] * 3 + [False] * 2


def test_a_cut_that_cannot_be_judged_or_is_stable_is_not_refused(tmp_path):
    refuse_clear_chatter(load_case("examples/cases/cone.toml"), *AS_COUPLE)
    refuse_clear_chatter(load_case(slot(tmp_path, 0.0005)), *AS_COUPLE)
    file = slot(tmp_path)
    file.write_text(file.read_text().replace("[1.6, 0.0, 0.6]", "[9.0, 0.0, 0.6]"))  # out of reach
    refuse_clear_chatter(load_case(file), *AS_COUPLE)


def test_a_run_of_a_cut_ends_with_its_stability(tmp_path, capsys):
    folder, words = tmp_path / "run", ["-v", "--no-store", "--despite-chatter"]
    assert status("couple", slot(tmp_path), *words, "-o", folder) == 1
    verdict = next(line for line in capsys.readouterr().out.splitlines() if "UNSTABLE" in line)
    assert re.search(r": the cut chatters at [\d.]+ Hz from depth [\d.]+ mm at 3000 1/min", verdict)
    assert re.search(
        r"programmed 2 mm, [\d.]+ mm by a robot .* less than 1\.\d+ mm at 3000 1/min, or [\d.]+ mm at",
        verdict,
    )
    assert "the iteration: converged in" in verdict
    stored = json.loads((folder / "result.json").read_text())["stability"]
    assert not stored["stable"]
    assert 1e-3 < stored["limit_m"] < 2e-3


def test_place_optimises_the_stability_of_milling_alone(tmp_path, capsys):
    words = [
        "place",
        "examples/cases/cone.toml",
        "-o",
        tmp_path / "placed",
        "--optimise",
        "stability",
    ]
    assert status(*words) == 2
    assert "expected the process milling-force" in capsys.readouterr().err
