"""An evaluation that fails is tried again, every failed try is told and kept."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import command
from killing import start, wait_until
from own_program import PLAIN_SPRINGS
from places import LINE_CASE, TESTS

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.errors import CaseError, HostError, ProcessError, StoreError
from coupling.events import Event, WarningEvent
from coupling.path.histories import ToolPath
from coupling.process import PROCESSES, ProcessTable
from coupling.store import EvaluatedProcess

PATH = ToolPath(np.linspace(0.0, 1.0, 5), np.tile([0.0, 0, 0, 0, 0, 0, 1.0], (5, 1)))
# Fails in every second try, and leaves what it was at.
EVERY_SECOND = (
    "import pathlib, sys\n"
    "tries = pathlib.Path('../../tries')\n"
    "count = 1 + (int(tries.read_text()) if tries.exists() else 0)\n"
    "tries.write_text(str(count))\n"
    "if count % 2 == 1:\n"
    "    open('solver.log', 'w').write(f'lost in try {count}')\n"
    "    sys.exit('licence lost')\n"
)


def program_case(folder: Path, program: str, keys: str, *words: str) -> Path:
    """Write the line's case with a program and keys of its table; return its file."""
    folder.mkdir(exist_ok=True)
    (folder / "program.py").write_text(program)
    text = LINE_CASE.read_text()
    head, tail = text[: text.index("[process]")], text[text.index("[coupling]") :]
    line = ["{python}", "{case}/program.py", *words]
    table = f'[process]\nmodel = "external"\ncommand = {line!r}\ntime_limit_s = 30.0\n{keys}\n\n'
    case = folder / "case.toml"
    case.write_text(head + table.replace("time_limit_s = 30.0\ntime", "time") + tail)
    return case


def loaded(folder: Path, program: str, keys: str, *words: str) -> Case:
    return load_case(program_case(folder, program, keys, *words), folder / "work")


def names(folder: Path) -> list[str]:
    return sorted(place.name for place in (folder / "evaluations").iterdir())


def test_a_program_that_fails_every_second_time_answers_with_one_retry(tmp_path):
    case = loaded(tmp_path, EVERY_SECOND + PLAIN_SPRINGS, "retries = 1")
    told: list[Event] = []
    process = case.evaluated_process(watch=told.append)
    for number in (1, 2):
        assert process.evaluate(case.desired).wrench.peak_force == pytest.approx(400.0)
        warned = [event.text for event in told if isinstance(event, WarningEvent)]
        assert len(warned) == number
        assert warned[-1].startswith(
            f"try 1 of 2 failed, the next begins: evaluation 000{2 * number - 1}"
        )
        assert "licence lost" in warned[-1]
    assert names(tmp_path / "work") == ["0001", "0002", "0003", "0004"]
    kept = tmp_path / "work" / "evaluations" / "0003"
    assert (kept / "solver.log").read_text() == "lost in try 3"
    assert "exit status 1" in (kept / "failure.txt").read_text()
    assert (kept / "path.csv").is_file()


def test_a_run_with_such_a_program_leaves_the_same_bytes(tmp_path):
    runs = {}
    for name, failing in (("failing", EVERY_SECOND), ("sound", "")):
        case = program_case(tmp_path / "case", failing + PLAIN_SPRINGS, "retries = 1")
        out = tmp_path / name / "run"
        done = command("couple", "-v", case, "-o", out, exits=0)
        runs[name] = out
        assert ("Warning: try 1 of 2 failed" in done.stdout) == (name == "failing")
    one, two = (run / "wrench.csv" for run in runs.values())
    assert one.read_bytes() == two.read_bytes()
    warnings = json.loads((runs["failing"] / "run.json").read_text())["warnings"]
    evaluations = json.loads((runs["failing"] / "result.json").read_text())["process_evaluations"]
    assert len(warnings) == evaluations


@pytest.mark.parametrize(
    ("program", "keys", "cause"),
    [
        ("import sys; sys.exit('no licence')", "", "exit status 1"),
        ("import time; time.sleep(60)", "time_limit_s = 0.5\n", "time limit of 0.5 s"),
        ("print('done')", "", "wrote no wrench.csv"),
    ],
)
def test_one_that_always_fails_says_how_often_it_was_tried(tmp_path, program, keys, cause):
    case = loaded(tmp_path, program, f"{keys}retries = 2")
    told: list[Event] = []
    with pytest.raises(ProcessError) as failure:
        case.evaluated_process(watch=told.append).evaluate(case.desired)
    said = str(failure.value)
    assert said.startswith("all 3 tries failed, the last one: evaluation 0003: ")
    assert cause in said
    warned = [event.text for event in told if isinstance(event, WarningEvent)]
    assert [text[:12] for text in warned] == ["try 1 of 3 f", "try 2 of 3 f"]
    assert all(cause in text for text in warned)
    assert names(tmp_path / "work") == ["0001", "0002", "0003"]


def test_without_the_key_the_first_failure_is_the_last(tmp_path):
    case = loaded(tmp_path, EVERY_SECOND + PLAIN_SPRINGS, "")
    with pytest.raises(ProcessError, match=r"^evaluation 0001: .*exit status 1"):
        case.evaluated_process().evaluate(case.desired)
    assert names(tmp_path / "work") == ["0001"]


