"""Commands from a run folder or a table of joint angles become the programs of their robots."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_tables import MIDDLES, NAMES, WAY, rows, written
from wall_case import WALL_CASE

from coupling.case.file import load_case
from coupling.export.commands import command_of_table
from coupling.export.exported_program import ExportOptions
from coupling.export.exporting import export_commands
from coupling.export.interpolated import drive_motion
from coupling.files.controller_axes import controller_axes
from coupling.files.robot_file import find_robot, load_robot
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.length_text import format_um
from coupling.programs.languages import LANGUAGES, read_program
from coupling.robot.robot_fmu import DEFAULT_KIND
from coupling.run.execute import run_compensation
from coupling.run.fmu_pool import FmuPool
from coupling.run.folder import write_run
from elastic_robot.description import Robot


def tools(robot: Robot, motions: list[JointPath], instants: np.ndarray) -> list[ToolPath]:
    """Return the paths of the moving robot's tool without a process."""
    with FmuPool(DEFAULT_KIND) as models:
        moving = models.of(robot, "backlash").fmu
        none = WrenchHistory.none(instants)
        return [moving.simulate(motion, none, "dynamic") for motion in motions]


@pytest.mark.parametrize(
    ("robot", "language", "targets"),
    [
        ("icme2008", "krl", "cartesian"),
        ("kuka_kr210", "krl", "joints"),
        ("kuka_kr210", "csv", "joints"),
        ("abb_irb7600", "rapid", "joints"),
        ("fanuc_r2000ic", "fanuc", "cartesian"),
    ],
)
def test_a_program_of_a_table_moves_the_robot_as_the_table_does(
    tmp_path, command, robot, language, targets
):
    """Read again without the table, and simulated: at most 5 um are lost, as the summary says."""
    table = rows(robot)
    file = written(tmp_path / "way.csv", table)
    typed = ["--robot", robot, "--to", language, "--targets", targets]
    done = command("export", file, *typed)
    assert done.returncode == 0, done.stdout + done.stderr
    place = tmp_path / "way" / language
    assert f"Programs: {place}" in done.stdout
    (says,) = json.loads((place / "export.json").read_text())["robots"]
    name = "WAY" if language == "fanuc" else "way"
    program = read_program(place / f"{name}{LANGUAGES[language].ending}")
    description, axes = load_robot(find_robot(robot)), controller_axes(find_robot(robot), 6)
    motion = drive_motion(program, description, axes, 0.004, 0.0)
    instants = np.arange(251) * 0.004
    motion = JointPath(np.append(motion.time[:-1], max(motion.time[-1], 1.0)), motion.q)
    own = JointPath(table[:, 0], (table[:, 1:],))
    read, given = tools(description, [motion, own], instants)
    loss = read.distance_to(given).max()
    assert loss <= 5e-6
    assert loss == pytest.approx(says["loss_m"], abs=2e-9)
    assert says["deviation_of_command_m"] is None
    assert says["deviation_of_file_m"] is None
    assert f"loss {format_um(says['loss_m'])} um" in done.stdout
    # Its base is the controller's own robot frame.
    np.testing.assert_allclose(says["base"], [0, 0, 0, 0, 0, 0, 1], atol=1e-15)


def test_rates_and_accelerations_of_a_table_count(tmp_path):
    """Three rows of a quintic: a spline of their angles alone would be elsewhere."""
    share = np.array([0.0, 0.5, 1.0])
    rise = 10 * share**3 - 15 * share**4 + 6 * share**5
    rate = 30 * share**2 - 60 * share**3 + 30 * share**4
    bend = 60 * share - 180 * share**2 + 120 * share**3
    way = np.array([0.1, -0.05, 0.08, 0.02, 0.05, 0.1])
    middle = np.deg2rad(MIDDLES["icme2008"])
    table = np.column_stack(
        [share, middle + rise[:, None] * way, rate[:, None] * way, bend[:, None] * way]
    )
    names = (*NAMES, *(f"qd{i}" for i in range(1, 7)), *(f"qdd{i}" for i in range(1, 7)))
    file = written(tmp_path / "way.csv", table, names)
    (found,) = export_commands(
        command_of_table(file, "icme2008"), ExportOptions(LANGUAGES["csv"], "joints")
    )
    angles = np.array([move.joints for move in LANGUAGES["csv"].read(found.files).timed])
    at = np.arange(251) * 0.004
    exact = middle + (10 * at**3 - 15 * at**4 + 6 * at**5)[:, None] * way
    np.testing.assert_allclose(angles, exact, atol=1e-12)


def test_the_clock_of_a_table_may_begin_anywhere(tmp_path):
    """Seconds since 1970 in dyadic rows: the same files."""
    krl, texts = LANGUAGES["krl"], []
    for start in (0.0, 1.75e9, -7.0):
        file = written(tmp_path / "way.csv", rows() + start * (np.arange(7) == 0))
        commands = command_of_table(file, "icme2008")
        (found,) = export_commands(commands, ExportOptions(krl, "cartesian"))
        texts.append([one.text for one in found.files])
    assert texts[1] == texts[0]
    assert texts[2] == texts[0]


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """The run of a line of 2.3 s on a robot whose base is turned."""
    folder = tmp_path_factory.mktemp("edited")
    text = WALL_CASE.format(robot="icme2008", home=MIDDLES["icme2008"], part=[1.4, 0.6, 0.5])
    text = text.replace("feed_m_s = 0.1", "feed_m_s = 0.01")
    text = text.replace("home_deg", "base_rpy_deg = [10.0, 5.0, 20.0]\nhome_deg")
    (folder / "case.toml").write_text(text)
    (folder / "run").mkdir()
    case = load_case(folder / "case.toml")
    done = run_compensation(case)
    assert done.correction.converged
    write_run(folder / "run", case, done)
    return folder / "run"


def test_what_does_not_go_together_is_refused(run, command):
    way = written(run.parent / "way.csv", WAY)
    nowhere = run.parent / "nowhere"
    for typed, message in (
        ([way], "expected a run folder, or the CSV of a command with --robot, got a file"),
        ([nowhere], "with --robot, got nothing of that name"),
        ([run, "--robot", "icme2008"], "--robot: expected a command as CSV with this option"),
        ([way, "--robot", "icme208"], "got 'icme208': did you mean 'icme2008'?"),
        ([nowhere.with_suffix(".csv"), "--robot", "icme2008"], "cannot be read: No such file"),
        ([run.parent], "name a run folder"),
    ):
        done = command("export", *typed, "--to", "krl", "-o", run.parent / "programs")
        assert done.returncode == 2, typed
        assert message in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
    assert not (run.parent / "programs").exists()


def test_every_language_that_is_asked_for_is_written_in_its_folder(run, tmp_path, command):
    """And none of them where one cannot be."""
    place = tmp_path / "all"
    typed = ("--to", "krl", "--to", "rapid", "--to", "csv", "--name", "WAY", "-o", place)
    done = command("export", run, *typed)
    assert done.returncode == 0, done.stderr
    for language in ("krl", "rapid", "csv"):
        assert (place / language / f"WAY{LANGUAGES[language].ending}").is_file()
        assert f"Programs: {place / language}" in done.stdout.replace("\n", "")
    none = tmp_path / "none"
    done = command("export", run, "--to", "krl", "--to", "rapit", "-o", none)
    assert done.returncode == 2
    assert "expected one of krl, rapid, fanuc, csv, got 'rapit'" in done.stderr
    done = command("export", run, "--to", "csv", "--to", "krl", "-o", place)
    assert "holds an export already" in done.stderr
    assert not none.exists()
