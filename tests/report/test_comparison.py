"""Two runs side by side: figures, commands and inputs that differ; what is refused."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from first_screens import GLOSSARY, words_of
from line_case import line_case
from outlooks import outlook
from scipy.spatial.transform import Rotation

from coupling.case.file import load_case
from coupling.errors import ResultError
from coupling.files.robot_file import find_robot
from coupling.identification.next.history import History
from coupling.identification.next.options import FrameAccuracy
from coupling.identification.runs.measurement import Measurement, read_measurement
from coupling.identification.runs.parameters import factors_between
from coupling.identification.runs.source import read_source
from coupling.path.histories import ToolPath
from coupling.path.length_text import in_words
from coupling.report.compare_answer import comparison_answer
from coupling.report.compare_report import (
    comparison_report,
    comparison_scene,
)
from coupling.report.comparison import Comparison, command_difference
from coupling.report.verdict import verdict
from coupling.run.execute import run_compensation
from coupling.run.fmu_pool import FmuPool
from coupling.run.folder import write_run
from coupling.run.stored_run import read_run

TURN = 1e-3  # [rad]


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> tuple[Path, Path]:
    """A run, and the same with joint 2 turned, another feed and a process at its next version."""
    folder = tmp_path_factory.mktemp("compare")
    case = line_case(
        folder,
        "native",
        ('method = "inverse"', 'method = "inverse"\nmax_rounds = 1'),
        ("feed_m_s = 0.1", "feed_m_s = 0.025"),
    )
    first, second = folder / "first", folder / "second"
    first.mkdir()
    write_run(first, case, run_compensation(case))
    shutil.copytree(first, second)
    text = (second / "case.toml").read_text()
    (second / "case.toml").write_text(text.replace("feed_m_s = 0.025", "feed_m_s = 0.2"))
    rows = (second / "command.csv").read_text().splitlines()
    column = rows[0].split(",").index("q2")
    turned = [rows[0]]
    for row in rows[1:]:
        cells = row.split(",")
        cells[column] = repr(float(cells[column]) + TURN)
        turned.append(",".join(cells))
    (second / "command.csv").write_text("\n".join(turned) + "\n")
    return first, second


def test_what_differs_is_found_and_nothing_else(runs):
    found = Comparison.of(runs)
    assert found.inputs() == [("tool_path.feed_m_s", "0.025", "0.2")]
    ((_, (first, second)),) = found.robots()
    difference = command_difference(first, second)
    assert difference is not None
    others = np.delete(difference.angle, 1, axis=1)
    np.testing.assert_allclose(difference.angle[:, 1], TURN, rtol=1e-9)
    assert not others.any()
    same = Comparison.of(
        [runs[0], shutil.copytree(runs[0], runs[0].with_name("again"), dirs_exist_ok=True)]
    )
    assert same.inputs() == []
    sections = comparison_report(same).content
    assert [part for own in sections for part in own.parts].count("Identical.") == 1


def test_a_file_of_the_robot_that_changed_is_named_and_a_class_stands_in_the_verdict(runs):
    """As if the URDF had changed between two runs, and the gears' stiffness were that of a class."""
    changed = shutil.copytree(runs[0], runs[0].with_name("changed"))
    result = json.loads((changed / "result.json").read_text())
    (robot,) = result["robots"]
    (name,) = robot["files"]
    robot["files"] |= {"arm.urdf": "sha256 0"}
    robot["stiffness_range_Nm_rad"] = [1e5, 3e6]
    (changed / "result.json").write_text(json.dumps(result))
    found = Comparison.of([runs[0], changed])
    assert name.endswith(".toml")
    assert found.inputs() == [("forming robot, file arm.urdf", "-", "sha256 0")]
    said = " ".join(map(str, verdict(found.runs[1].figures, "a wall").parts))
    assert "known as a range (100000 to 3000000 N m/rad)." in said


