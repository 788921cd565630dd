"""The commands as a user types them: files, exit statuses, messages."""

import json
import shutil
import subprocess
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command_line import BY_MODE, FILES, command
from line_case import changed_text
from places import LINE_CASE as LINE

from coupling.errors import ResultError
from coupling.files.atomic_folder import whole_folder
from coupling.files.written_files import claim_file
from coupling.fmu_export.build import KINDS
from coupling.native.compiler import host_platform
from coupling.report.stored_result import write_report
from coupling.run.stored_run import read_run
from coupling.run.unfinished_folder import RUN_FOLDER
from elastic_robot.chain import build_chain
from elastic_robot.kinematics import base_from_tool
from elastic_robot.trajectory import read_trajectory


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> tuple[Path, subprocess.CompletedProcess]:
    """Return the test case, compensated by the command line with backlash."""
    folder = tmp_path_factory.mktemp("run")
    case = folder / "stroke.toml"
    case.write_text(LINE.read_text().replace('"linear"', '"backlash"'))
    return folder / "out", command("compensate", case, "-v", "-o", folder / "out")


def test_compensation_succeeds_and_says_so(finished):
    folder, done = finished
    assert done.returncode == 0, done.stderr
    assert "If the file is right: " in done.stdout
    assert "path change max" in done.stdout
    assert "gravity alone" in done.stdout
    assert "process (loaded minus unloaded)" in done.stdout
    assert "moving robot under the same command and wrench" in done.stdout
    assert "largest step of the correction" in done.stdout
    assert {file.name for file in folder.iterdir()} == FILES | BY_MODE["dynamic"] | {
        "wrong_backlash.csv"
    }


def test_result_holds_the_figures(finished):
    folder, done = finished
    result = json.loads((folder / "result.json").read_text())
    assert result["before"] == "coupled"
    assert "Before compensation: coupled with its process" in done.stdout
    assert result["converged"] is True
    assert (
        result["deviation_after_m"]["maximum"]
        <= 1e-6
        < 1e-3
        < result["deviation_before_m"]["maximum"]
    )
    evaluations = sum(len(entry["evaluations"]) for entry in result["iterations"])
    assert result["process_evaluations"] == evaluations + 1  # and the validation
    first, *others = result["iterations"]
    assert "largest_correction_step_m" not in first
    assert all(entry["largest_correction_step_m"] > 0.0 for entry in others)
    assert result["backlash_reversals"] is None  # mirroring does not know them
    assert len(result["robustness"]) == 6 + 1  # and what samples cost
    assert result["shares_m"]["process"]["maximum"] > 1e-5
    # Under the corrected command gravity and process take the tool away and back again.
    dry, moved = (result["shares_m"][f"{part}_after"]["maximum"] for part in ("gravity", "process"))
    assert abs(dry - moved) <= result["deviation_after_m"]["maximum"] * (1.0 + 1e-9)
    assert min(dry, moved) > 1e-5
    assert len(result["fmu_fingerprint"]) == 16
    assert {"numpy", "pin", "fmpy"} <= set(result["versions"])


def test_tables_have_the_columns_of_the_contract(finished):
    folder, _ = finished
    pose = "time,x,y,z,qx,qy,qz,qw"
    expected = dict.fromkeys(("desired", "uncompensated", "achieved"), pose)
    drives = [f"{name}{i}" for name in ("q", "qd", "qdd") for i in range(1, 7)]
    expected["command"] = ",".join([pose, *drives])
    expected["correction"] = "time,dx,dy,dz,drx,dry,drz"
    expected["wrench"] = "time,fx,fy,fz,mx,my,mz"
    found = {name: (folder / f"{name}.csv").open().readline().strip() for name in expected}
    assert found == expected


