"""Which trajectory files the C core reads and which it refuses; damaged ones beside NumPy's reader."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from native_core import Core, CoreError
from random_robots import make_robot
from trajectory_files import DATA, INTEGERS, PLACES, READ, REFUSED, damaged_files, npz

from elastic_robot.trajectory import Trajectory, trajectory_of

TIMES = np.array([0.0, 0.1, 0.5, 0.8, 1.0])


@pytest.fixture(scope="module")
def core() -> Core:
    return Core(make_robot(1, 1))


def _in_c(core: Core, file: Path) -> np.ndarray:
    core.reset("linear", 0.0, np.zeros(1), np.zeros(6), path=file, quasistatic=True)
    return core.drives(TIMES, 1)


def _refusal(core: Core, file: Path) -> str:
    with pytest.raises(CoreError) as refused:
        _in_c(core, file)
    return str(refused.value)


@pytest.mark.parametrize("name", READ)
def test_what_is_read_is_one_motion(core, tmp_path, name):
    file = tmp_path / name
    file.write_bytes(READ[name])
    expected = Trajectory(DATA[:, 0], DATA[:, 1:]).at(TIMES)
    np.testing.assert_allclose(_in_c(core, file), expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", INTEGERS)
def test_whole_numbers_are_numbers(core, tmp_path, name):
    file = tmp_path / name
    file.write_bytes(INTEGERS[name])
    core.reset("linear", 0.0, np.zeros(1), np.zeros(6), path=file, quasistatic=True)
    angles = core.drives(np.array([0.0, 1.0, 2.0]), 1)[0, :, 0]
    np.testing.assert_allclose(angles, [0.0, 2.0, 120.0], rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_is_told_with_file_and_reason(core, tmp_path, name):
    file, (content, reason) = tmp_path / name, REFUSED[name]
    file.write_bytes(content)
    said = _refusal(core, file)
    assert said.startswith(f"trajectory {file}: ")
    assert reason in said
    assert "\n" not in said


@pytest.mark.parametrize("name", PLACES)
def test_what_is_no_file_is_said_at_once(core, tmp_path, name):
    file, (make, reason) = tmp_path / name, PLACES[name]
    make(file)
    assert _refusal(core, file) == f"trajectory {file}: {reason}"


def test_an_archive_cut_anywhere_is_refused(core, tmp_path):
    content, file = npz(), tmp_path / "cut.npz"
    for length in range(len(content)):
        file.write_bytes(content[:length])
        with pytest.raises(CoreError):
            core.read(file)


def _by_numpy(content: bytes, is_npz: bool) -> Trajectory | None:
    """Return what NumPy's own readers make of a file's content, None where they refuse it."""
    try:  # of what is damaged zipfile raises exceptions of many kinds
        if is_npz or content.startswith(b"PK\3\4"):
            with np.load(io.BytesIO(content)) as archive:
                columns, data = archive["columns"].tolist(), np.asarray(archive["data"], float)
        else:
            head, _, rows = content.decode("utf-8-sig", errors="replace").partition("\n")
            columns = [name.strip() for name in head.split(",")]
            data = np.loadtxt(io.StringIO(rows), delimiter=",", ndmin=2)
        return trajectory_of(columns, data, 1)
    except Exception:
        return None


def test_what_is_read_of_a_damaged_file_is_what_numpy_reads(core, tmp_path):
    """The core refuses more; NumPy refuses some archives, which tell twice what they hold."""
    refused = alone = 0
    for content, is_npz in damaged_files(seed=1, count=1500):
        file = tmp_path / ("damaged.npz" if is_npz else "damaged.csv")
        file.write_bytes(content)
        try:
            core.read(file)
        except CoreError:
            refused += 1
            continue
        expected = _by_numpy(content, is_npz)
        if expected is None:
            alone += 1
            continue
        times = np.linspace(expected.start, expected.end, 5)
        motion = expected.at(times)
        tolerance = 1e-9 * np.abs(motion).max(axis=(1, 2), keepdims=True)
        assert np.all(np.abs(core.drives(times, 1) - motion) <= tolerance), content
    assert 375 < refused < 1460
    assert alone < 30