def test_lines_and_page_tell_both(runs):
    found = Comparison.of(runs)
    figures, first, second, *_, commands, inputs = comparison_report(found).content
    own = json.loads((runs[0] / "result.json").read_text())
    assert (first.title, second.title) == ("How first was computed", "How second was computed")
    after = in_words(own["deviation_after_m"]["maximum"])
    assert ("deviation after, if the file is right, max", after, after) in figures.parts[0].rows
    assert commands.parts[0].startswith(f"Largest difference {np.degrees(TURN):.4g} deg, joint 2")
    assert inputs.parts[0].rows == [("tool_path.feed_m_s", "0.025", "0.2")]
    page = comparison_report(found).page
    assert len(page) < 3_000_000
    for text in (
        "first: after, if the file is right",
        "second: before compensation",
        "tool_path.feed_m_s",
    ):
        assert text in page


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda second: (second / "result.json").unlink(), "cannot be read"),
        (lambda second: (second / "case.toml").unlink(), "key 'process' is missing"),
        (
            lambda second: (second / "case.toml").write_text("[part"),
            "is not valid TOML",
        ),
        (
            lambda second: (second / "result.json").write_text('{"kind": "couple"}'),
            "got damaged ones",
        ),
        (lambda second: (second / "command.csv").write_text("time\n0\n"), "columns"),
        (lambda second: (second / "gap.csv").write_text("time,before,after\n0,0,0\n"), "robots"),
    ],
)
def test_what_is_no_run_is_refused_in_one_sentence(runs, tmp_path, command, spoil, told):
    second = shutil.copytree(runs[1], tmp_path / "second")
    spoil(second)
    done = command("compare", runs[0], second, "-o", tmp_path / "page.html")
    said = done.stderr
    assert done.returncode == 2
    assert said.startswith("error: ")
    assert str(second) in said
    assert told in said
    assert "Traceback" not in said
    assert not (tmp_path / "page.html").exists()


@pytest.fixture(scope="module")
def measured(runs) -> tuple[Path, Path]:
    """Paths measured under both runs, 30 ms late, shifted; 0.1 and 0.05 mm beside the desired ones."""
    files = []
    for folder, size in zip(runs, (1e-4, 5e-5), strict=True):
        stored = read_run(folder).first
        time = stored.achieved.time
        away = size * np.sin(2.0 * np.pi * time / time[-1])[:, None] * [0.0, 0.0, 1.0]
        position = stored.desired.position[0] + away + [1e-3, 0.0, -1e-3]
        file = folder.with_name(f"{folder.name}.csv")
        rows = np.column_stack([time + 0.03, position])
        np.savetxt(file, rows, delimiter=",", header="time,x,y,z", comments="")
        files.append(file)
    return files[0], files[1]


def test_any_number_of_runs_and_what_was_measured_are_in_one_scene(runs, measured, tmp_path):
    third = shutil.copytree(runs[0], tmp_path / "third")
    places = [runs[0], measured[0], runs[1], measured[1], third]
    found = Comparison.of(places)
    names = [track.name for track in comparison_scene(found).tracks]
    assert names == [
        "first: before compensation",
        "third: after, if the file is right",
        "first: after, if the file is right",
        "first: measured",
        "second: after, if the file is right",
        "second: measured",
    ]
    *_, last = [track for track in comparison_scene(found).tracks if "measured" in track.name]
    assert np.linalg.norm(last.deviation, axis=1).max() == pytest.approx(5e-5, rel=0.05)
    assert found.measured[0].run.clock == pytest.approx(-0.03, abs=2e-3)
    assert "third: after, if the file is right" in comparison_report(found).page
    assert len(comparison_report(found).content[1].parts[0].columns) == 4


def test_what_is_expected_on_the_real_robot_is_drawn_and_the_file_s_robot_by_its_name(runs):
    """As the figures beside the picture: 0.3 mm are to be expected on the second run's real robot."""
    found = Comparison.of(runs)
    second = found.runs[1]
    stored = second.first
    away = stored.desired.displaced(np.array([0.0, 0.0, 3e-4, 0.0, 0.0, 0.0]))
    expected = replace(second, robots={stored_name(second): replace(stored, expected=away)})
    compared = replace(found, runs=(found.runs[0], expected))
    tracks = {track.name: track for track in comparison_scene(compared).tracks}
    assert list(tracks) == [
        "first: before compensation",
        "second: on a robot to be expected",
        "first: after, if the file is right",
    ]
    deviation = np.linalg.norm(tracks["second: on a robot to be expected"].deviation, axis=1)
    np.testing.assert_allclose(deviation, 3e-4, rtol=1e-9)
    figure = next(
        figure
        for section in comparison_report(compared).content
        if section.name == "deviation"
        for figure in section.figures
    )
    seen = {curve.name: curve.visible for curve in figure.data}
    assert seen["second: on a robot to be expected"] is True
    assert seen["second: after, if the file is right"] == "legendonly"


