"""A program of one's own as a process: its folder, its output, its time, CalculiX."""

import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import command
from own_program import PART, SPRINGS, external, task
from places import EXAMPLES

from coupling.case.file import load_case
from coupling.errors import CaseError, ProcessError
from coupling.events import Event, ProcessMessage
from coupling.run.execute import run_coupling
from coupling.toolpaths.part import tool_path


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
    names = ("output.txt", "path.csv", "wrench.csv")
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
    "no answer": ("print('done')", ["wrote no wrench.csv", "last lines:\ndone"]),
    "columns": (
        "open('wrench.csv', 'w').write('time,fx\\n0,0\\n')",
        ["gave an invalid result", "columns fy, fz, mx, my, mz are missing"],
    ),
    "not numbers": (
        SPRINGS.replace("header=header", 'header=header + "\\n1,2,3,4,five,6,7"'),
        ["gave an invalid result", "not a table of numbers", "five"],
    ),
    "NaN": (
        SPRINGS.replace("2e5 ", "float('nan') "),
        ["gave an invalid result", "fz: expected a finite number, got nan in row 1"],
    ),
    "rows": (
        SPRINGS.replace('"wrench.csv", wrench', '"wrench.csv", wrench[1:]'),
        ["expected 21 rows, as in path.csv, and two of the same time", "got 20 rows of 20 times"],
    ),
    "times": (
        SPRINGS.replace('path["time"]', '1.001 * path["time"]'),
        ["expected 1 s, as in path.csv", "got 1.001 s in row 21"],
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


@pytest.mark.parametrize(
    ("mode", "words"), [(0o755, "begin a script with #!"), (0o644, "is not executable: chmod +x")]
)
def test_a_script_that_cannot_be_started_says_how_it_can(tmp_path, mode, words):
    script = tmp_path / "run.sh"
    script.write_text("echo formed\n")
    script.chmod(mode)
    with pytest.raises((CaseError, ProcessError)) as failure:
        external(tmp_path, "", command=[str(script)]).evaluate(task().desired)
    assert words in str(failure.value)


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


def test_the_template_case_runs_by_name_and_resolves_its_command(tmp_path):
    command(
        "couple",
        "-v",
        EXAMPLES / "cases" / "external_template.toml",
        "-o",
        tmp_path / "out",
        exits=0,
    )
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
