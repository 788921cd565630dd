"""`elastic-robot study` as a user types it: killed, grown, refused, distributed."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil
import pytest
from command_line import command
from killing import wait_until
from line_case import moving_line
from places import LINE_CASE
from studies import children, rows, started, tables, wait_for_rows
from tuned_fmu import simulate_tuned

from coupling.case.file import load_case
from coupling.case.plant import Distribution
from coupling.errors import CaseError, StudyError
from coupling.events import unwatched
from coupling.files.csv_table import read_table
from coupling.files.robot_file import find_robot, load_robot
from coupling.files.written_files import LIST, begin_folder, claim_file
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.path.deviation import measure
from coupling.report.lengths import in_words
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.execute import run_compensation
from coupling.run.plant import PLANT_REPLAY
from coupling.run.stored_run import read_run
from coupling.store import Store
from coupling.study.cluster import _client, _require_same, _version
from coupling.study.conduct import changed_table, open_study
from coupling.study.folder import lock_folder
from coupling.study.parameters import StudyParameter, StudyParameters
from coupling.study.workers import Workers
from elastic_robot import __version__

pytest.importorskip("distributed")

SAMPLES = 32


def moving(folder: Path, more: str = "", feed: str = "0.02") -> Path:
    """The small case, slow, on the moving robot with backlash by method inverse."""
    text = moving_line(("feed_m_s = 0.1", f"feed_m_s = {feed}"))
    file = folder / "stroke.toml"
    file.write_text(f"{text}\n{more}")
    return file


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Path:
    return moving(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def run(case, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "run"
    done = command("compensate", case, "-o", folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def undisturbed(case, run, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed") / "study"
    options = ("-v", "--run", run, "--samples", SAMPLES, "--workers", 1)
    done = command("study", case, "-o", folder, *options)
    assert done.returncode == 0, done.stderr + done.stdout
    assert f"on {SAMPLES} robots with sampled" in done.stdout
    return folder


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
        ((moving(faster, feed="0.03"), *options), "differs in tool_path.feed_m_s"),
    ):
        done = command("study", *arguments)
        assert done.returncode == 2, done.stdout
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


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """A Dask cluster on this machine, its worker as an administrator would start it."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as scheduler:
        address = scheduler.scheduler_address
        command_line = "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny"
        worker = subprocess.Popen([sys.executable, *command_line], stderr=subprocess.DEVNULL)
        yield address
        worker.terminate()
        worker.communicate()


def test_a_study_grows_on_a_cluster_that_runs_already_to_the_same_bytes(
    case, run, undisturbed, cluster, tmp_path
):
    folder = tmp_path / "study"
    for samples in (20, SAMPLES):
        options = ("-o", folder, "--run", run, "--samples", samples, "--scheduler", cluster)
        done = command("study", case, *options)
        assert done.returncode == 0, done.stderr
        assert rows(folder) == samples
    assert tables(folder) == tables(undisturbed)


def test_a_worker_of_another_version_is_named_before_it_simulates(
    case, run, cluster, tmp_path, monkeypatch
):
    """With the same number, other sources are another version."""
    for what, value in (
        ("__version__", "0.0.1"),
        ("fingerprint.fingerprint", lambda folder: "f" * 16),
    ):
        with monkeypatch.context() as changed:
            changed.setattr(f"elastic_robot.{what}", value)
            _version.cache_clear()
            options = ("-o", tmp_path / what, "--run", run, "--scheduler", cluster)
            done = command("study", case, *options)
        _version.cache_clear()
        assert done.returncode == 2
        assert "worker tcp://127.0.0.1:" in done.stderr
        assert (
            f"expected elastic-robot-fmu {'0.0.1' if what[0] == '_' else __version__}"
            in done.stderr
        )
        assert "Traceback" not in done.stderr
        assert rows(tmp_path / what) == 0


def test_a_study_of_another_version_does_not_go_on(case, run, tmp_path, monkeypatch):
    loaded = load_case(case)
    table = changed_table(loaded.study, samples=20)
    open_study(tmp_path, loaded, table, run, couple=False)
    monkeypatch.setattr("elastic_robot.__version__", "0.0.1")
    with pytest.raises(StudyError, match="holds a study that differs in version"):
        open_study(tmp_path, loaded, table, run, couple=False)


