"""From measured runs to the next command, as a user does it, on robots that the model is not."""

from __future__ import annotations

import json
import shutil
import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from line_case import changed_text
from measured_robot import Chain, Extras, MeasuredRobot
from places import CASES
from replay_robot import Robot as ReplayedRobot
from replay_robot import Settings
from scipy.spatial.transform import Rotation

from coupling.cli.device_accuracy import device_accuracy, frame_of
from coupling.errors import LearnError
from coupling.files.atomic_folder import exclusively
from coupling.files.csv_table import read_table
from coupling.files.robot_file import find_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.identification.next import command as next_command
from coupling.identification.next.command_model import file_model
from coupling.identification.next.figures import clock_sentence, frame_sentence
from coupling.identification.next.history import History
from coupling.identification.next.inputs import inputs_folder
from coupling.identification.next.options import FrameAccuracy, NextOptions
from coupling.identification.runs.measurement import read_measurement
from coupling.identification.runs.source import read_source

EXTRAS = Extras(hysteresis=3e-5, drift=5e-5, gear_errors=7e-5)
# Factors of what the hidden robot's stiffness, backlash and damping are.
HIDDEN = {"stiffness": 0.9, "backlash": 1.15, "damping": 0.8}


@pytest.fixture(scope="module")
def shop(tmp_path_factory, example):
    """A small contour of the cone, and a robot that goes where its FMU and more go."""
    from command_line import command as program

    folder = tmp_path_factory.mktemp("next")
    text = changed_text(
        CASES / "cone.toml",
        ("radius_m       = 0.06", "radius_m       = 0.03"),
        ("depth_m        = 0.01", "depth_m        = 0.0005"),
    )
    (folder / "case.toml").write_text(text)
    program("compensate", folder / "case.toml", "-o", folder / "first", exits=0)
    file = build_fmu(example, folder / "true.fmu", BuildOptions("native"))
    chain = Chain.read(find_robot("icme2008"))
    robot = MeasuredRobot(ReplayedRobot(file), chain, Settings(scale=HIDDEN), EXTRAS)
    return folder, robot


@pytest.fixture(scope="module")
def measured(shop):
    """Three commands, each computed from what was measured under those before, along the path alone."""
    from command_line import command as program

    folder, robot = shop
    arguments, left, said, runs = [], [], [], ["first", "second", "third"]
    for number, name in enumerate(runs):
        left.append(robot.measure(folder / name, folder / f"m{number}.csv", number).rms())
        arguments += [folder / name, folder / f"m{number}.csv"]
        if name != runs[-1]:
            out = folder / runs[number + 1]
            done = program("mirror", *arguments, "-o", out, "--frame-known", "0.01mm", exits=0)
            said.append(done.stdout)
    return runs, left, said


def test_no_run_is_worse_and_each_is_as_forecast(shop, measured, command):
    """A robot with hysteresis, drift, gear errors and other parameters, learned along the path.

    A quarter is left at once, two thirds of that next, and forecasts hold what is measured."""
    folder, _ = shop
    runs, left, said = measured
    assert "\nExpect the tool within at most about" in said[0]
    assert "The last run left" in said[1]
    assert left[0] > 1e-4
    assert left[1] < 0.25 * left[0]
    assert left[2] < 0.7 * left[1]
    for name, own in zip(runs[1:], left[1:], strict=True):
        told = json.loads((folder / name / "result.json").read_text())["forecast"]
        assert told["low"] < own < told["high"]
    # What is expected of robots of the file is not computed only to be left out.
    for run, is_drawn in (("first", True), ("third", False)):
        state = json.loads((folder / run / "run.json").read_text())
        assert ("drawn" in state["durations_s"]) == is_drawn
    page = (folder / "third" / "report.html").read_text()
    assert "Measured under the last command" in page
    assert "Expected deviation on a real robot" not in page
    # It says which case, and where the command stands that goes on from all runs.
    assert f"<title>{folder.name}: compensate</title>" in page
    assert "third_inputs/next.html" in page
    assert "elastic-robot next" not in page
    told = json.loads((folder / "third_inputs" / "next.json").read_text())
    assert told["move"] == "path"
    assert len(told["runs"]) == 2
    assert told["forecast"]["rms"] > 0.0
    assert told["runs"][1]["forecast"]["rms"] > 0.0
    page = (folder / "third_inputs" / "next.html").read_text()
    assert "What was measured" in page
    assert f"<title>{folder.name}, from " in page
    assert "run 2, measured: up to" in page  # a still of the tool in space
    # What is commanded is a run like any other.
    for arguments in (
        ("export", folder / "third", "--to", "csv"),
        ("compare", folder / "first", folder / "third", "-o", folder / "compare.html"),
    ):
        command(*arguments, exits=0)