def test_the_next_try_finds_the_restart_files_of_the_one_that_failed(tmp_path):
    steps = (
        "import pathlib, sys\n"
        "kept = pathlib.Path(sys.argv[1]) / 'steps'\n"
        "done = int(kept.read_text()) if kept.exists() else 0\n"
        "kept.write_text(str(done + 1))\n"
        "if done < 3: sys.exit(f'lost after {done} steps')\n"
    )
    case = loaded(tmp_path, steps + PLAIN_SPRINGS, "retries = 3", "{restart}")
    process = case.evaluated_process()
    process.evaluate(case.desired)
    assert names(tmp_path / "work") == ["0001", "0002", "0003", "0004"]
    other = case.desired.displaced(np.full(6, 1e-9))  # has no restart files
    process.evaluate(other)
    assert len(names(tmp_path / "work")) == 8


def test_a_run_that_is_killed_in_the_second_try_begins_that_anew(tmp_path):
    """kill -9 of the run alone: the first try, which has failed, is still there."""
    program = (
        "import pathlib, sys, time\n"
        "begun = pathlib.Path('../../../begun')\n"
        "with begun.open('a') as log: log.write('x')\n"
        "if begun.read_text() == 'x': sys.exit('node lost')\n"
        "if begun.read_text() == 'xx': time.sleep(60)\n"
    )
    case = program_case(tmp_path / "case", program + PLAIN_SPRINGS, "retries = 1")
    arguments = ("couple", "-v", case, "-o", tmp_path / "run")
    run = start(tmp_path / "output.txt", *arguments)
    wait_until(lambda: (tmp_path / "begun").exists() and (tmp_path / "begun").read_text() == "xx")
    run.kill()
    assert start(tmp_path / "output.txt", *arguments).status() == 0
    said = (tmp_path / "output.txt").read_text()
    assert said.count("try 1 of 2 failed") == 1
    evaluations = json.loads((tmp_path / "run" / "result.json").read_text())["process_evaluations"]
    assert len((tmp_path / "begun").read_text()) == evaluations + 2
    assert names(tmp_path / "run")[:2] == ["0001", "0003"]
    assert (tmp_path / "run" / "evaluations" / "0001" / "failure.txt").exists()


class Failing:
    identity = "failing"

    def __init__(self, error: BaseException) -> None:
        self.error, self.asked = error, 0

    def evaluate(self, path: ToolPath) -> None:
        self.asked += 1
        raise self.error


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), HostError("robot"), StoreError("disk"), CaseError("case")]
)
def test_what_is_no_failure_of_the_process_is_not_tried_again(error):
    process = Failing(error)
    with pytest.raises(type(error)):
        EvaluatedProcess(process, tries=5).evaluate(PATH)  # type: ignore[arg-type]
    assert process.asked == 1


OWN = (
    "from pathlib import Path\n"
    "from coupling.path.histories import WrenchHistory\n"
    "from coupling.process import ProcessResponse, WithIdentity, ProcessTable\n"
    "class Own(WithIdentity):\n"
    "    def evaluate(self, path):\n"
    "        log = Path(__file__).with_name('tries')\n"
    "        with log.open('a') as out: out.write('x')\n"
    "        if len(log.read_text()) < 3: raise OSError('no licence')\n"
    "        return ProcessResponse(WrenchHistory.none(path.time))\n"
    "class Table(ProcessTable):\n"
    "    WITHOUT_EFFECT = frozenset({'note'})\n"
    "    note: str = ''\n"
    "    def process(self, task): return Own(identity=self.identity(task))\n"
)


def own_case(folder: Path, retries: object) -> Case:
    (folder / "own.py").write_text(OWN)
    text = LINE_CASE.read_text().replace('"elastic-wall"', '"own.py:Table"')
    text = text.replace("stiffness_N_m = 2.0e5", f"retries = {retries}")
    (folder / "case.toml").write_text(text)
    return load_case(folder / "case.toml", folder / "work")


def test_a_process_of_ones_own_has_the_key_for_nothing(tmp_path):
    """Its exception counts as a failure, the answers of all counts of tries have one identity."""
    case = own_case(tmp_path, 2)
    assert case.evaluated_process().evaluate(case.desired).wrench.peak_force == 0.0
    assert len((tmp_path / "tries").read_text()) == 3
    assert own_case(tmp_path, 0).process.identity == case.process.identity
    (tmp_path / "tries").unlink()
    process = own_case(tmp_path, 1).evaluated_process()
    with pytest.raises(ProcessError, match=r"^all 2 tries failed, the last one: .*OSError: no lic"):
        process.evaluate(case.desired)


def test_an_fmu_has_it_too(tmp_path):
    """It declares its variables, but has no library for any machine."""
    with zipfile.ZipFile(tmp_path / "wall.fmu", "w") as archive:
        archive.write(TESTS / "process" / "process_fmus" / "wall.xml", "modelDescription.xml")
    text = LINE_CASE.read_text().replace('"elastic-wall"', '"fmu"\nfile = "wall.fmu"')
    names = 'retries = 1\ninputs = {z = "height"}\noutputs = {fz = "force"}'
    (tmp_path / "case.toml").write_text(text.replace("stiffness_N_m = 2.0e5", names))
    case = load_case(tmp_path / "case.toml")
    with pytest.raises(ProcessError, match=r"^all 2 tries failed, the last one: .*wall\.fmu"):
        case.evaluated_process().evaluate(case.desired)


@pytest.mark.parametrize("retries", ["-1", "21", "1.5", '"twice"'])
def test_a_number_of_retries_that_is_none_is_refused(tmp_path, retries):
    with pytest.raises(CaseError, match="process: retries: expected a"):
        own_case(tmp_path, retries)


@pytest.mark.parametrize("model", PROCESSES)
def test_only_what_can_fail_takes_the_key(model):
    """A shipped model answers alike each time: the key would do nothing there."""
    takes_it = model in ("external", "fmu")
    assert ("retries" in PROCESSES[model].model_fields) == takes_it
    assert issubclass(PROCESSES[model], ProcessTable) == takes_it
