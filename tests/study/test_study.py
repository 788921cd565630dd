"""`elastic-robot study` as a user types it: killed, grown, refused, distributed."""

from __future__ import annotations

import json
import os
import random
import signal
import time

import numpy as np
import psutil
import pytest
from command_line import command
from studies import CHOSEN, SAMPLES, children, moving, rows, started, tables, wait_for_rows
from tuned_fmu import simulate_tuned

from coupling.case.file import load_case
from coupling.errors import StudyError
from coupling.files.csv_table import read_table
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.path.deviation import measure
from coupling.path.length_text import in_words
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.stored_run import read_run
from coupling.study.conduct import changed_table, open_study

pytest.importorskip("distributed")


def test_a_study_killed_again_and_again_ends_with_the_same_bytes(case, run, undisturbed, tmp_path):
    """kill -9 after a random number of samples or before the first one; nothing is simulated twice."""
    random_ = random.Random(14)
    folder = tmp_path / "study"
    options = (case, "--run", run, "--samples", SAMPLES, "--workers")
    kept = []
    for workers in (2, 1):  # on Dask's cluster, and by the command itself
        running = started(*options, workers, folder=folder)
        wait_for_rows(running, folder, rows(folder) + random_.randrange(9))
        time.sleep(random_.random() * 0.02)
        below = children(running.process.pid, "python")
        running.kill()
        kept.append(rows(folder))
        deadline = time.time() + 20.0
        while any(map(psutil.pid_exists, below)) and time.time() < deadline:
            time.sleep(0.01)
        assert not any(map(psutil.pid_exists, below)), "a killed study leaves processes"
    assert kept == sorted(kept)
    assert 0 < kept[-1] < SAMPLES, kept
    last = started(*options, 1, folder=folder)
    assert last.status() == 0, last.output.read_text()
    assert tables(folder) == tables(undisturbed)
    assert rows(folder) == SAMPLES


def test_a_killed_worker_and_a_killed_robot_cost_their_task_alone(case, run, undisturbed, tmp_path):
    folder = tmp_path / "study"
    options = (case, "--run", run, "--samples", SAMPLES, "--workers", 2)
    running = started(*options, folder=folder)
    wait_for_rows(running, folder, 2)
    worker, other = children(running.process.pid, "spawn_main")
    (robot,) = children(other, "worker_main")
    for victim, count in ((worker, 6), (robot, 16)):
        wait_for_rows(running, folder, count)
        assert running.process.is_alive()
        os.kill(victim, signal.SIGKILL)
    assert running.status() == 0, running.output.read_text()
    assert tables(folder) == tables(undisturbed)


def test_every_row_is_the_command_on_a_robot_changed_by_hand(
    case, run, undisturbed, example, tmp_path
):
    """Parameters from samples.csv, set one by one in an FMU built here; to 1e-12 m."""
    names = ("stiffness_factor", "damping_factor", "backlash_factor", "force_factor")
    table = read_table(
        undisturbed / "samples.csv", ("sample", *names, "maximum", "rms"), StudyError
    )
    assert np.array_equal(table[:, 0], np.arange(SAMPLES))
    low, high = [0.98, 0.8, 0.8, 0.95], [1.02, 1.2, 1.2, 1.05]
    assert np.all((table[:, 1:5] >= low) & (table[:, 1:5] <= high))
    # Sobol's points: one in each of as many parts of a range.
    ranges = np.array(high) - low
    assert np.all(np.ptp(table[:, 1:5], axis=0) > (1.0 - 2.0 / SAMPLES) * ranges)
    stored = read_run(run).first
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("native"))
    with RobotFmu(file, "backlash") as fmu:
        for row in table[::10]:
            changed = {}
            for i, joint in enumerate(example.joints, start=1):
                if joint.stiffness is None:
                    continue
                for key, factor in zip(("stiffness", "damping", "backlash"), row[1:4], strict=True):
                    changed[f"joint[{i}].{key}"] = factor * getattr(joint, key)
                    if key != "backlash":
                        for k, tilt in enumerate(joint.tilt, start=1):
                            name = f"joint[{i}].tilt[{k}].{key}"
                            changed[name] = factor * getattr(tilt, key)
            wrench = stored.wrench.scaled(row[4])
            path = simulate_tuned(fmu, stored.joints, wrench, "dynamic", changed)
            found = measure(path, stored.desired)
            assert (found.maximum, found.rms) == pytest.approx(tuple(row[5:7]), abs=1e-12)