def test_the_desired_path_stays_and_the_command_is_moved_against_the_deviation(shop, measured):
    folder, _ = shop
    names = ("time", "x", "y", "z")
    first, second = (
        read_table(folder / run / "desired.csv", names, AssertionError)
        for run in ("first", "second")
    )
    np.testing.assert_allclose(second, first, atol=1e-12)
    case = tomllib.loads((folder / "second" / "case.toml").read_text())
    beyond = read_table(
        folder / "second_inputs" / "discrepancy.csv", ("time", "dx", "dy", "dz"), AssertionError
    )
    assert case["discrepancy"]["file"].endswith("discrepancy.csv")
    commands = [
        read_table(folder / run / "command.csv", names, AssertionError)
        for run in ("first", "second")
    ]
    moved = commands[1][:, 1:] - commands[0][:, 1:]
    wanted = np.stack(
        [-np.interp(commands[0][:, 0], beyond[:, 0], column) for column in beyond[:, 1:].T], axis=1
    )
    # Gears that cross their backlash elsewhere jump; in the mean the undeflected tool moves against it.
    np.testing.assert_allclose(np.median(moved, axis=0), np.median(wanted, axis=0), atol=2e-5)


def test_frame_and_clock_are_the_devices_or_the_robots(shop, models, tmp_path):
    """0.3 mm and 8 ms: of a frame known to 0.01 mm the shift is the robot's, else the device's."""
    folder, robot = shop
    own = MeasuredRobot(robot.fmu, robot.chain, Settings(), Extras())
    own.measure(folder / "first", tmp_path / "m.csv")
    rows = np.loadtxt(tmp_path / "m.csv", delimiter=",", skiprows=1)
    for late, clock in ((0.008, -0.008), (0.001, 0.0)):
        moved = rows + np.array([late, 3e-4, 0.0, 0.0])
        np.savetxt(tmp_path / "n.csv", moved, delimiter=",", header="time,x,y,z", comments="")
        source = read_source(folder / "first", read_measurement(tmp_path / "n.csv"))
        for known, share in ((FrameAccuracy(1e-5, 1e-5), 0.0), (FrameAccuracy(), 1.0)):
            run = History.of([source], known, models).runs[0]
            assert run.clock == pytest.approx(clock, abs=2e-4)
            told = clock_sentence(run)
            assert (
                ("-8 ms" in told and "50.0 um along the path per ms at up to 0.05 m/s" in told)
                if clock
                else told == ""
            )
            assert frame_sentence(run, known) == ""
            assert run.shift[0] == pytest.approx(share * 3e-4, abs=2e-5)
            assert run.deviation.mean(axis=0)[0] == pytest.approx((1.0 - share) * 3e-4, abs=2e-5)
    # On the command's clock a robot is late by more than a cycle as well: 0.4 mm at 50 mm/s.
    moved = rows + np.array([0.008, 0.0, 0.0, 0.0])
    np.savetxt(tmp_path / "n.csv", moved, delimiter=",", header="time,x,y,z", comments="")
    source = read_source(folder / "first", read_measurement(tmp_path / "n.csv"))
    known = device_accuracy("0.01mm", False, None, clock_known=True)
    run = History.of([source], known, models).runs[0]
    assert run.clock == 0.0
    assert run.size.maximum == pytest.approx(4e-4, rel=0.1)