def test_a_scheduler_that_is_killed_is_a_sentence_and_the_same_command_goes_on(
    case, run, undisturbed, tmp_path
):
    folder, file = tmp_path / "study", tmp_path / "scheduler.json"
    options = (case, "--run", run, "--samples", SAMPLES)
    dask = [sys.executable, "-m", "distributed.cli.dask_"]
    ports = ["--port", "0", "--no-dashboard", "--scheduler-file", file]
    scheduler = subprocess.Popen(
        [*dask[:2], f"{dask[2]}scheduler", *ports], stderr=subprocess.DEVNULL
    )
    wait_until(lambda: file.is_file() and file.read_text().rstrip().endswith("}"))
    address = json.loads(file.read_text())["address"]
    worker = subprocess.Popen(
        [*dask[:2], f"{dask[2]}worker", address, "--nthreads", "1", "--no-nanny"],
        stderr=subprocess.DEVNULL,
    )
    try:
        running = started(*options, "--scheduler", address, folder=folder)
        wait_for_rows(running, folder, 3)
        scheduler.kill()
        assert running.ends_within(60.0)
    finally:
        for process in (scheduler, worker):
            process.kill()
            process.wait()
    said = running.output.read_text()
    assert running.status() == 2, said
    assert f"the Dask scheduler at {address} has ended" in said
    assert "Traceback" not in said
    assert 3 <= rows(folder) < SAMPLES
    done = command("study", case, "-o", folder, *options[1:], "--workers", 1)
    assert done.returncode == 0, done.stderr
    assert tables(folder) == tables(undisturbed)


def test_a_worker_that_comes_later_is_asked_by_its_first_sample():
    with pytest.raises(StudyError, match="worker tcp://a:1: expected elastic-robot-fmu 2, got 1:"):
        _require_same("2", {"tcp://b:1": "2", "tcp://a:1": "1"})
    with pytest.raises(StudyError, match="got one that cannot be read"):
        _require_same("2", {"tcp://a:1": ImportError("fingerprint")})


def test_a_scheduler_that_is_not_there_is_a_sentence(case, run, tmp_path, monkeypatch):
    monkeypatch.setattr("coupling.study.cluster._CLUSTER_TIMEOUT", 1.0)
    options = ("-o", tmp_path / "study", "--run", run, "--scheduler", "tcp://127.0.0.1:1")
    done = command("study", case, *options)
    assert done.returncode == 2
    assert "expected a Dask scheduler at tcp://127.0.0.1:1, got no answer" in done.stderr
    assert "Traceback" not in done.stderr


def test_workers_import_nothing_from_the_working_folder(tmp_path, monkeypatch):
    """What workers start, such as a user's program, may import what is beside it."""
    monkeypatch.chdir(tmp_path)
    for name in ("multiprocessing", "random", "tempfile", "numpy", "json", "coupling"):
        (tmp_path / f"{name}.py").write_text(f"open({f'{name}.ran'!r}, 'w')\nraise ImportError\n")
    with _client(Workers(1), 1, tmp_path) as client:
        assert client.submit(os.getenv, "PYTHONSAFEPATH").result(60.0) is None
    assert "PYTHONSAFEPATH" not in os.environ
    assert not list(tmp_path.glob("*.ran"))


def test_report_and_figures_tell_the_same(undisturbed):
    figures = json.loads((undisturbed / "study.json").read_text())
    table = read_table(undisturbed / "samples.csv", ("maximum",), StudyError)[:, 0]
    limit = figures["quantiles_m"]["maximum"]["0.9"]
    assert np.mean(table <= limit) == pytest.approx(0.9, abs=1.0 / SAMPLES)
    written = (undisturbed / "report.html").read_bytes()
    done = command("report", undisturbed)
    assert done.returncode == 0, done.stderr
    page = (undisturbed / "report.html").read_text(encoding="utf-8")
    assert page.encode() == written
    assert f"90 % of the robots that are possible stay within {in_words(limit)}" in page
    assert [entry["name"] for entry in figures["parameters"]] == [
        "stiffness_factor",
        "damping_factor",
        "backlash_factor",
        "force_factor",
    ]
    band = read_table(undisturbed / "bands.csv", ("low", "median", "high"), StudyError)
    assert np.all(np.diff(band, axis=1) >= 0.0)