def test_another_study_in_the_folder_is_refused_and_nothing_is_lost(
    case, run, undisturbed, tmp_path
):
    before = tables(undisturbed)
    options = ("-o", undisturbed, "--run", run, "--samples", SAMPLES)
    faster = tmp_path / "faster"
    faster.mkdir()
    other_case = moving(tmp_path, "[study]\nstiffness_factor = [0.9, 1.1]\n")
    for arguments, words in (
        ((case, *options, "--seed", 2), "differs in seed"),
        ((case, *options, "--couple"), "differs in couple"),
        ((other_case, *options), "differs in parameters.stiffness_factor"),
        ((moving(faster, CHOSEN, feed="0.03"), *options), "differs in tool_path.feed_m_s"),
    ):
        done = command("study", *arguments, exits=2)
        assert words in " ".join(done.stderr.split())
    assert tables(undisturbed) == before


def test_a_latin_hypercube_does_not_grow(run, tmp_path):
    file = moving(tmp_path, '[study]\ndesign = "latin-hypercube"\nforce_factor = [0.9, 1.1]\n')
    case = load_case(file)
    few, more = (changed_table(case.study, samples=samples) for samples in (20, 40))
    for _ in range(2):
        assert len(open_study(tmp_path, case, few, run, couple=False).points) == 20
    with pytest.raises(StudyError, match="differs in samples"):
        open_study(tmp_path, case, more, run, couple=False)


def test_two_studies_at_once_are_refused_and_an_interrupt_says_what_is_kept(case, run, tmp_path):
    folder = tmp_path / "study"
    running = started(case, "--run", run, "--samples", 2000, "--workers", 1, folder=folder)
    wait_for_rows(running, folder, 1)
    done = command("study", case, "-o", folder, "--run", run, "--samples", 2000)
    running.send(signal.SIGINT)
    assert running.status() == 130
    said = running.output.read_text()
    assert done.returncode == 2
    assert "another study works in it" in done.stderr
    assert "stopped; " in said
    assert f"{rows(folder)} of 2000 samples are kept: the same command continues" in said
    assert "Traceback" not in said


def test_a_study_of_another_version_does_not_go_on(case, run, tmp_path, monkeypatch):
    loaded = load_case(case)
    table = changed_table(loaded.study, samples=20)
    open_study(tmp_path, loaded, table, run, couple=False)
    monkeypatch.setattr("elastic_robot.__version__", "0.0.1")
    with pytest.raises(StudyError, match="holds a study that differs in version"):
        open_study(tmp_path, loaded, table, run, couple=False)


def test_report_and_figures_tell_the_same(undisturbed):
    figures = json.loads((undisturbed / "study.json").read_text())
    table = read_table(undisturbed / "samples.csv", ("maximum",), StudyError)[:, 0]
    limit = figures["quantiles_m"]["maximum"]["0.95"]
    assert np.mean(table <= limit) == pytest.approx(0.95, abs=1.0 / SAMPLES)
    written = (undisturbed / "report.html").read_bytes()
    command("report", undisturbed, exits=0)
    page = (undisturbed / "report.html").read_text(encoding="utf-8")
    assert page.encode() == written
    assert "Of the robots that differ in stiffness and damping and backlash" in page
    assert f"95 % stay within {in_words(limit)}" in page
    assert [entry["name"] for entry in figures["parameters"]] == [
        "stiffness_factor",
        "damping_factor",
        "backlash_factor",
        "force_factor",
    ]
    band = read_table(undisturbed / "bands.csv", ("low", "median", "high"), StudyError)
    assert np.all(np.diff(band, axis=1) >= 0.0)


def test_a_coupling_is_no_command_to_study(case, tmp_path):
    command("couple", case, "-o", tmp_path / "run", exits=0)
    done = command("study", case, "-o", tmp_path / "study", "--run", tmp_path / "run", exits=2)
    assert "expected a run of compensate, got one of couple" in " ".join(done.stderr.split())


def test_a_bad_number_of_samples_leaves_no_folder(case, tmp_path):
    done = command("study", case, "-o", tmp_path / "study", "--samples", 0, exits=2)
    assert "samples: expected a number greater than or equal to 1, got 0" in done.stderr
    assert not (tmp_path / "study").exists()


def test_a_folder_of_something_else_is_left_alone(case, run, tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    done = command("study", case, "-o", tmp_path, "--run", run, "--overwrite", exits=2)
    assert "holds files that are not a study (letter.txt)" in " ".join(done.stderr.split())
    assert (tmp_path / "letter.txt").read_text() == "dear"
