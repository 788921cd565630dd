"""A case whose robot was measured to do more than its model: [discrepancy]."""

from pathlib import Path

import numpy as np
import pytest
from line_case import line_case, moving_line
from scipy.spatial.transform import Rotation

from coupling.case.file import load_case
from coupling.errors import CaseError
from coupling.path.discrepancy import Discrepancy
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, poses
from coupling.path.linear import interpolate_rows
from coupling.run.execute import run_compensation
from coupling.run.folder import write_run


def waves(desired: ToolPath, size: float = 1e-4, count: int = 60) -> Discrepancy:
    """0.1 mm and 0.1 mrad, a wave along the path."""
    time = np.linspace(desired.time[0], desired.time[-1], count)
    phase = 2.0 * np.pi * (time - time[0]) / (time[-1] - time[0])
    deviation = size * np.stack(
        [
            np.sin(phase),
            np.cos(phase),
            np.sin(2.0 * phase),
            np.cos(phase),
            0.0 * phase,
            0.0 * phase,
        ],
        axis=1,
    )
    return Discrepancy(time, interpolate_rows(time, desired.time, desired.position[0]), deviation)


# Without backlash a gear does not cross elsewhere.
LINEAR = (('"backlash"', '"linear"'),)


def with_table(folder: Path, discrepancy: str) -> Path:
    (folder / "beyond.csv").write_text(discrepancy)
    file = folder / "measured.toml"
    file.write_text(moving_line(*LINEAR) + '\n[discrepancy]\nfile = "beyond.csv"\n')
    return file


def test_the_models_path_is_the_one_that_the_real_tool_makes_the_desired_one_of():
    """model and real are each other's inverse to second order of the turn, at rest at both ends."""
    time = np.linspace(0.0, 2.0, 201)
    turned = Rotation.from_euler("z", 0.1 * time[:, None])
    path = ToolPath(time, poses(np.stack([time, 0.0 * time, 0.0 * time], axis=1), turned))
    own = waves(path)
    back = own.real(own.model(path)).deviation_from(path)[0]
    assert np.abs(back).max() < 1e-12
    ends = own.at(np.array([-1.0, 0.0, 1e-3, 2.0 - 1e-3, 2.0, 3.0]))
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[4], ends[5])
    assert np.abs(ends[2] - ends[1]).max() < 1e-7  # rate and acceleration are zero


def test_another_frame_sees_the_same_displacements():
    time = np.linspace(0.0, 1.0, 11)
    path = ToolPath(time, poses(np.outer(time, [1.0, 0.5, 0.2]), Rotation.identity(11)))
    frame = Frame.of_rpy([0.1, 0.2, -0.3], [0.3, -0.5, 1.0])
    own = waves(path, count=11)
    seen = own.transformed(frame)
    moved = frame.points(own.real(path).position[0])
    np.testing.assert_allclose(seen.position + seen.deviation[:, :3], moved, atol=1e-12)


def test_the_command_puts_the_measured_robot_on_its_path(tmp_path):
    """The model goes beside it by what the robot does beyond; the run's paths are those of the robot."""
    plain = line_case(tmp_path, "native", *LINEAR)
    beyond = waves(plain.desired)
    case = load_case(with_table(tmp_path, beyond.text()))
    run = run_compensation(case)
    assert run.correction.converged
    off = run.correction.achieved.deviation_from(run.desired)[0]
    assert np.abs(off[:, :3]).max() < 2e-6
    without = run_compensation(plain)
    moved = run.correction.command.position[0] - without.correction.command.position[0]
    wanted = -beyond.at(run.correction.command.time)[:, :3]
    inner = slice(20, -20)  # both begin and end at rest, on the cycle of the controller
    np.testing.assert_allclose(moved[inner], wanted[inner], atol=3e-6)
    (tmp_path / "run").mkdir()
    write_run(tmp_path / "run", case, run)
    again = load_case(tmp_path / "run" / "case.toml")
    assert again.robots[0].discrepancy is not None
    np.testing.assert_allclose(again.robots[0].discrepancy.deviation, beyond.deviation, atol=1e-16)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("time,", "t,", 1), "columns time are missing"),
        (lambda text: "\n".join(text.splitlines()[:1]) + "\n", "got none"),
        (lambda text: text.replace("\n", "\nnan,0,0,0,0,0,0,0,0,0\n", 1), "finite"),
        (lambda text: "\n".join([text.splitlines()[0], *text.splitlines()[:0:-1]]) + "\n", "time"),
        (lambda text: "\n".join(text.splitlines()[:-20]) + "\n", "measure this path"),
    ],
)
def test_a_table_that_is_none_of_the_path_is_refused(tmp_path, change, words):
    text = waves(line_case(tmp_path, "native").desired).text()
    with pytest.raises(CaseError, match=words):
        load_case(with_table(tmp_path, change(text)))


def test_a_table_of_another_path_is_refused_with_the_distance(tmp_path):
    own = waves(line_case(tmp_path, "native").desired)
    beside = Discrepancy(own.time, own.position + np.array([0.0, 0.01, 0.0]), own.deviation)
    with pytest.raises(CaseError, match="10 mm beside it"):
        load_case(with_table(tmp_path, beside.text()))
