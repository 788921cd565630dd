"""A process that answers one path differently is found, and named as the cause."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import command
from killing import start, wait_until
from line_case import moving_line
from places import LINE_CASE

from coupling.check.run_effort import check_repeatability
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import ProcessRequest
from coupling.results.repeatability import Repeatability

# 300 N against the tool below the sheet, and noise that is another one every time.
NOISY = """
import csv, random
random.seed({seed})
with open("path.csv") as asked, open("wrench.csv", "w", newline="") as answer:
    answer.write("time,fx,fy,fz,mx,my,mz\\n")
    for row in csv.DictReader(asked):
        force = 300.0 if float(row["z"]) < 0.0 else 0.0
        told = [random.gauss(mean, {sigma}) for mean in (0.0, 0.0, force)]
        answer.write(",".join(map(repr, [float(row["time"]), *told, 0.0, 0.0, 0.0])) + "\\n")
"""


def with_program(folder: Path, text: str, program: str) -> Path:
    """Write a case whose process is a program; return its file."""
    folder.mkdir(exist_ok=True)
    (folder / "program.py").write_text(program)
    head, tail = text[: text.index("[process]")], text[text.index("[coupling]") :]
    line = ["{python}", "-S", "{case}/program.py"]
    table = f'[process]\nmodel = "external"\ncommand = {line!r}\ntime_limit_s = 30.0\n\n'
    (folder / "case.toml").write_text(head + table + tail)
    return folder / "case.toml"


def answer(forces: np.ndarray) -> WrenchHistory:
    return WrenchHistory.of_forces(np.arange(float(len(forces))), [forces])


def test_the_difference_of_white_noise_is_told_as_it_is():
    """Two answers with 20 N in each of three components are 20 sqrt(6) N rms apart."""
    force = np.tile([0.0, 0.0, 300.0], (20000, 1))
    noise = np.random.default_rng(4).normal(0.0, 20.0, (2, *force.shape))
    found = Repeatability.of(*(answer(force + own) for own in noise))
    assert found.rms == pytest.approx(20.0 * np.sqrt(6.0), rel=0.01)
    assert found.largest == np.linalg.norm(noise[1] - noise[0], axis=1).max()
    assert found.disturbs


def test_rounding_is_no_difference_and_a_little_one_does_not_disturb():
    force = np.tile([0.0, 0.0, 300.0], (10, 1))
    rounded = Repeatability.of(answer(force), answer(force * (1.0 + 1e-9)))
    little = Repeatability.of(answer(force), answer(force * (1.0 + 1e-5)))
    assert rounded.identical
    assert "gave the same forces" in rounded.sentence()
    assert not little.identical
    assert not little.disturbs
    assert "on the same path, by up to 0.003 N" in little.sentence()
    none = Repeatability.of(answer(0.0 * force), answer(0.0 * force))
    assert none.identical
    assert not none.disturbs


def test_a_run_names_the_noise_in_place_of_the_inverse(tmp_path):
    """20 N on 300 N: reason, terminal, report, result.json; the second answer is kept."""
    case = with_program(tmp_path / "case", moving_line(), NOISY.format(seed="", sigma=20.0))
    out = tmp_path / "run"
    done = command("compensate", "-v", case, "-o", out, exits=1)
    figures = json.loads((out / "result.json").read_text())
    assert figures["reason"].startswith(
        "the process gave different forces on the same path, by up to"
    )
    assert "noise or memory" in figures["reason"]
    assert "another inverse" not in figures["reason"]
    assert "NOT CONVERGED: the process gave different forces on the same path" in done.stdout
    assert "the process gave different forces on the same path" in (out / "report.html").read_text()
    told = figures["repeatability"]
    assert told["rms_N"] == pytest.approx(20.0 * np.sqrt(6.0), rel=0.1)
    assert told["peak_N"] > 300.0
    asked = len(list((out / "evaluations").glob("*/wrench.csv")))
    again = list((out / "asked_again" / "evaluations").glob("*/wrench.csv"))
    assert len(again) == 1
    assert figures["process_evaluations"] == asked + 1
    assert len(figures["evaluation_keys"]) == asked
    # From the store the same run ends alike, and the process is asked anew all the same.
    done = command("compensate", "-v", case, "-o", tmp_path / "second")
    second = json.loads((tmp_path / "second" / "result.json").read_text())
    assert not (tmp_path / "second" / "evaluations").exists()
    assert second["outcome"] == figures["outcome"]
    assert second["repeatability"]["rms_N"] not in (0.0, told["rms_N"])


def test_a_run_that_is_killed_while_it_asks_again_goes_on(tmp_path):
    """kill -9: the program that it has begun is ended, and begun again."""
    wait = (
        "import os, pathlib, time\n"
        "if 'asked_again' in os.getcwd():\n"
        "    with open('../../begun', 'a') as log: log.write('x')\n"
        "    time.sleep(1.5)\n"
    )
    text = LINE_CASE.read_text().replace(
        "tolerance_m = 1e-8", "tolerance_m = 1e-8\nmax_evaluations = 3"
    )
    case = with_program(tmp_path / "case", text, wait + NOISY.format(seed="", sigma=20.0))
    arguments = ("couple", "-v", case, "-o", tmp_path / "run")
    run = start(tmp_path / "output.txt", *arguments)
    wait_until((tmp_path / "run.unfinished" / "asked_again" / "begun").exists)
    run.kill()
    assert start(tmp_path / "output.txt", *arguments).status() == 1
    assert (tmp_path / "run" / "asked_again" / "begun").read_text() == "xx"
    figures = json.loads((tmp_path / "run" / "result.json").read_text())
    assert "gave different forces" in figures["reason"]
    assert figures["process_evaluations"] == 4


def test_a_coupling_names_it_too(tmp_path):
    text = LINE_CASE.read_text().replace("sample_s = 0.01", "sample_s = 0.05")
    text = text.replace("tolerance_m = 1e-8", "tolerance_m = 1e-8\nmax_evaluations = 5")
    case = with_program(tmp_path / "case", text, NOISY.format(seed="", sigma=20.0))
    command("couple", "-v", case, "-o", tmp_path / "run", exits=1)
    reason = json.loads((tmp_path / "run" / "result.json").read_text())["reason"]
    assert reason.startswith("the process gave different forces on the same path, by up to")
    assert "the path still changes by up to" in reason


def test_a_process_that_answers_alike_is_not_blamed(tmp_path):
    """Noise that follows from the path: the reason is the iteration's, and zeros say it was asked."""
    text = LINE_CASE.read_text().replace("sample_s = 0.01", "sample_s = 0.05")
    text = text.replace("tolerance_m = 1e-8", "tolerance_m = 1e-8\nmax_evaluations = 3")
    program = NOISY.format(seed='open("path.csv").read()', sigma=20.0)
    case = with_program(tmp_path / "case", text, program)
    command("couple", "-v", case, "-o", tmp_path / "run", exits=1)
    figures = json.loads((tmp_path / "run" / "result.json").read_text())
    assert figures["reason"] == "not converged within 3 evaluations of the process"
    assert figures["repeatability"]["largest_N"] == 0.0
    # Asked again at first, as its forces are uneven, and at the end.
    assert figures["process_evaluations"] == 5
    assert figures["noise"]["counts"] is False