def stored_name(run) -> str:
    (name,) = run.robots
    return str(name)


def test_what_was_measured_decides_which_run_is_best(runs, measured):
    """The second run is measured to be better; without measurements the models of both are alike."""
    answer = comparison_answer(Comparison.of([runs[0], measured[0], runs[1], measured[1]]))
    assert answer.sentence.startswith("Of 2 runs second leaves least, up to")
    assert "measured" in answer.sentence
    history = ["uncorrected", "first, measured", "second, measured"]
    assert re.findall(r'text-anchor="end">([^<]*)', answer.picture)[: len(history)] == history
    words = answer.steps[0].command.split()
    assert words[:2] == ["elastic-robot", "next"]
    assert [Path(word).name for word in words[2:6]] == [
        "first",
        "first.csv",
        "second",
        "second.csv",
    ]
    assert not GLOSSARY.search(words_of(answer))


def test_a_run_that_is_expected_to_leave_less_than_what_was_measured_is_to_be_measured(
    runs, measured
):
    """The first run was measured to leave 98 um; the second is expected to leave 10 um."""
    found = Comparison.of([runs[0], measured[0], runs[1]])
    better = {"outlook": outlook(("backlash -20 %", 1e-5, 1e-5))}
    second = replace(found.runs[1], figures=found.runs[1].figures.model_copy(update=better))
    answer = comparison_answer(replace(found, runs=(found.runs[0], second)))
    assert answer.sentence.startswith("Of what was measured first leaves least, up to")
    assert "second is to leave" in answer.sentence
    step = answer.steps[-1]
    assert step.words == "Run second and measure it as well:"
    assert step.command.split()[1] == "export"


def test_a_best_run_that_a_shift_of_the_part_would_beat_says_so_first(runs):
    found = Comparison.of(runs)
    shaken = {"outlook": outlook(("damping -20 %", 1e-3, 9e-4))}
    worse = tuple(replace(run, figures=run.figures.model_copy(update=shaken)) for run in found.runs)
    answer = comparison_answer(replace(found, runs=worse))
    assert "TOUCHING OFF ALONE DOES BETTER" in answer.sentence
    assert answer.good is False
    assert not any("export" in step.command for step in answer.steps)


def test_a_measured_path_without_its_run_is_refused(runs, measured):
    for places, told in (
        ([measured[0], runs[0]], "expected a run folder first"),
        ([runs[0], measured[0], measured[1]], "expected one measured path behind"),
        ([runs[0]], "expected another run, or a measured path"),
    ):
        with pytest.raises(ResultError, match=told):
            Comparison.of(places)


def test_a_run_beside_itself_is_refused(runs):
    with pytest.raises(ResultError, match="expected another run than those before"):
        Comparison.of([runs[0], runs[0] / ".." / runs[0].name])


