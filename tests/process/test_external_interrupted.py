"""Programs that fail on the way, or whose run was killed."""

import json
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from command_line import command
from killing import begin
from own_program import PLAIN_SPRINGS, evaluate, external, task
from places import EXAMPLES
from scipy.spatial.transform import Rotation
from spring_robot import SpringPlanner, SpringRobot, upright

from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.path.histories import ToolPath
from coupling.path.interpolation import SampledPath
from coupling.process import ExternalProgram, ExternalTable
from coupling.robot.cell import Cell, Member
from coupling.solve.correction import Correction
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Loop
from coupling.solve.mirror import Mirror
from coupling.solve.relaxation import Anderson
from coupling.solve.scheme import Outcome
from coupling.toolpaths import Task


def unfinished(workspace: Path, program: str, **keys: object) -> Path:
    """Begin an evaluation in a process of its own, kill that, and return the evaluation's folder."""
    run = begin(evaluate, workspace, program, keys)
    folder = workspace / "evaluations" / "0001"
    while not (folder / "begun").exists():
        assert run.is_alive()
        time.sleep(0.01)
    run.kill()
    run.join()
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


@pytest.mark.parametrize("other", ["nothing", "path", "program"])
def test_a_program_whose_run_was_killed_is_ended_by_the_next_evaluation(tmp_path, other):
    """One of the same path takes the place of its attempt; one of another leaves it there."""
    again = "0 if pathlib.Path('../0002').exists() else 60"
    program = BEGUN + f"time.sleep({again})\n" + PLAIN_SPRINGS
    folder = unfinished(tmp_path, program)
    (left,) = [p for p in psutil.process_iter(["cwd"]) if p.info["cwd"] == str(folder)]
    path = task().desired
    if other == "path":
        path = path.displaced(np.full(6, 1e-9))
    elif other == "program":
        program += "# another"
    assert external(tmp_path, program).evaluate(path).wrench.peak_force > 399.0
    assert not left.is_running() or left.status() == psutil.STATUS_ZOMBIE
    assert begun(tmp_path) == 2
    names = sorted(f.name for f in folder.parent.iterdir())
    assert names == (["0002"] if other == "nothing" else ["0001", "0002"])


def test_a_program_whose_run_was_killed_finds_its_restart_files(tmp_path):
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
    program = BEGUN.replace("pathlib.Path('begun').touch()\n", "") + steps + PLAIN_SPRINGS
    command = ["{python}", "-c", program, "{restart}"]
    folder = unfinished(tmp_path, program, command=command)
    process = external(tmp_path, program, command=command)
    assert process.evaluate(task().desired).wrench.peak_force > 399.0
    assert (tmp_path / "steps").read_text().split() == [str(step) for step in range(10)]
    assert begun(tmp_path) == 2
    assert sorted(f.name for f in folder.parent.iterdir()) == ["0002"]
    other = process.evaluate(task().desired.displaced(np.full(6, 1e-9)))  # has no restart files
    assert other.wrench.peak_force > 399.0
    assert (tmp_path / "steps").read_text().split()[10] == "0"


def counted(limit: int) -> str:
    """Return the template, failing after so many evaluations."""
    return (
        "import pathlib, sys\n"
        f"if int(pathlib.Path.cwd().name) > {limit}: sys.exit('licence lost')\n" + PLAIN_SPRINGS
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
    done = command("couple", "-v", failing_case(tmp_path, 0), "-o", tmp_path / "out", exits=2)
    assert "evaluation 0001" in done.stderr
    assert "licence lost" in done.stderr
    assert "Traceback" not in done.stderr
    kept = tmp_path / "out.unfinished" / "evaluations" / "0001"
    assert str(kept.parent) in done.stderr.replace("\n", "")
    assert (kept / "path.csv").is_file()
    log = json.loads((tmp_path / "out.unfinished" / "run.json").read_text())
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
    for limit in (len(whole.iterations[0].evaluations) + 1, whole.evaluations - 1):
        result = mirrored(tmp_path / str(limit), limit)
        assert result.outcome is Outcome.PROCESS_FAILED
        assert "licence lost" in result.reason
        assert result.evaluations <= limit
    assert "failed in the validation: evaluation" in result.reason
    assert np.array_equal(result.command.pose, whole.command.pose)