def test_a_frame_that_is_not_where_it_is_said_to_be_is_doubted(shop, models, tmp_path):
    """Turned by 1 mrad about the robot's base, a metre and a half away, but said to be known."""
    folder, robot = shop
    own = MeasuredRobot(robot.fmu, robot.chain, Settings(), Extras())
    own.measure(folder / "first", tmp_path / "m.csv")
    rows = np.loadtxt(tmp_path / "m.csv", delimiter=",", skiprows=1)
    turned = Rotation.from_rotvec([0.0, 1e-3, 1e-3]).apply(rows[:, 1:])
    table = np.column_stack([rows[:, 0], turned])
    np.savetxt(tmp_path / "n.csv", table, delimiter=",", header="time,x,y,z", comments="")
    source = read_source(folder / "first", read_measurement(tmp_path / "n.csv"))
    for known, words in ((frame_of("0.05mm"), "known to 0.05 mm"), (FrameAccuracy(), "")):
        (run,) = History.of([source], known, models).runs
        said = frame_sentence(run, known)
        assert words in said
        assert bool(words) is bool(said)
    off = (turned - rows[:, 1:]).mean(axis=0)
    assert np.abs(off).max() > 1.5e-3
    np.testing.assert_allclose(run.offset, off, atol=2e-5)


def test_the_device_has_no_share_of_what_parameters_explain(shop, models, tmp_path, monkeypatch):
    """A soft robot, and a frame known as badly as robots are: half of the sag is not the device's."""

    def known(history, learned, options):
        x = np.log([0.8 if own.kind == "stiffness" else 1.0 for own in history.parameters])
        return replace(file_model(history, options), name="known", x=x, run_count=1)

    folder, robot = shop
    soft = MeasuredRobot(robot.fmu, robot.chain, Settings(scale={"stiffness": 0.8}), Extras())
    moved = soft.measure(folder / "first", tmp_path / "m.csv")
    source = read_source(folder / "first", read_measurement(tmp_path / "m.csv"))
    not_refused = SimpleNamespace(result=SimpleNamespace(refusal=""), robot=source.robot)
    monkeypatch.setattr(next_command, "_learn", lambda *_: not_refused)
    monkeypatch.setattr(next_command, "learned_model", known)
    found = next_command.plan([source], NextOptions(FrameAccuracy(5e-4, 5e-4)), models)
    sag = np.linalg.norm(moved.deviation.mean(axis=0))
    assert sag > 1e-4
    assert found.model.name == "known"
    assert (
        np.linalg.norm(found.history.unmodelled(0, found.model.x)[:, :3].mean(axis=0)) < 0.02 * sag
    )
    assert np.linalg.norm(found.history.runs[0].shift) < 0.02 * sag


def test_a_tool_that_vibrates_is_not_lost_by_a_slow_device(shop, models, tmp_path):
    """0.7 mm at 9 Hz in 83 rows a second; 1 % of rows 5 mm beside it are outliers all the same."""
    folder, robot = shop
    own = MeasuredRobot(robot.fmu, robot.chain, Settings(), Extras())
    own.measure(folder / "first", tmp_path / "m.csv")
    rows = np.loadtxt(tmp_path / "m.csv", delimiter=",", skiprows=1)[::3]
    rows[:, 3] += 7e-4 * np.sin(2.0 * np.pi * 9.0 * rows[:, 0])
    rows[50::100, 2] += 5e-3
    np.savetxt(tmp_path / "n.csv", rows, delimiter=",", header="time,x,y,z", comments="")
    source = read_source(folder / "first", read_measurement(tmp_path / "n.csv"))
    (run,) = History.of([source], FrameAccuracy(), models).runs
    assert run.left_out == len(rows[50::100])


def test_what_was_measured_under_another_command_is_refused(shop, measured, models, tmp_path):
    """The rows of the first run given twice, its command measured again, and runs exchanged."""
    folder, robot = shop
    robot.measure(folder / "first", tmp_path / "again.csv", 7)
    first, second = folder / "m0.csv", folder / "m1.csv"
    for files, words in (
        ((first, first), "got the rows of m0.csv"),
        ((first, tmp_path / "again.csv"), "are both of one run"),
        ((second, first), "are they exchanged"),
    ):
        sources = [
            read_source(folder / run, read_measurement(file))
            for run, file in zip(("first", "second"), files, strict=True)
        ]
        with pytest.raises(LearnError, match=words):
            next_command.plan(sources, NextOptions(FrameAccuracy(1e-5, 1e-5), "path"), models)
    once_more = [
        read_source(folder / "first", read_measurement(file))
        for file in (first, tmp_path / "again.csv")
    ]
    assert next_command.plan(once_more, NextOptions(FrameAccuracy(), "path"), models).correction


