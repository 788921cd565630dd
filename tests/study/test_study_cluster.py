"""A study on Dask's schedulers and workers, as they come, go and differ."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator

import pytest
from command_line import command
from killing import wait_until
from studies import SAMPLES, moving, rows, started, tables, wait_for_rows

from coupling.case.file import load_case
from coupling.errors import StudyError
from coupling.events import unwatched
from coupling.files.csv_table import read_table
from coupling.run.execute import run_compensation
from coupling.run.plant import PLANT_REPLAY
from coupling.store import Store
from coupling.study.cluster import _client, _require_same, _version
from coupling.study.robot_pool import Workers
from elastic_robot import __version__

pytest.importorskip("distributed")


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
        command("study", case, *options, exits=0)
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
    command("study", case, "-o", folder, *options[1:], "--workers", 1, exits=0)
    assert tables(folder) == tables(undisturbed)


def test_a_worker_that_comes_later_is_asked_by_its_first_sample():
    with pytest.raises(StudyError, match="worker tcp://a:1: expected elastic-robot-fmu 2, got 1:"):
        _require_same("2", {"tcp://b:1": "2", "tcp://a:1": "1"})
    with pytest.raises(StudyError, match="got one that cannot be read"):
        _require_same("2", {"tcp://a:1": ImportError("fingerprint")})


def test_a_scheduler_that_is_not_there_is_a_sentence(case, run, tmp_path, monkeypatch):
    monkeypatch.setattr("coupling.study.cluster._CLUSTER_TIMEOUT", 1.0)
    options = ("-o", tmp_path / "study", "--run", run, "--scheduler", "tcp://127.0.0.1:1")
    done = command("study", case, *options, exits=2)
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


def test_each_robot_may_be_coupled_with_its_process(cluster, tmp_path):
    """Samples of a hard wall, every one coupled, against one coupled by hand; a payload for each."""
    file = moving(
        tmp_path,
        "[study]\nstiffness_factor = [0.9, 1.1]\npayload_kg = [0.0, 8.0]\njoints = 'each'\n"
        "coverage = 0.5\n",
        feed="0.1",
    )
    options = ("-o", tmp_path / "study", "--samples", 8, "--couple", "--scheduler", cluster)
    command("study", file, *options, exits=0)
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
    alone = run_compensation(case)
    path = alone.finding_of(PLANT_REPLAY).path
    assert alone.deviation(path).maximum == pytest.approx(row[6], abs=1e-12)


def test_a_command_that_is_not_converged_is_studied_and_said_so(cluster, tmp_path):
    file = moving(tmp_path, feed="0.1")
    text = file.read_text().replace(
        'method = "inverse"', 'method = "inverse"\ntolerance_m = 1e-9\nmax_rounds = 1'
    )
    file.write_text(text)
    options = ("-o", tmp_path / "study", "--samples", 19, "--scheduler", cluster)
    done = command("study", file, *options, exits=1)
    assert done.stdout.startswith(
        "NOT FINISHED: the command of this study keeps its path on no robot"
    )
    page = (tmp_path / "study" / "report.html").read_text(encoding="utf-8")
    assert "The command is NOT CONVERGED" in page
    assert (tmp_path / "study" / "run" / "report.html").exists()


def test_without_dask_a_sentence_says_what_to_install(case, run, tmp_path, monkeypatch):
    monkeypatch.delitem(sys.modules, "coupling.study.cluster", raising=False)
    monkeypatch.setitem(sys.modules, "distributed", None)
    done = command("study", case, "-o", tmp_path / "study", "--run", run, "--workers", 2, exits=2)
    assert "pip install 'elastic-robot-fmu[study]'" in done.stderr
    assert "Traceback" not in done.stderr