def test_command_replayed_from_the_files_gives_the_achieved_path(finished, example_fmu, run_fmu):
    """A fresh FMU in a fresh process: joint angles of command.csv, wrench of wrench.csv, to 1e-8 m."""
    folder, _ = finished
    wrench = np.loadtxt(folder / "wrench.csv", delimiter=",", skiprows=1)
    names = ["force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z"]
    job = {
        "settings": {
            "trajectory": str(folder / "command.csv"),
            "mode": "quasistatic",
            "torque_curve": "backlash",
        },
        "time": wrench[:, 0],
        "inputs": dict(zip(names, wrench[:, 1:].T, strict=True)),
        "outputs": [f"tcp.{c}" for c in ("x", "y", "z", "qx", "qy", "qz", "qw")],
    }
    (answer,) = run_fmu(example_fmu, job)
    achieved = np.loadtxt(folder / "achieved.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(answer["values"], achieved[:, 1:], rtol=0, atol=1e-8)


def test_fmus_of_both_kinds_give_the_same_command(tmp_path):
    """Poses and joint angles of command.csv to 1e-8 m and rad.

    On other robots to 1 % of what is left: a gear in its backlash carries their last digits on.
    """
    text = changed_text(
        LINE,
        ("[0.06, 0.0, -0.002], [0.06, 0.0, 0.002]", "[0.0, 0.0, 0.002]"),
        ("feed_m_s = 0.1", "feed_m_s = 0.2"),
        ("blend_s  = 0.1", "blend_s  = 0.05"),
        ("sample_s = 0.01", "sample_s = 0.02"),
    )
    tables, left = [], []
    for kind in KINDS:
        case, out = tmp_path / f"{kind}.toml", tmp_path / kind
        own = text.replace("[robot]", f'[robot]\nfmu = "{kind}"')
        case.write_text(own.replace('"linear"', '"backlash"'))
        command("compensate", case, "-o", out, exits=0)
        tables.append(np.loadtxt(out / "command.csv", delimiter=",", skiprows=1)[:, : 8 + 6])
        rows = json.loads((out / "result.json").read_text())["robustness"]
        left.append({row["name"]: row["deviation_m"]["maximum"] for row in rows})
    np.testing.assert_allclose(tables[1], tables[0], rtol=0, atol=1e-8)
    assert left[1] == pytest.approx(left[0], rel=1e-2)


def test_the_command_has_the_controllers_rows_and_all_else_one_time_axis(finished):
    folder, _ = finished
    robot = read_run(folder).first
    time = robot.desired.time
    for other in (robot.uncompensated, robot.achieved, robot.wrench):
        assert np.array_equal(other.time, time)
    np.testing.assert_allclose(np.diff(robot.joints.time), 0.004, rtol=1e-9)
    assert np.array_equal(robot.command.time, robot.joints.time)
    assert 0.0 <= robot.joints.time[-1] - time[-1] < 0.004


def test_correction_is_command_minus_desired(finished, example):
    """Of the motion that the FMU reads from command.csv, through its rigid kinematics."""
    folder, _ = finished
    robot = read_run(folder).first
    chain = build_chain(example)
    motion = read_trajectory(folder / "command.csv", 6)
    data = chain.model.createData()

    def points(times: np.ndarray) -> np.ndarray:
        angles = motion.at(times)[0]
        return np.array(
            [base_from_tool(chain, data, chain.theta(q)).translation.copy() for q in angles]
        )

    moved = points(robot.desired.time) - robot.desired.position[0]
    np.testing.assert_allclose(robot.correction[:, :3], moved, rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        robot.command.position[0], points(robot.joints.time), rtol=0, atol=1e-14
    )
    assert np.abs(robot.correction).max() > 1e-4


def test_resolved_case_runs_again_to_the_same_figures(finished, tmp_path):
    folder, _ = finished
    command("compensate", folder / "case.toml", "-o", tmp_path / "again", exits=0)
    for name in ("command", "achieved", "wrench"):
        assert (tmp_path / "again" / f"{name}.csv").read_bytes() == (
            folder / f"{name}.csv"
        ).read_bytes()
    resolved = tomllib.loads((folder / "case.toml").read_text())
    assert resolved["coupling"]["max_evaluations"] == 40
    assert resolved["controller"] == {"cycle_s": 0.004, "interpolation": "quintic"}
    assert resolved["robot"]["fmu"] == "native"


def test_couple_leaves_the_same_kinds_of_files(tmp_path):
    done = command("couple", LINE, "-o", tmp_path / "out", exits=0)
    files = {file.name for file in (tmp_path / "out").iterdir()}
    assert files == FILES | {"uncompensated_dynamic.csv"}
    run = read_run(tmp_path / "out")
    assert run.figures.kind == "couple"
    assert np.array_equal(run.first.achieved.pose, run.first.uncompensated.pose)
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for text in (
        done.stdout,
        report[report.index("<body>") : report.index("<h2>Inputs: case</h2>")],
    ):
        assert "ompensation" not in text


def test_not_converging_is_status_1_with_a_result(tmp_path):
    case = tmp_path / "hard.toml"
    text = LINE.read_text().replace("2.0e5", "2.0e7").replace('"anderson"', '"constant"')
    case.write_text(text)
    done = command("couple", case, "-o", tmp_path / "out", exits=1)
    assert "NOT FINISHED" in done.stdout
    assert json.loads((tmp_path / "out" / "result.json").read_text())["converged"] is False
    files = {file.name for file in (tmp_path / "out").iterdir()}
    assert files == FILES | {"uncompensated_dynamic.csv"}


def test_an_existing_result_is_kept_unless_told_otherwise(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "result.json").write_text("{}")
    done = command("couple", LINE, "-o", out, exits=2)
    assert "--overwrite" in done.stderr
    assert (out / "result.json").read_text() == "{}"
    done = command("couple", LINE, "-o", out, "--overwrite", exits=0)
    # Which no list tells to be that of a command.
    assert (out / "result.json.kept").read_text() == "{}"
    written = {file.name for file in out.iterdir()} - {"result.json.kept"}
    assert written == FILES | {"uncompensated_dynamic.csv"}


def test_a_folder_with_other_files_is_never_replaced(tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    done = command("couple", LINE, "-o", tmp_path, "--overwrite", exits=2)
    assert "not a result" in done.stderr
    assert (tmp_path / "thesis.txt").exists()


@pytest.mark.parametrize("place", ["/proc/run", "/dev/null/run"])
def test_a_folder_that_cannot_be_written_is_found_before_the_work(place):
    start = time.monotonic()
    done = command("couple", LINE, "-o", place, exits=2)
    assert f"{place}: cannot be written" in done.stderr
    assert "eval" not in done.stdout, time.monotonic() - start


def test_a_run_that_fails_leaves_no_folder(tmp_path):
    def fail() -> None:
        with whole_folder(tmp_path / "out", RUN_FOLDER, False) as scratch:
            claim_file(scratch / "half.csv").write_text("x")
            raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_build_and_report_commands(finished, tmp_path):
    folder, _ = finished
    command("build", "-o", tmp_path / "R.fmu", "--platforms", host_platform().name, exits=0)
    assert (tmp_path / "R.fmu").is_file()
    command("report", folder, "-o", tmp_path / "page.html", exits=0)
    assert (tmp_path / "page.html").read_text() == (folder / "report.html").read_text()
    lost = command("report", tmp_path / "nowhere", exits=2)
    assert "expected the folder of a run" in " ".join(lost.stderr.split())


def test_a_damaged_run_folder_is_named(finished, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(finished[0], copy)
    (copy / "wrench.csv").write_text("time,fx\n0,0\n")
    with pytest.raises(ResultError, match=r"wrench\.csv: columns fy, fz"):
        read_run(copy)
    (copy / "command.csv").unlink()
    with pytest.raises(ResultError, match=r"command\.csv: cannot be read"):
        read_run(copy)
    (copy / "result.json").write_text("{")
    with pytest.raises(ResultError, match="not valid JSON"):
        write_report(copy)
