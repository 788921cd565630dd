"""Trajectory files that the C core reads, as Python does and damaged ones beside NumPy, or refuses."""

import io
from pathlib import Path

import numpy as np
import pytest
from native_core import Core, CoreError
from random_robots import make_robot
from trajectory_files import DATA, INTEGERS, PLACES, READ, REFUSED, damaged_files, npz

from elastic_robot.trajectory import Trajectory, read_trajectory, trajectory_of

TIMES = np.array([0.0, 0.1, 0.5, 0.8, 1.0])
NO_LOAD = np.zeros(6)


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


def _assert_relative(found, expected, tolerance):
    """Largest difference relative to the largest entry."""
    scale = np.abs(expected).max(initial=0.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * scale)


def _trajectory(core: Core, path, n: int) -> None:
    core.reset("linear", 0.0, np.zeros(n), NO_LOAD, path=path, quasistatic=True)


def test_trajectories_agree_with_python(example, tmp_path):
    """Quintic Hermite and clamped cubic, from CSV and NPZ by rows and by columns, in any order."""
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.01, 0.1, 40))
    time -= time[0]
    times = np.sort(np.append(rng.uniform(0.0, time[-1], 300), time))
    for blocks in (("q",), ("q", "qd", "qdd")):
        columns = ["note", *[f"{b}{i}" for b in blocks for i in range(6, 0, -1)], "time"]
        table = rng.normal(size=(40, len(columns)))
        table[:, -1] = time
        np.savez(tmp_path / "t.npz", columns=columns, data=table)
        np.savez(tmp_path / "c.npz", columns=columns, data=np.asfortranarray(table))
        header = ", ".join(columns)
        np.savetxt(tmp_path / "t.csv", table, "%.17g", ",", header=header, comments="")
        python = read_trajectory(tmp_path / "t.npz", 6)
        for name in ("t.npz", "c.npz", "t.csv"):
            core = Core(example)
            _trajectory(core, tmp_path / name, 6)
            for found, expected in zip(core.drives(times, 6), python.at(times), strict=True):
                _assert_relative(found, expected, 1e-11)
            for jump in (0.0, 1e3):
                for at in times[:-1:7]:
                    kink = min(python.next_kink(float(at), jump), time[-1])
                    assert core.next_kink(at, time[-1], jump) == kink


def test_kinks_of_a_smooth_trajectory_are_none(example, tmp_path):
    time = np.linspace(0.0, 1.0, 11)
    columns = ["time", *[f"q{i + 1}" for i in range(6)]]
    cubic = time**2 * (3.0 - 2.0 * time)  # rests at both ends: reproduced by the clamped spline
    np.savez(tmp_path / "t.npz", columns=columns, data=np.column_stack([time, *[cubic] * 6]))
    core = Core(example)
    _trajectory(core, tmp_path / "t.npz", 6)
    assert core.next_kink(0.0, 1.0, 1e-6) == 1.0
    assert isinstance(read_trajectory(tmp_path / "t.npz", 6), Trajectory)


def test_times_outside_the_trajectory_are_refused(tmp_path):
    (tmp_path / "t.csv").write_text("time,q1\n0,0\n1,1\n")
    core = Core(make_robot(1, 1))
    _trajectory(core, tmp_path / "t.csv", 1)
    assert core.drives(np.array([1.0 + 5e-10]), 1)[0, 0, 0] == pytest.approx(1.0, abs=1e-15)
    for time in (1.1, -0.1, np.nan):
        with pytest.raises(CoreError, match=r"time: expected 0 to 1 s, the trajectory's, got .* s"):
            core.drives(np.array([time]), 1)


def test_numbers_are_read_as_python_reads_them(tmp_path):
    """Random decimals and doubles with all digits, bit by bit."""
    rng = np.random.default_rng(4)
    texts = [repr(float(v)) for v in rng.normal(size=300) * 10.0 ** rng.integers(-30, 12, 300)]
    texts += [f"{v:.25g}" for v in rng.normal(size=50)]
    texts += [
        "+1",
        "-0.0",
        ".5",
        "5.",
        "1e-22",
        "1e-23",
        "9007199254740993e-22",
        "1e-320",
        "00012.50e+3",
    ]
    lines = [f"{k},{text}" for k, text in enumerate(texts)]
    (tmp_path / "t.csv").write_text("time,q1\n" + "\n".join(lines))
    core = Core(make_robot(1, 1))
    _trajectory(core, tmp_path / "t.csv", 1)
    found = core.drives(np.arange(len(texts) - 1.0), 1)[0, :, 0]
    np.testing.assert_array_equal(found, [float(text) for text in texts[:-1]])
