"""Which trajectory files are read and which refused, by the C core and by a reader in Python alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from native_core import Core, CoreError
from random_robots import make_robot
from table_file import parse_table, read_table
from trajectory_files import DATA, INTEGERS, PLACES, READ, REFUSED, damaged_files, npz

from elastic_robot.errors import TrajectoryError
from elastic_robot.trajectory import Trajectory, trajectory_of

TIMES = np.array([0.0, 0.1, 0.5, 0.8, 1.0])


def read_trajectory(file: Path, joints: int) -> Trajectory:
    try:
        return trajectory_of(*read_table(file), joints)
    except (ValueError, TrajectoryError) as cause:
        reason = str(cause).removeprefix("trajectory: ")
        raise TrajectoryError(f"trajectory {file}: {reason}") from cause


@pytest.fixture(scope="module")
def core() -> Core:
    return Core(make_robot(1, 1))


def _in_c(core: Core, file: Path) -> np.ndarray:
    core.reset("linear", 0.0, np.zeros(1), np.zeros(6), path=file, quasistatic=True)
    return core.drives(TIMES, 1)


def _refusals(core: Core, file: Path) -> list[str]:
    with pytest.raises(TrajectoryError) as python:
        read_trajectory(file, 1)
    with pytest.raises(CoreError) as native:
        _in_c(core, file)
    return [str(python.value), str(native.value)]


@pytest.mark.parametrize("name", READ)
def test_what_is_read_is_one_motion(core, tmp_path, name):
    file, plain = tmp_path / name, tmp_path / "plain.csv"
    plain.write_bytes(READ["plain.csv"])
    expected = read_trajectory(plain, 1).at(TIMES)
    file.write_bytes(READ[name])
    np.testing.assert_array_equal(read_trajectory(file, 1).at(TIMES), expected)
    np.testing.assert_allclose(_in_c(core, file), expected, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(expected[0, [0, 2, 4], 0], DATA[:, 1])


@pytest.mark.parametrize("name", INTEGERS)
def test_whole_numbers_are_numbers(core, tmp_path, name):
    file = tmp_path / name
    file.write_bytes(INTEGERS[name])
    expected = read_trajectory(file, 1).at(TIMES)
    np.testing.assert_allclose(_in_c(core, file), expected, rtol=0, atol=1e-11)
    assert expected[0, -1, 0] == 2.0


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_is_told_with_file_and_reason(core, tmp_path, name):
    file, (content, reason) = tmp_path / name, REFUSED[name]
    file.write_bytes(content)
    for said in _refusals(core, file):
        assert said.startswith(f"trajectory {file}: ")
        assert reason in said
        assert "\n" not in said


@pytest.mark.parametrize("name", PLACES)
def test_what_is_no_file_is_said_at_once(core, tmp_path, name):
    file, (make, reason) = tmp_path / name, PLACES[name]
    make(file)
    assert _refusals(core, file) == [f"trajectory {file}: {reason}"] * 2


def test_an_archive_cut_anywhere_is_refused(core, tmp_path):
    content, file = npz(), tmp_path / "cut.npz"
    for length in range(len(content)):
        with pytest.raises((ValueError, TrajectoryError)):
            trajectory_of(*parse_table(content[:length], True), 1)
        file.write_bytes(content[:length])
        with pytest.raises(CoreError):
            core.read(file)


def test_damaged_files_have_one_motion_and_mostly_one_verdict(core, tmp_path):
    """Where both read a damaged file they read the same numbers.

    Python's zipfile and the core look at other parts of what an archive tells twice.
    """
    refused = apart = 0
    for content, is_npz in damaged_files(seed=1, count=4000):
        try:
            expected = trajectory_of(*parse_table(content, is_npz), 1)
        except (ValueError, TrajectoryError):
            expected = None
        file = tmp_path / ("damaged.npz" if is_npz else "damaged.csv")
        file.write_bytes(content)
        try:
            core.read(file)
        except CoreError:
            refused += expected is None
            apart += expected is not None
            continue
        if expected is None:
            apart += 1
            continue
        times = np.linspace(expected.start, expected.end, 5)
        motion = expected.at(times)
        tolerance = 1e-9 * np.abs(motion).max(axis=(1, 2), keepdims=True)
        assert np.all(np.abs(core.drives(times, 1) - motion) <= tolerance), content
    assert 1000 < refused < 3900
    assert apart < 100
