"""Forces that pull a tool into the part are remarked: most likely those on the part."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
import tomlkit
from places import CASES, LINE_CASE

from coupling.case.file import load_case
from coupling.files.csv_table import write_table
from coupling.path.histories import WrenchHistory
from coupling.run.execute import run_compensation, run_coupling
from coupling.run.plausibility import remarks
from coupling.toolpaths.tilt import APPROACH

# Force on a tool along its approach and across: in forming by a program, in milling with helical edges.
FORCES = {
    "pushes": (-300.0, 90.0, False),
    "pulls": (300.0, 90.0, True),
    "a helical mill": (40.0, 100.0, False),
    "none": (0.0, 0.0, False),
}


@pytest.mark.parametrize("kind", FORCES)
def test_a_force_that_pulls_the_tool_into_the_part_is_remarked(kind):
    along, across, is_remarked = FORCES[kind]
    case = load_case(CASES / "external_template.toml")
    path = case.desired
    touches = np.linspace(0.0, 1.0, len(path.time)) > 0.7  # most of the way is in air
    in_tool = np.outer(touches, along * APPROACH + [0.0, across, 0.0])
    force = path.rotations[0].apply(in_tool)
    said = remarks(case, WrenchHistory.of_forces(path.time, [force]))
    assert any("pulls it into the part" in text for text in said) is is_remarked


def test_peaks_of_an_iteration_that_diverges_do_not_hide_a_wrong_sign():
    case = load_case(CASES / "external_template.toml")
    path = case.desired
    along = np.full((len(path.time), 1), 300.0)
    along[::20] = -20.0 * along[::20]
    force = path.rotations[0].apply(along * APPROACH)
    assert force.mean(axis=0) @ path.rotations[0][0].apply(APPROACH) < 0.0
    said = remarks(case, WrenchHistory.of_forces(path.time, [force]))
    assert any("pulls it into the part" in text for text in said)


def test_shipped_processes_push(tmp_path):
    """Their signs are tested against their laws: nothing is said whatever they answer."""
    case = load_case(CASES / "cone.toml")
    force = case.desired.rotations[0].apply(np.tile(300.0 * APPROACH, (len(case.desired.time), 1)))
    said = remarks(case, WrenchHistory.of_forces(case.desired.time, [force]))
    assert not any("pulls" in text for text in said)


@pytest.mark.parametrize("run", [run_coupling, run_compensation])
def test_runs_say_so(run, tmp_path):
    """A record of the force on the sensor: 50 N towards the part."""
    tables = tomllib.loads(LINE_CASE.read_text())
    tables["process"] = {"model": "measured", "file": "record.csv", "frame": "part"}
    (tmp_path / "case.toml").write_text(tomlkit.dumps(tables))
    write_table(
        tmp_path / "record.csv", ("time", "fx", "fy", "fz"), [[0, 0, 0, -50], [99, 0, 0, -50]]
    )
    (said,) = [text for text in run(load_case(tmp_path / "case.toml")).remarks if "pulls" in text]
    assert "mean along its approach 50 N, mean magnitude 50 N" in said
    assert "the sign, which is that of the force on the tool, not on the part" in said