def test_an_index_has_picture_verdict_and_link_of_every_result(runs, measured, tmp_path, command):
    """Of two runs, one of them in a folder below; a damaged one is named, not skipped."""
    shutil.copytree(runs[0], tmp_path / "first")
    shutil.copytree(runs[1], tmp_path / "of today" / "second")
    damaged = shutil.copytree(runs[1], tmp_path / "damaged")
    (damaged / "result.json").write_text("{")
    (tmp_path / "of today" / "second" / "report.html").write_text("")
    (tmp_path / "notes").mkdir()
    command(
        "modes", "icme2008", "--posture-deg", "0,10,20,0,60,0", "-o", tmp_path / "soft", exits=0
    )
    (tmp_path / "third.unfinished").mkdir()
    (tmp_path / "first" / f"report.html.{'a' * 32}.partial").write_text("half")
    command("report", tmp_path, exits=0)
    page = (tmp_path / "index.html").read_text()
    assert page.count('<article class="card">') == 4
    assert page.count("<svg") == 3
    assert "third.unfinished: a command is at work there, or was stopped" in page
    assert "the slowest vibration has" in page
    assert 'href="of%20today/second/report.html"' in page
    assert "Cannot be read:" in page
    assert "is not valid JSON" in page
    assert len(page) < 300_000
    for name in ("elastic-robot compare", "of today/second", "are good enough"):
        assert name in page
    assert re.search(r"first: [\w-]+, (couple|compensate)</", page)
    assert "Other pages" not in page
    (tmp_path / "soft" / "other.html").write_text("<title>by others</title>")
    title = '<meta name="generator" content="elastic-robot">'
    (tmp_path / "soft" / "a b.html").write_text(f"<title>plan &lt;1&gt;</title>{title}")
    command("report", tmp_path, exits=0)
    page = (tmp_path / "index.html").read_text()
    assert '<a href="soft/a%20b.html">plan &lt;1&gt;</a>' in page
    assert "by others" not in page
    figures = tmp_path / "soft" / "modes.json"
    written, text = (tmp_path / "soft" / "report.html").read_bytes(), figures.read_text()
    figures.write_text(text.replace('"angles_rad": [', '"angles_rad": [\n 0.0,'))
    damaged = command("report", tmp_path / "soft", exits=2)
    assert "modes.json: expected the modes of a robot, got damaged ones" in damaged.stderr
    figures.write_text(text)
    command("report", tmp_path / "soft", exits=0)
    assert (tmp_path / "soft" / "report.html").read_bytes() == written
    nothing = command("report", tmp_path / "notes", exits=2)
    assert "expected a result or a folder of results" in nothing.stderr


def test_what_was_measured_is_as_large_as_next_says(runs, tmp_path):
    """Of a robot whose gears are half as stiff, in a frame of its own: fitted to the last run's robot.

    The file's robot explains less of it, and the device's turn takes it for its own.
    """
    text = find_robot("icme2008").read_text()
    soft_text, count = re.subn(r"(?m)^stiffness = 17188733\.\d+", "stiffness = 8.6e6", text)
    assert count > 1
    (tmp_path / "soft.toml").write_text(soft_text)
    last = shutil.copytree(runs[0], tmp_path / "last")
    case = (last / "case.toml").read_text()
    (last / "case.toml").write_text(case.replace('"icme2008"', f'"{tmp_path / "soft.toml"}"'))
    soft = load_case(last / "case.toml").robots[0].description
    file = tmp_path / "measured.csv"
    with FmuPool("native") as models:
        source = read_source(runs[0], _written(file, read_run(runs[0]).first.achieved))
        fmu = models.of(soft, source.torque_curve, source.drive).fmu
        path = fmu.simulate(source.stored.joints, source.stored.wrench, "dynamic")
        turn, shift = Rotation.from_rotvec([0.0, 0.0, 2e-4]), np.array([1e-3, 0.0, 0.0])
        turned = np.hstack([turn.apply(path.position[0]) + shift, path.pose[0][:, 3:]])
        measured = _written(file, ToolPath(path.time, turned).transformed(source.world_from_base))
        history = History.of([read_source(runs[0], measured)], FrameAccuracy(), models)
        of_soft = history.aligned_with(factors_between(history.parameters, soft)).runs[0].size
        of_file = history.runs[0].size
    assert abs(of_file.maximum - of_soft.maximum) > 0.01 * of_soft.maximum
    known, unknown = (
        Comparison.of([runs[0], file, *others]).measured[0].run.size for others in ([last], [])
    )
    assert known.maximum == pytest.approx(of_soft.maximum, rel=1e-3)
    assert unknown.maximum == pytest.approx(of_file.maximum, rel=1e-3)


def _written(file: Path, path: ToolPath) -> Measurement:
    rows = np.column_stack([path.time, path.position[0]])
    np.savetxt(file, rows, delimiter=",", header="time,x,y,z", comments="", fmt="%.12g")
    return read_measurement(file)