def test_a_memory_is_found(tmp_path):
    """A process of one's own that wears its tool from evaluation to evaluation."""
    (tmp_path / "own.py").write_text(
        "import numpy as np\n"
        "from coupling.path.histories import WrenchHistory\n"
        "from coupling.process import ProcessResponse, WithIdentity, ProcessTable\n"
        "class Own:\n"
        "    count = 0\n"
        "    def __init__(self, identity): self.identity = identity\n"
        "    def evaluate(self, path):\n"
        "        self.count += 1\n"
        "        force = np.tile([0.0, 0.0, 300.0 + 10.0 * self.count], (len(path.time), 1))\n"
        "        return ProcessResponse(WrenchHistory.of_forces(path.time, [force]))\n"
        "class Table(ProcessTable):\n"
        "    def process(self, task): return Own(self.identity(task))\n"
    )
    text = LINE_CASE.read_text().replace('"elastic-wall"', '"own.py:Table"')
    text = text.replace("stiffness_N_m = 2.0e5", "")
    text = text.replace("tolerance_m = 1e-8", "tolerance_m = 1e-8\nmax_evaluations = 4")
    (tmp_path / "case.toml").write_text(text)
    done = command("couple", "-v", tmp_path / "case.toml", "-o", tmp_path / "run")
    reason = json.loads((tmp_path / "run" / "result.json").read_text())["reason"]
    assert done.returncode == 1
    assert "on the same path, by up to 30 N (30 N rms) of 340 N" in reason


def test_check_asks_twice_and_says_so(tmp_path):
    for sigma, words in (
        (20.0, "different forces on the same path"),
        (0.0, "gave the same forces"),
    ):
        case = with_program(tmp_path, LINE_CASE.read_text(), NOISY.format(seed="", sigma=sigma))
        done = command("check", "-v", case, "--evaluate", "-o", tmp_path / "page.html", exits=0)
        assert words in done.stdout
    done = command("check", "-v", LINE_CASE, "--evaluate", "-o", tmp_path / "page.html")
    assert "the same path" not in done.stdout


def test_check_asks_once_what_takes_a_minute():
    class Never:
        def computed(self, path):
            raise AssertionError("asked again")

    path = ToolPath(np.array([0.0, 1.0]), np.zeros((2, 7)))
    request = ProcessRequest(path, answer(np.zeros((2, 3))), 61.0)
    said = check_repeatability(Never(), request)  # type: ignore[arg-type]
    assert "evaluated once, as an evaluation takes 61 s (twice below 60 s)" in said