@pytest.mark.parametrize(
    "text", ["0.05", "mm", "-1mm", "0.05mm,1", "1mm,1mrad,3", "1mm,nanrad", "0mm"]
)
def test_a_frame_is_known_to_a_length_and_an_angle(text):
    with pytest.raises(LearnError, match="a length and an angle"):
        frame_of(text)


def test_the_command_refuses_in_one_sentence(shop, command, tmp_path):
    folder, robot = shop
    robot.measure(folder / "first", tmp_path / "m.csv")
    other = tmp_path / "other"
    shutil.copytree(folder / "first", other)
    desired = read_table(other / "desired.csv", ("time", "x"), AssertionError)
    text = (other / "desired.csv").read_text().splitlines()
    names = text[0].split(",")
    at = names.index("z")
    lifted = [
        ",".join(v if k != at else str(float(v) + 1e-3) for k, v in enumerate(line.split(",")))
        for line in text[1:]
    ]
    (other / "desired.csv").write_text("\n".join([text[0], *lifted]) + "\n")
    assert len(desired) == len(lifted)
    run, seen = folder / "first", tmp_path / "m.csv"
    out = tmp_path / "out"
    for arguments, words in (
        ([run], "pairs of a run folder"),
        ([run, seen, "--move", "luck"], "one of auto"),
        ([run, seen, "--own-frame", "--frame-known", "1mm"], "got both"),
        ([run, seen, "--cutoff-Hz", "30", "--move", "path"], "expected at most"),
        ([run, seen, "--cutoff-Hz", "nan"], "0.01 Hz or more"),
        ([run, seen, "--repeatability", "0.05"], "--repeatability: expected a length, as 0.05mm"),
        ([run, seen, other, seen, "--move", "path"], "another one"),
        ([tmp_path, seen], "result.json"),
        ([run, tmp_path / "none.csv"], "cannot be read"),
    ):
        done = command("next", *arguments, "-o", out, exits=2)
        assert words in done.stderr, done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
    done = command("next", run, seen, "-o", run, exits=2)
    with exclusively(inputs_folder(out), LearnError):
        done = command("next", run, seen, "-o", out)
    assert done.returncode == 2
    assert "another command writes it" in done.stderr
    assert not out.exists()


def test_a_probes_tip_is_found_where_the_tool_turns(models, tmp_path):
    """0.4 mm off in the axes of a tool that leans by 10 degrees along a contour: found to 10 um."""
    from command_line import command as program

    text = changed_text(
        CASES / "cone.toml",
        ("radius_m       = 0.06", 'radius_m       = 0.015\ntilt_frame = "path"\nlean_deg = 10.0'),
        ("depth_m        = 0.01", "depth_m        = 0.0005"),
    )
    (tmp_path / "case.toml").write_text(text)
    program("compensate", tmp_path / "case.toml", "-o", tmp_path / "first", exits=0)
    names = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")
    rows = read_table(tmp_path / "first" / "achieved.csv", names, AssertionError)
    tip = np.array([4e-4, -2e-4, 1e-4])
    seen = rows[:, 1:4] + Rotation.from_quat(rows[:, 4:]).apply(tip)
    table = np.column_stack([rows[:, 0], seen])
    np.savetxt(tmp_path / "m.csv", table, delimiter=",", header="time,x,y,z", comments="")
    found = {}
    source = read_source(tmp_path / "first", read_measurement(tmp_path / "m.csv"))
    for size in (0.0, 0.02):
        known = FrameAccuracy(1e-5, 1e-5, size)
        found[size] = History.of([source], known, models).runs[0]
    np.testing.assert_allclose(found[0.02].tip, tip, atol=1e-5)
    assert found[0.02].size.rms < 1e-5
    assert found[0.0].size.rms > 1e-4