def test_each_robot_may_be_coupled_with_its_process(cluster, tmp_path):
    """Samples of a hard wall, every one coupled, against one coupled by hand; a payload for each."""
    file = moving(
        tmp_path,
        "[study]\nstiffness_factor = [0.9, 1.1]\npayload_kg = [0.0, 8.0]\njoints = 'each'\n"
        "coverage = 0.5\n",
        feed="0.1",
    )
    options = ("-o", tmp_path / "study", "--samples", 8, "--couple", "--scheduler", cluster)
    done = command("study", file, *options)
    assert done.returncode == 0, done.stderr
    figures = json.loads((tmp_path / "study" / "study.json").read_text())
    assert figures["wrench"] == "coupled"
    assert figures["process_evaluations"] > 2 * 8
    assert figures["not_coupled"] == []
    kept = Store(tmp_path / "store", unwatched).entries()
    assert len(kept) > figures["process_evaluations"] - 8  # all begin on the model's path
    names = tuple(entry["name"] for entry in figures["parameters"])
    assert names == (*(f"stiffness_factor[{i}]" for i in range(1, 6)), "payload_kg")
    table = read_table(tmp_path / "study" / "samples.csv", (*names, "maximum"), StudyError)
    row = table[7].tolist()
    plant = f"stiffness_factor = {[*row[:5], 1.0]}\npayload_kg = {row[5]!r}\ncouple = true\n"
    case = load_case(moving(tmp_path, f"[plant]\n{plant}", feed="0.1"))
    alone = run_compensation(case).of(PLANT_REPLAY)
    assert alone.deviation().maximum == pytest.approx(row[6], abs=1e-12)


def test_a_command_that_is_not_converged_is_studied_and_said_so(cluster, tmp_path):
    file = moving(tmp_path, feed="0.1")
    text = file.read_text().replace(
        'method = "inverse"', 'method = "inverse"\ntolerance_m = 1e-9\nmax_rounds = 1'
    )
    file.write_text(text)
    options = ("-o", tmp_path / "study", "--samples", 19, "--scheduler", cluster)
    done = command("study", file, *options)
    assert done.returncode == 1, done.stderr
    assert done.stdout.startswith(
        "NOT FINISHED: the command of this study keeps its path on no robot"
    )
    page = (tmp_path / "study" / "report.html").read_text(encoding="utf-8")
    assert "The command is NOT CONVERGED" in page
    assert (tmp_path / "study" / "run" / "report.html").exists()


def test_a_coupling_is_no_command_to_study(case, tmp_path):
    assert command("couple", case, "-o", tmp_path / "run").returncode == 0
    done = command("study", case, "-o", tmp_path / "study", "--run", tmp_path / "run")
    assert done.returncode == 2
    assert "expected a run of compensate, got one of couple" in " ".join(done.stderr.split())


def test_without_dask_a_sentence_says_what_to_install(case, run, tmp_path, monkeypatch):
    monkeypatch.delitem(sys.modules, "coupling.study.cluster", raising=False)
    monkeypatch.setitem(sys.modules, "distributed", None)
    done = command("study", case, "-o", tmp_path / "study", "--run", run, "--workers", 2)
    assert done.returncode == 2
    assert "pip install 'elastic-robot-fmu[study]'" in done.stderr
    assert "Traceback" not in done.stderr


# What is wrong with [study], and what the one message must contain.
BAD_STUDIES = {
    "unknown key": ("stiffnes_factor = [0.9, 1.1]", "did you mean 'stiffness_factor'"),
    "negative": ("damping_factor = [-0.1, 1.1]", "damping_factor: expected values >= 0, got -0.1"),
    "no stiffness": ("stiffness_factor = [0.0, 1.1]", "stiffness_factor: expected values > 0"),
    "upside down": (
        "force_factor = [1.1, 0.9]",
        "expected [low, high], low < high, got [1.1, 0.9]",
    ),
    "wide": ("backlash_factor = { mean = 1.0, deviation = 0.5 }", "expected values >= 0, got -0.5"),
    "half": ("backlash_factor = { mean = 1.0 }", "or { mean = .., deviation = .. }, got neither"),
    "both": ("force_factor = { low = 0.9, high = 1.1, mean = 1.0 }", "got neither"),
    "words": ('force_factor = "much"', "force_factor: expected [low, high] or"),
    "not finite": ("force_factor = [0.9, inf]", "force_factor: high: expected a finite number"),
    "no samples": ("samples = 0", "samples: expected a number greater than or equal to 1, got 0"),
    "few samples": ("samples = 5", "expected at least 19 for a band that holds 90 %"),
    "design": ('design = "grid"', "design: expected 'sobol' or 'latin-hypercube', got 'grid'"),
}


@pytest.mark.parametrize("name", BAD_STUDIES)
def test_a_bad_study_is_one_message(tmp_path, name):
    table, words = BAD_STUDIES[name]
    with pytest.raises(CaseError) as refused:
        changed_table(load_case(moving(tmp_path, f"[study]\n{table}\n")).study)
    assert words in str(refused.value)
    assert "study: " in str(refused.value)


def test_a_bad_number_of_samples_leaves_no_folder(case, tmp_path):
    done = command("study", case, "-o", tmp_path / "study", "--samples", 0)
    assert done.returncode == 2
    assert "samples: expected a number greater than or equal to 1, got 0" in done.stderr
    assert not (tmp_path / "study").exists()


