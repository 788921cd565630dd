"""Programs and measurements as processes: answers, errors, and what is kept."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import command
from killing import wait_until
from places import EXAMPLES, LINE_CASE
from scipy.spatial.transform import Rotation
from spring_robot import SpringPlanner, SpringRobot, upright

from coupling.case.file import load_case
from coupling.errors import CaseError, ProcessError
from coupling.events import Event, ProcessMessage
from coupling.files.csv_table import WRENCH_COLUMNS, write_table
from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.path.histories import ToolPath
from coupling.path.interpolation import SampledPath
from coupling.path.linear import arc_length
from coupling.process import ExternalProgram, ExternalTable, MeasuredWrenchTable
from coupling.process.program import is_running
from coupling.robot.cell import Cell, Member
from coupling.run.execute import run_coupling
from coupling.solve.correction import Correction
from coupling.solve.fixed_point import Loop, couple
from coupling.solve.mirror import Mirror
from coupling.solve.outcome import Outcome
from coupling.solve.relaxation import Anderson
from coupling.toolpaths import Task
from coupling.toolpaths.part import tool_path

PART = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("xyz", [0.3, -0.2, 0.5]))


def task(workspace: Path | None = None) -> Task:
    """Return 21 samples down into the part and along it."""
    s = np.linspace(0.0, 1.0, 21)
    points = np.column_stack([0.1 * s**2, 0.0 * s, -2e-3 * s])
    desired = tool_path(PART, s, points)
    return Task(PART, desired) if workspace is None else Task(PART, desired, workspace=workspace)


def external(workspace: Path, program: str, **keys: object):
    """Return a Python program as a process."""
    table = {"command": ["{python}", "-c", program], "time_limit_s": 30.0, **keys}
    return ExternalTable.model_validate({"model": "external", **table}).process(task(workspace))


SPRINGS = (EXAMPLES / "process_template.py").read_text()


def test_the_template_is_a_wall_on_springs_in_the_part_frame(tmp_path):
    """2e5 N/m times the depth below the sheet along the part's z axis, whatever the base frame."""
    process = external(tmp_path, SPRINGS)
    path = task().desired
    wrench = process.evaluate(path).wrench.wrench[0]
    depth = np.maximum(-PART.coordinates(path.position[0])[:, 2], 0.0)
    expected = np.outer(2e5 * depth, PART.rotation.apply([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(wrench[:, :3], expected, rtol=0, atol=1e-9)
    assert np.all(wrench[:, 3:] == 0.0)


def test_every_evaluation_has_a_fresh_folder(tmp_path):
    process, path = external(tmp_path, SPRINGS), task().desired
    process.evaluate(path)
    process.evaluate(path)
    left = sorted(str(f.relative_to(tmp_path)) for f in tmp_path.rglob("*") if f.is_file())
    names = ("evaluation.json", "output.txt", "path.csv", "wrench.csv")
    assert left == [f"evaluations/{n}/{name}" for n in ("0001", "0002") for name in names]
    assert "largest force 400.0 N" in (tmp_path / "evaluations/0002/output.txt").read_text()


def test_the_base_frame_is_passed_through(tmp_path):
    program = SPRINGS.replace('-path["z"]', '0.5 - path["z"]')
    path = task().desired
    wrench = external(tmp_path, program, frame="base").evaluate(path).wrench.wrench[0]
    expected = 2e5 * np.maximum(0.5 - path.position[0, :, 2], 0.0)
    np.testing.assert_allclose(wrench[:, 2], expected, rtol=0, atol=1e-9)


# A program that fails, and what the message must contain.
FAILURES = {
    "status": ("print('no licence'); exit(7)", ["exit status 7", "last lines:\nno licence"]),
    "silent": ("exit(1)", ["exit status 1", "it printed nothing"]),
    "no answer": ("print('done')", ["left no wrench.csv", "last lines:\ndone"]),
    "columns": (
        "open('wrench.csv', 'w').write('time,fx\\n0,0\\n')",
        ["answered badly", "columns fy, fz, mx, my, mz are missing"],
    ),
    "not numbers": (
        SPRINGS.replace("header=header", 'header=header + "\\n1,2,3,4,five,6,7"'),
        ["answered badly", "not a table of numbers", "five"],
    ),
    "NaN": (
        SPRINGS.replace("2e5 ", "float('nan') "),
        ["answered badly", "fz: expected a finite number, got nan in row 1"],
    ),
    "rows": (
        SPRINGS.replace('"wrench.csv", wrench', '"wrench.csv", wrench[1:]'),
        ["expected 21 rows, as path.csv has, and two of one time", "got 20 rows of 20 times"],
    ),
    "times": (
        SPRINGS.replace('path["time"]', '1.001 * path["time"]'),
        ["expected 1 s, as path.csv has", "got 1.001 s in row 21"],
    ),
}


@pytest.mark.parametrize("name", FAILURES)
def test_a_program_that_fails_is_quoted(tmp_path, name):
    program, words = FAILURES[name]
    with pytest.raises(ProcessError) as failure:
        external(tmp_path, program).evaluate(task().desired)
    said = str(failure.value)
    assert said.startswith("evaluation 0001: ")
    assert [word for word in words if word not in said] == []
    assert (tmp_path / "evaluations/0001/path.csv").is_file()


def test_times_may_be_printed_with_six_digits(tmp_path):
    program = SPRINGS.replace('path["time"]', 'np.round(path["time"] * 1.000001, 6)')
    assert np.array_equal(
        external(tmp_path, program).evaluate(task().desired).wrench.time, task().desired.time
    )


def test_a_time_out_ends_the_program_and_its_children(tmp_path):
    """A child that writes a line every 20 ms writes no more; the message has the last words."""
    child = "import time\nwhile True: print('.', file=open('ticks', 'a')); time.sleep(0.02)"
    program = (
        "import subprocess, sys, time\n"
        f"subprocess.Popen([sys.executable, '-c', {child!r}])\n"
        "print('solving', flush=True); time.sleep(60)"
    )
    begin = time.monotonic()
    with pytest.raises(ProcessError, match=r"time limit of 1 s; its last lines:\nsolving"):
        external(tmp_path, program, time_limit_s=1.0).evaluate(task().desired)
    assert time.monotonic() - begin < 10.0
    ticks = tmp_path / "evaluations/0001/ticks"
    written = ticks.stat().st_size
    time.sleep(0.3)
    assert 0 < written == ticks.stat().st_size


def test_output_is_told_line_by_line(tmp_path):
    program = SPRINGS + "\nimport time; print('50 %', flush=True); time.sleep(0.3)\n"
    told: list[Event] = []
    replace(external(tmp_path, program), watch=told.append).evaluate(task().desired)
    assert ProcessMessage("50 %") in told


def unfinished(workspace: Path, program: str, **keys: object) -> Path:
    """Begin an evaluation in a process of its own, kill that, and return the evaluation's folder."""
    begin = (
        "import sys; sys.path[:0] = sys.argv[1:]\n"
        "from pathlib import Path\n"
        "import test_external as test\n"
        f"test.external(Path({str(workspace)!r}), {program!r}, **{keys!r})"
        ".evaluate(test.task().desired)\n"
    )
    run = subprocess.Popen([sys.executable, "-c", begin, str(Path(__file__).parent), *sys.path])
    folder = workspace / "evaluations" / "0001"
    while not (folder / "begun").exists():
        assert run.poll() is None
        time.sleep(0.01)
    run.kill()
    run.wait()
    assert (folder / "unfinished.json").exists()
    return folder


# Tells that it has begun, and how often.
BEGUN = (
    "import pathlib, time\n"
    "with open('../../begun', 'a') as f: f.write('x')\n"
    "pathlib.Path('begun').touch()\n"
)


def begun(workspace: Path) -> int:
    return len((workspace / "begun").read_text())


def test_a_program_whose_run_was_killed_is_waited_for(tmp_path):
    program = BEGUN + "time.sleep(0.5); print('half way', flush=True); time.sleep(0.5)\n" + SPRINGS
    folder = unfinished(tmp_path, program)
    told: list[Event] = []
    process = replace(external(tmp_path, program), watch=told.append)
    answer = process.evaluate(task().desired)
    assert begun(tmp_path) == 1
    assert answer.wrench.peak_force == pytest.approx(400.0)
    assert ProcessMessage("half way") in told
    assert any(str(folder) in event.line for event in told)
    assert sorted(f.name for f in folder.parent.iterdir()) == ["0001"]
    assert (folder / "evaluation.json").exists()


def test_a_program_that_has_ended_after_its_run_was_killed_is_not_run_again(tmp_path):
    program = BEGUN + "time.sleep(0.2)\n" + SPRINGS
    folder = unfinished(tmp_path, program)
    wait_until(lambda: (folder / "exit_status").exists())
    assert external(tmp_path, program).evaluate(task().desired).wrench.peak_force > 399.0
    assert begun(tmp_path) == 1


@pytest.mark.parametrize("other", ["path", "program"])
def test_a_program_that_was_begun_for_something_else_is_ended(tmp_path, other):
    again = "0 if pathlib.Path('../0001.unfinished').exists() else 60"
    program = BEGUN + f"time.sleep({again})\n" + SPRINGS
    folder = unfinished(tmp_path, program)
    group = int((folder / "running").read_text())
    path = task().desired
    if other == "path":
        path = path.displaced(np.full(6, 1e-9))
    else:
        program += "# another"
    assert external(tmp_path, program).evaluate(path).wrench.peak_force > 399.0
    status = Path(f"/proc/{group}/stat")
    assert not status.exists() or status.read_text().split()[2] == "Z"


def test_where_the_program_is_killed_too_it_finds_its_restart_files(tmp_path):
    """It counts to ten in steps that it keeps; killed after three, it goes on with the fourth."""
    steps = (
        "import sys\n"
        "kept = pathlib.Path(sys.argv[1]) / 'steps'\n"
        "done = int(kept.read_text()) if kept.exists() else 0\n"
        "for step in range(done, 10):\n"
        "    kept.write_text(str(step + 1))\n"
        "    with open('../../steps', 'a') as f: f.write(f'{step} ')\n"
        "    first = step == 2 and pathlib.Path('../../begun').read_text() == 'x'\n"
        "    if first: pathlib.Path('begun').touch(); time.sleep(60.0)\n"
    )
    program = BEGUN.replace("pathlib.Path('begun').touch()\n", "") + steps + SPRINGS
    command = ["{python}", "-c", program, "{restart}"]
    folder = unfinished(tmp_path, program, command=command)
    os.killpg(int((folder / "running").read_text()), signal.SIGKILL)
    wait_until(lambda: not is_running(folder))
    process = external(tmp_path, program, command=command)
    assert process.evaluate(task().desired).wrench.peak_force > 399.0
    assert (tmp_path / "steps").read_text().split() == [str(step) for step in range(10)]
    assert begun(tmp_path) == 2
    assert sorted(f.name for f in folder.parent.iterdir()) == ["0001"]
    other = process.evaluate(task().desired.displaced(np.full(6, 1e-9)))  # has no restart files
    assert other.wrench.peak_force > 399.0
    assert (tmp_path / "steps").read_text().split()[10] == "0"


def test_files_that_a_program_reads_belong_to_its_identity(tmp_path):
    deck = tmp_path / "decks" / "sheet.inp"
    deck.parent.mkdir()
    found = set()
    for text in ("*ELASTIC", "*PLASTIC", "*PLASTIC"):
        deck.write_text(text)
        for files in ([str(deck)], [str(deck.parent)]):
            found.add(external(tmp_path, SPRINGS, files=files).identity)
    assert len(found) == 4
    one, two = (external(tmp_path, SPRINGS, time_limit_s=limit).identity for limit in (1.0, 2.0))
    assert one == two


def test_a_program_that_is_not_there_is_found_with_the_case(tmp_path):
    with pytest.raises(CaseError, match="there is no program 'abaqus-2099'"):
        external(tmp_path, "", command=["abaqus-2099"])
    with pytest.raises(CaseError, match=r"nowhere: cannot be read: No such file"):
        external(tmp_path, "", files=[str(tmp_path / "nowhere")])


def counted(limit: int) -> str:
    """Return the template, failing after so many evaluations."""
    return (
        "import pathlib, sys\n"
        f"if int(pathlib.Path.cwd().name) > {limit}: sys.exit('licence lost')\n" + SPRINGS
    )


def failing_case(tmp_path: Path, limit: int) -> Path:
    """Return the template's case with a program that fails after so many evaluations."""
    (tmp_path / "program.py").write_text(counted(limit))
    text = (EXAMPLES / "cases" / "external_template.toml").read_text()
    text = text.replace("/../process_template.py", "/program.py")
    case = tmp_path / "case.toml"
    case.write_text(text.replace("feed_m_s = 0.05", "feed_m_s = 0.05\nsample_s = 0.1"))
    return case


def test_a_failure_at_once_is_status_2_and_keeps_the_evaluation(tmp_path):
    done = command("couple", failing_case(tmp_path, 0), "-o", tmp_path / "out")
    assert done.returncode == 2
    assert "evaluation 0001" in done.stderr
    assert "licence lost" in done.stderr
    assert "Traceback" not in done.stderr
    kept = tmp_path / "out" / "evaluations" / "0001"
    assert str(kept.parent) in done.stderr.replace("\n", "")
    assert (kept / "path.csv").is_file()
    log = json.loads((tmp_path / "out" / "run.json").read_text())
    assert log["state"] == "failed"
    assert "licence lost" in log["reason"]
    assert "its run has not finished" in command("report", tmp_path / "out").stderr


def pressing(workspace: Path, limit: int) -> tuple[SpringRobot, ToolPath, ExternalProgram]:
    """Return springs of gain 0.1, a path 2 mm deep, and a program that fails after `limit` runs."""
    time = np.linspace(0.0, 1.0, 30)
    depth = -2e-3 * np.sin(np.pi * time) ** 2
    desired = ToolPath(time, upright(np.column_stack([0.1 * time, 0.0 * time, depth])))
    at_the_origin = Frame(np.zeros(3), Rotation.identity())
    process = ExternalTable.model_validate(
        {"model": "external", "command": ["{python}", "-c", counted(limit)], "time_limit_s": 30.0}
    ).process(Task(at_the_origin, desired, workspace=workspace))
    springs = Member("springs", AT_THE_ORIGIN, SpringRobot(5e-7 * np.eye(3)), SpringPlanner())
    return Loop(Cell((springs,)), process, "quasistatic", Anderson(1.0)), desired


def mirrored(workspace: Path, limit: int) -> Correction:
    """Return the correction of that path."""
    loop, desired = pressing(workspace, limit)
    return Mirror(tolerance_m=1e-5).correct(loop, SampledPath.of(desired))


def test_a_later_failure_of_a_coupling_is_a_result_with_what_was_computed(tmp_path):
    loop, desired = pressing(tmp_path, 2)
    result = couple(loop, loop.robot.plan(desired))
    assert result.outcome is Outcome.PROCESS_FAILED
    assert result.reason.startswith("the process failed in evaluation 3: evaluation 0003")
    assert "licence lost" in result.reason
    answered = np.genfromtxt(tmp_path / "evaluations/0002/wrench.csv", delimiter=",", names=True)
    assert np.array_equal(result.response.wrench.force[0, :, 2], answered["fz"])


def test_a_failure_on_the_way_leaves_the_best_command(tmp_path):
    """In a later pass, and in the validation alone."""
    whole = mirrored(tmp_path / "whole", 99)
    assert whole.converged
    for limit in (len(whole.iterations[0].coupling) + 1, whole.evaluations - 1):
        result = mirrored(tmp_path / str(limit), limit)
        assert result.outcome is Outcome.PROCESS_FAILED
        assert "licence lost" in result.reason
        assert result.evaluations <= limit
    assert "failed in the validation: evaluation" in result.reason
    assert np.array_equal(result.command.pose, whole.command.pose)


def test_the_template_case_runs_by_name_and_resolves_its_command(tmp_path):
    done = command("couple", EXAMPLES / "cases" / "external_template.toml", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    process = load_case(tmp_path / "out" / "case.toml").process
    assert process.command[0] == sys.executable
    assert Path(process.command[1]).samefile(EXAMPLES / "process_template.py")


needs_calculix = pytest.mark.skipif(
    shutil.which("ccx") is None, reason="needs ccx (Debian package calculix-ccx)"
)


@needs_calculix
def test_calculix_plate_has_the_stiffness_of_the_clamped_square_plate(tmp_path):
    """F = w D / (0.00560 a^2) [Timoshenko1959], w = t/100; 24 elements a side: 2 %."""
    text = (EXAMPLES / "calculix_plunge.py").read_text()
    program = text.replace("ELEMENTS = 8", "ELEMENTS = 12")
    assert program != text
    time = np.linspace(0.0, 1.0, 3)
    path = tool_path(PART, time, np.outer(time, [0.0, 0.0, -1e-5]))
    force = external(tmp_path, program).evaluate(path).wrench.wrench[0][-1, :3]
    rigidity = 70e9 * 1e-3**3 / (12.0 * (1.0 - 0.33**2))
    expected = 1e-5 * rigidity / (0.00560 * 0.2**2)
    np.testing.assert_allclose(
        PART.rotation.inv().apply(force), [0, 0, expected], rtol=2e-2, atol=1e-9
    )


@needs_calculix
def test_external_calculix_case_shortened_runs_by_name(tmp_path):
    """Large deflections stiffen the sheet: well above the linear plate's force at that depth."""
    program = (EXAMPLES / "calculix_plunge.py").read_text().replace("ELEMENTS = 8", "ELEMENTS = 3")
    (tmp_path / "coarse.py").write_text(program)
    text = (EXAMPLES / "cases" / "external_calculix.toml").read_text()
    text = text.replace("sample_s = 0.04", "sample_s = 0.1")
    case = tmp_path / "external_calculix.toml"
    case.write_text(text.replace("/../calculix_plunge.py", "/coarse.py"))
    run = run_coupling(load_case(case, tmp_path))
    assert run.correction.converged, run.correction.reason
    # Commanded 2 mm, about 3.5 mm with the robot's sag; the linear plate has 29 N/mm.
    assert 2.0 * 29.2 * 3.5 < run.correction.response.wrench.peak_force < 8.0 * 29.2 * 3.5


def measured(file: Path, text: str, **keys: object):
    file.write_text(text)
    return MeasuredWrenchTable.model_validate({"model": "measured", "file": str(file), **keys})


def test_a_record_in_tool_axes_turns_with_the_tool(tmp_path):
    table = measured(
        tmp_path / "w.csv", "time,fx,fy,fz,mx,my,mz\n0,0,0,0,0,0,0\n1,10,20,30,1,2,3\n"
    )
    process, path = table.process(task()), task().desired
    wrench = process.evaluate(path).wrench.wrench[0]
    expected = np.outer(path.time, [10.0, 20.0, 30.0])
    np.testing.assert_allclose(wrench[:, :3], path.rotations[0].apply(expected), atol=1e-12)
    turned = path.displaced(np.array([0, 0, 0, 0.1, 0.2, 0.3]))
    moments = process.evaluate(turned).wrench.wrench[0][:, 3:]
    np.testing.assert_allclose(
        moments, turned.rotations[0].apply(np.outer(path.time, [1.0, 2.0, 3.0])), atol=1e-12
    )


def test_a_record_over_distance_belongs_to_the_place(tmp_path):
    """fx = 100 N times the share of the way, whatever the speed; no moments measured."""
    path = task().desired
    length = arc_length(path.position[0])[-1]
    table = measured(
        tmp_path / "w.csv", f"distance,fx,fy,fz\n0,0,0,0\n{length},100,0,0\n", frame="base"
    )
    wrench = table.process(task()).evaluate(path).wrench.wrench[0]
    np.testing.assert_allclose(
        wrench[:, 0], 100.0 * arc_length(path.position[0]) / length, atol=1e-10
    )
    assert np.all(wrench[:, 1:] == 0.0)
    middle = wrench[10, 0]
    assert middle == pytest.approx(26.0, abs=2.0)  # a quarter of the way at half time


BAD_RECORDS = {
    "time,fx,fy,fz\n0,0,0,0\n0.9,0,0,0\n": "at least 0 to 1 s for the tool path, got 0 to 0.9 s",
    "fx,fy,fz\n0,0,0\n": "either a column time or a column distance",
    "time,distance,fx,fy,fz\n0,0,0,0,0\n": "either a column time or a column distance",
    "time,fx,fy\n0,0,0\n": "columns fz are missing",
    "time,fx,fy,fz,mx\n0,0,0,0,0\n": "columns my, mz are missing",
    "time,fx,fy,fz\n0,0,0,0\n0.7,0,0,0\n0.6,0,0,0\n": (
        "time: expected rising values, got 0.6 s after 0.7 s in row 3"
    ),
}


@pytest.mark.parametrize("text", BAD_RECORDS)
def test_a_bad_record_is_refused(tmp_path, text):
    with pytest.raises(CaseError, match=BAD_RECORDS[text]):
        measured(tmp_path / "w.csv", text).process(task())


def test_a_measured_case_couples_in_two_evaluations(tmp_path):
    """The record does not ask where the tool is: the second evaluation repeats the first."""
    text = (LINE_CASE).read_text()
    begin = text.index("[process]")
    rest = text[text.index("[coupling]") :]
    record = '[process]\nmodel = "measured"\nfile = "record.csv"\nframe = "part"\n\n'
    (tmp_path / "case.toml").write_text(text[:begin] + record + rest)
    end = load_case(LINE_CASE).desired.time[-1]
    table = np.zeros((2, 7))
    table[1, [0, 3]] = end, 200.0
    write_table(tmp_path / "record.csv", ("time", *WRENCH_COLUMNS), table)
    run = run_coupling(load_case(tmp_path / "case.toml"))
    assert run.correction.converged
    assert run.correction.evaluations == 2
    assert run.correction.response.wrench.peak_force == pytest.approx(200.0)
