"""measured.csv: what is read, brought onto its run, and how everything else is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.errors import LearnError
from coupling.identification.runs.alignment import aligned
from coupling.identification.runs.measurement import Measurement, read_measurement
from coupling.identification.runs.slow_part import SlowPart
from coupling.path.histories import ToolPath

HEADER = "time,x,y,z"
ROWS = [f"{0.01 * k:.2f},{0.1 * k},2,3" for k in range(40)]


def read(tmp_path, text: str | bytes) -> Measurement:
    file = tmp_path / "measured.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_measurement(file)


def test_comments_other_columns_and_orientations_are_read_as_they_are(tmp_path):
    more = ["qw", "qx", "temperature", "qy", "qz"]
    rows = [f"{row},0.6,0,warm,0.8,0" for row in ROWS]
    found = read(tmp_path, "\n".join(["# tracker 2", f"{HEADER},{','.join(more)}", *rows]))
    np.testing.assert_allclose(found.time, 0.01 * np.arange(40))
    np.testing.assert_allclose(found.position[7], [0.7, 2.0, 3.0])
    np.testing.assert_allclose(found.rotation[3].as_quat(), [0.0, 0.8, 0.0, 0.6])


def with_row(number: int, row: str) -> str:
    rows = [*ROWS[:number], row, *ROWS[number + 1 :]]
    return "\n".join([HEADER, *rows])


# What the file holds, and what the message must say.
MISTAKES = {
    "nothing": ("", ["expected a table", "got none"]),
    "bytes": (b"\xff\xfe\x00time\x00", ["expected a table"]),
    "zeros": (b"\x00" * 300, ["bytes that are none"]),
    "no unit": ("\n".join(["t,x,y,z", *ROWS]), ["column t", "its unit is not stated", "--unit ms"]),
    "no z": ("\n".join(["time,x,y,height", *ROWS]), ["one column of z", "--columns z=NAME"]),
    "two x": ("\n".join(["time,X [mm],x pos,y", *ROWS]), ["column of x and of z, got X, x pos"]),
    "torn": ("\n".join(["time;x;y;z", *[r.replace(",", ";") for r in ROWS], "1;2"]), ["4 cells"]),
    "angles": ("\n".join(["time,X [deg],Y [deg],Z [deg]", *ROWS]), ["column X", "got 'deg'"]),
    "few": ("\n".join([HEADER, *ROWS[:5]]), ["at least 20 rows", "got 5"]),
    "a word": (with_row(3, "0.03,0.3,much,3"), ["line 5", "y", "finite number", "'much'"]),
    "nan": (with_row(9, "0.09,nan,2,3"), ["line 11", "x", "'nan'"]),
    "infinite": (with_row(9, "0.09,1,2,1e300"), ["line 11", "z", "'1e300'"]),
    "cells": (with_row(2, "0.02,1,2"), ["line 4", "4 cells", "got 3"]),
    "time": (with_row(20, "0.1,1,2,3"), ["line 22", "time", "more than 0.19", "'0.1'"]),
    "twice": (f"{HEADER},x\n" + "\n".join(f"{r},1" for r in ROWS), ["one column 'x'", "two"]),
    "half": (f"{HEADER},qx\n" + "\n".join(f"{r},1" for r in ROWS), ["qx, qy, qz, qw", "got qx"]),
    "quaternion": (
        f"{HEADER},qx,qy,qz,qw\n" + "\n".join(f"{r},1,1,0,0" for r in ROWS),
        ["line 2", "qx", "length 1"],
    ),
}


@pytest.mark.parametrize("kind", MISTAKES)
def test_what_cannot_be_a_measurement_is_refused_with_its_place(tmp_path, kind):
    text, words = MISTAKES[kind]
    with pytest.raises(LearnError) as refusal:
        read(tmp_path, text)
    for word in ("measured.csv", *words):
        assert word in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_folder_is_no_measurement(tmp_path):
    with pytest.raises(LearnError, match="cannot be read"):
        read_measurement(tmp_path)


def spiral(radius: float = 0.06) -> ToolPath:
    """Ten seconds of a tool that goes round and down, 1.6 m from the base."""
    t = np.linspace(0.0, 10.0, 2501)
    x, y = radius * np.cos(t**1.3), radius * np.sin(t**1.3)
    position = np.stack([1.6 + x, y, 0.8 - 1e-3 * t], 1)
    return ToolPath(t, np.hstack([position, np.tile([0, 0, 0, 1.0], (len(t), 1))]))


def seen_of(path: ToolPath, first: int = 300, last: int = 2300) -> Measurement:
    return Measurement("measured.csv", path.time[first:last], path.position[0, first:last])


@pytest.mark.parametrize("shift", [0.0, 0.31, -1.2, 3.7, 5000.0])
def test_a_clock_that_is_off_is_found_to_its_step(shift):
    """Off by up to two seconds, or counted from any time, from when its recording begins."""
    path = spiral()
    seen = seen_of(path, first=0)
    found = aligned(Measurement(seen.name, seen.time + shift, seen.position), path, own_frame=False)
    assert found.time[0] == pytest.approx(0.0, abs=0.025)
    np.testing.assert_allclose(np.diff(found.time), 0.004, rtol=1e-6)


def test_a_frame_that_lies_anywhere_is_turned_onto_the_runs():
    path, turn = spiral(), Rotation.from_rotvec([0.3, -2.0, 1.0])
    seen = seen_of(path)
    elsewhere = Measurement(seen.name, seen.time, turn.apply(seen.position) + np.array([5, -3, 1]))
    found = aligned(elsewhere, path, own_frame=True)
    np.testing.assert_allclose(found.position, seen.position, atol=1e-9)
    with pytest.raises(LearnError, match="--own-frame"):
        aligned(elsewhere, path, own_frame=False)


def test_a_line_tells_no_frame():
    time = np.linspace(0.0, 4.0, 500)
    pose = np.tile([1.6, 0.0, 0.8, 0.0, 0.0, 0.0, 1.0], (500, 1))
    pose[:, 0] += 0.01 * time
    path = ToolPath(time, pose)
    with pytest.raises(LearnError, match="not a line"):
        aligned(seen_of(path, 0, 500), path, own_frame=True)


REFUSED = {
    "millimetres": (lambda s, p: Measurement(s.name, s.time, 1e3 * s.position), "are they in mm"),
    "milliseconds": (lambda s, p: replace(s, time=1e3 * s.time), "are they in ms"),
    "another path": (
        lambda s, p: Measurement(s.name, s.time, s.position * [1, -1, 1]),
        "another command",
    ),
    "elsewhere from a row on": (
        lambda s, p: replace(s, position=s.position + 5e-4 * (s.time > 5.0)[:, None]),
        r"jump by 0\.866 mm at 5.* found it elsewhere",
    ),
    "a slow robot": (
        lambda s, p: replace(s, time=5.0 + 1.003 * (s.time - 5.0)),
        r"0\.3 % slower, by 24 ms",
    ),
    "a slow clock": (
        lambda s, p: replace(s, time=5.0 + 0.998 * (s.time - 5.0)),
        r"0\.2 % faster, by 16 ms",
    ),
    "lost again and again": (
        lambda s, p: replace(s, position=s.position + (np.arange(2000) % 15 == 0)[:, None]),
        r"got 1\d\d of \d* .* lost its target",
    ),
    "too short": (lambda s, p: s.at_rows(np.arange(200)), "at least 2 s"),
    "standing": (
        lambda s, p: Measurement(s.name, s.time, np.tile(s.position[:1], (len(s.time), 1))),
        "tool at rest",
    ),
}


@pytest.mark.parametrize("radius", [0.06, 0.006])
@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_no_pass_of_its_run_is_refused(kind, radius):
    """On a small part as well, where another path is off by less than on a large one."""
    path, (change, words) = spiral(radius=radius), REFUSED[kind]
    with pytest.raises(LearnError, match=words):
        aligned(change(seen_of(path), path), path, own_frame=False)


def test_rows_of_a_lost_target_are_left_out():
    """Held values, of a tenth of the run, and a beam that met something else."""
    path, noise = spiral(), 2e-5 * np.random.default_rng(1).standard_normal((2000, 3))
    seen = seen_of(path)
    position = seen.position + noise
    position[700:900] = position[700]
    position[1200:1203] += [1.0, 0.0, 0.0]
    found = aligned(replace(seen, position=position), path, own_frame=False)
    lost = [*range(701, 900), *range(1200, 1203)]
    np.testing.assert_allclose(found.time, np.delete(seen.time, lost))


@pytest.mark.parametrize("digits", [4, 5])
def test_no_row_is_lost_to_few_digits_or_to_rest(digits):
    """At 10 mm/s, where tenths of a millimetre repeat in several rows, and in two seconds of rest."""
    path = spiral(radius=0.006)
    pose = path.position[0].copy()
    pose[1000:1500] = pose[1000]
    pose[1500:] += pose[1000] - pose[1500]
    path = ToolPath(path.time, np.hstack([pose, np.tile([0, 0, 0, 1.0], (len(pose), 1))]))
    seen = seen_of(path)
    coarse = replace(seen, position=np.round(seen.position, digits))
    assert len(aligned(coarse, path, own_frame=False).time) == len(seen.time)


def test_a_tool_that_strikes_and_vibrates_moves_steadily():
    """A link that leaves its flank at 0.1 m/s, and swings of 0.4 mm at 30 Hz, at 250 Hz."""
    path = spiral()
    seen = seen_of(path)
    after = np.clip(seen.time - 5.0, 0.0, None)
    struck = 1e-3 * (1.0 - np.exp(-after / 0.01)) + 4e-4 * np.sin(60.0 * np.pi * after)
    moved = replace(seen, position=seen.position + struck[:, None] * [0.0, 0.0, 1.0])
    assert len(aligned(moved, path, own_frame=False).time) == len(seen.time)


@pytest.mark.parametrize("back", [7.0, 9e9], ids=["and back", "and stays"])
@pytest.mark.parametrize(
    ("rows", "far"),
    [
        (np.arange(0, 2000, 10), 9e-4),  # 40 ms apart
        (np.delete(np.arange(2000), np.arange(1200, 1400)), 9e-4),  # 0.8 s are missing
        (np.arange(2000), 2e-4),
    ],
    ids=["slow", "gap", "small"],
)
def test_a_jump_is_seen_in_slow_rows_behind_a_gap_and_twice(rows, far, back):
    """Beside a tool that swings by 20 um at 3 Hz; without it nothing is refused."""
    path = spiral()
    seen = seen_of(path, first=0)
    swings = 2e-5 * np.sin(6.0 * np.pi * seen.time)
    jumps = far * ((seen.time >= 4.9) & (seen.time < back))
    steady, other = (
        replace(seen, position=seen.position + x[:, None] * [1.0, 0.0, 0.0]).at_rows(rows)
        for x in (swings, swings + jumps)
    )
    assert len(aligned(steady, path, own_frame=False).time) == len(rows)
    with pytest.raises(LearnError, match=r"got a permanent jump by .* found it elsewhere"):
        aligned(other, path, own_frame=False)


@pytest.mark.parametrize("count", [1, 3])
def test_outliers_are_no_permanent_jump(count):
    """Rows 1.5 mm off, behind which the tool is where it was."""
    path = spiral()
    seen = seen_of(path)
    position = seen.position.copy()
    position[700 : 700 + count] += [1.5e-3, 0.0, 0.0]
    aligned(replace(seen, position=position), path, own_frame=False)


def test_a_clock_that_leaves_too_little_of_a_run_is_told():
    """A tool that stands is all the run long there, and like any other end of it."""
    path = spiral(radius=0.006).at_rows(np.arange(800))
    seen = Measurement("measured.csv", path.time, np.tile(path.position[0][:1], (800, 1)))
    with pytest.raises(
        LearnError, match=r"got 1\.\d* s of it, as .* clock shifted by -?1\.\d* s: was it"
    ):
        aligned(seen, path, own_frame=False)
    with pytest.raises(LearnError, match=r"got 0\.796 s of it$"):
        aligned(seen_of(path, 0, 200), path, own_frame=False)


def test_slow_parts_keep_lines_and_pass_their_cut_off_by_half_its_power():
    """At uneven times with gaps: the sum of weights, and a Gaussian's response in closed form."""
    rng = np.random.default_rng(0)
    time = np.sort(rng.uniform(0.0, 20.0, 8000))
    time = time[(time < 7.0) | (time > 8.0)]
    mean = SlowPart.of(time)
    np.testing.assert_allclose(mean(np.ones(len(time))), 1.0)
    even = np.arange(0.0, 20.0, 1e-3)
    mean = SlowPart.of(even)
    inner = (mean.time > 1.0) & (mean.time < 19.0)
    np.testing.assert_allclose(mean(even)[inner], mean.time[inner], atol=2e-6)
    # A frequency f keeps 2^(-f^2 / (2 f_c^2)) of its size.
    for frequency in (2.0, 5.0, 10.0):
        wave = mean(np.exp(2j * np.pi * frequency * even).real)[inner]
        told = np.cos(2 * np.pi * frequency * mean.time[inner])
        kept = 2.0 ** (-0.5 * (frequency / 5.0) ** 2)
        np.testing.assert_allclose(wave, kept * told, atol=2e-3)
    noise = mean(rng.standard_normal((len(even), 400)))[inner]
    assert np.mean(noise**2) == pytest.approx(mean.of_noise, rel=0.05)