def test_a_folder_of_something_else_is_left_alone(case, run, tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    done = command("study", case, "-o", tmp_path, "--run", run, "--overwrite")
    assert done.returncode == 2
    assert "holds files that are not a study (letter.txt)" in " ".join(done.stderr.split())
    assert (tmp_path / "letter.txt").read_text() == "dear"


def test_what_a_killed_command_has_left_beside_its_run_is_the_study_s(tmp_path):
    """And goes with it; what anybody else has put there stays."""
    place, theirs = tmp_path / "study", {"run.sh", "run.log", "run.old", "rows.jsonl.kept"}
    with lock_folder(place, overwrite=False):
        for name in ("run", "run.unfinished", ".run.replaced"):
            begin_folder(place / name, "run")
            claim_file(place / name / "run.json").write_text("{}")
        for name in (".run.lock", "study.toml", f"study.json.{'0f' * 16}.partial"):
            (place / name).write_text("")
        for name in theirs - {"run.old"}:
            (place / name).write_text("mine")
        (place / "run.old").mkdir()
        (place / "run" / "notes.txt").write_text("mine")
    with lock_folder(place, overwrite=True):
        assert {file.name for file in place.iterdir()} == theirs | {"run", LIST}
        assert {file.name for file in (place / "run").iterdir()} == {"notes.txt", LIST}


def test_a_study_of_an_earlier_version_has_no_list_and_goes_on(tmp_path):
    for name in ("study.toml", "rows.jsonl", "notes.txt"):
        (tmp_path / name).write_text("")
    with lock_folder(tmp_path, overwrite=False):
        assert {"study.toml", "rows.jsonl", "notes.txt"} < {f.name for f in tmp_path.iterdir()}
    with lock_folder(tmp_path, overwrite=True):
        assert {file.name for file in tmp_path.iterdir()} == {LIST, "notes.txt"}


def test_what_means_nothing_is_left_out():
    """A linear robot has no backlash to be uncertain of, a free one no force."""
    case = load_case(LINE_CASE)
    assert StudyParameters.of(case, loaded=False).names == ("stiffness_factor", "damping_factor")
    assert StudyParameters.of(case, loaded=False).silent == ("backlash_factor", "force_factor")
    assert StudyParameters.of(case, loaded=True).names[-1] == "force_factor"


def test_slip_torques_are_uncertain_where_gears_have_elements(tmp_path):
    """By 30 %, all alike or each by itself; without elements it is left out, in silence if not asked."""
    gear = "gear.hysteresis = [{ slip_torque = 40.0, slip_angle = 2e-5 }]\n"
    text = find_robot("icme2008").read_text().replace("backlash  =", f"{gear}backlash  =", 2)
    (tmp_path / "robot.toml").write_text(text)
    slipping = ('"icme2008"', '"robot.toml"')

    def parameters(more: str, *changes: tuple[str, str]) -> StudyParameters:
        (tmp_path / "case.toml").write_text(f"{moving_line(*changes)}\n[study]\n{more}\n")
        return StudyParameters.of(load_case(tmp_path / "case.toml"), loaded=False)

    alike = parameters("", slipping)
    assert alike.names == tuple(
        f"{name}_factor" for name in ("stiffness", "damping", "backlash", "hysteresis")
    )
    assert alike.entries[-1].range == pytest.approx((0.7, 1.3))
    (changed,) = alike.sampled([1.0, 1.0, 1.0, 0.9]).differences
    robot = load_robot(tmp_path / "robot.toml")
    assert changed.values(robot, "backlash") == {
        f"joint[{i}].hysteresis": pytest.approx(36.0, rel=1e-15) for i in (1, 2)
    }
    each = parameters("hysteresis_factor = [0.5, 1.5]\njoints = 'each'", slipping)
    assert each.names == ("hysteresis_factor[1]", "hysteresis_factor[2]")
    (changed,) = each.sampled([1.0, 0.5]).differences
    assert changed.values(robot, "linear") == {"joint[2].hysteresis": 20.0}
    assert "hysteresis_factor" not in (*parameters("").names, *parameters("").silent)
    assert parameters("hysteresis_factor = [0.5, 1.5]").silent == ("hysteresis_factor",)


def test_normal_parameters_have_their_moments():
    """Mean and deviation of a normal distribution that is cut off at three of it: 0.9733 of it."""
    parameter = StudyParameter("force_factor", Distribution(mean=1.0, deviation=0.1))
    values = parameter.at((np.arange(20_000) + 0.5) / 20_000)
    assert values.mean() == pytest.approx(1.0, abs=1e-6)
    assert values.std() == pytest.approx(0.1 * np.sqrt(0.97334), rel=1e-4)
    assert parameter.range == pytest.approx((0.7, 1.3))
