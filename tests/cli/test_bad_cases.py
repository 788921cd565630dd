"""What cannot be run is said in one message, and nothing is written."""

from __future__ import annotations

import pytest
from command_line import command
from line_case import changed_text
from places import LINE_CASE as LINE

from coupling.case.file import load_case
from coupling.errors import CaseError


def changed(old: str, new: str) -> str:
    return changed_text(LINE, (old, new))


# What is wrong with the case, and what the one message must contain.
BAD_CASES = {
    "unknown key": (
        changed("feed_m_s", "feed_ms"),
        ["tool_path", "'feed_ms'", "did you mean 'feed_m_s'"],
    ),
    "unknown table": (changed("[part]", "[work]"), ["unknown key 'work'"]),
    "wrong type": (
        changed("feed_m_s = 0.1", 'feed_m_s = "fast"'),
        ["tool_path: feed_m_s", "'fast'"],
    ),
    "negative": (
        changed("feed_m_s = 0.1", "feed_m_s = -0.1"),
        ["feed_m_s", "expected a number greater than 0, got -0.1"],
    ),
    "NaN": (changed("[1.6, 0.1, 0.8]", "[1.6, nan, 0.8]"), ["part: position_m 2", "nan"]),
    "unknown process": (
        changed('"elastic-wall"', '"elastic-wal"'),
        ["process: model", "did you mean 'elastic-wall'", "isf-force-law"],
    ),
    "unknown scheme": (
        changed('"anderson"', '"newton"'),
        ["coupling: scheme", "'newton'", "constant, aitken, anderson"],
    ),
    "unknown method": (
        changed('"mirror"', '"miror"'),
        ["compensation: method", "did you mean 'mirror'"],
    ),
    "unknown path": (
        changed('"line"', '"spiral"'),
        ["tool_path: kind", "'spiral'", "cone, pyramid"],
    ),
    "unknown curve": (
        changed('"linear"', '"cubic"'),
        ["robot: torque_curve", "linear, backlash, spline"],
    ),
    "unknown mode": (changed('"quasistatic"', '"static"'), ["robot: mode", "quasistatic"]),
    "unknown interpolation": (
        LINE.read_text() + '\n[controller]\ninterpolation = "quntic"\n',
        ["controller: interpolation", "did you mean 'quintic'", "cubic"],
    ),
    "no cycle": (
        LINE.read_text() + "\n[controller]\ncycle_s = 0.0\n",
        ["controller: cycle_s", "expected a number greater than or equal to 0.0001, got 0.0"],
    ),
    "rate of a controller": (
        LINE.read_text() + "\n[controller]\nmax_rate_rad_s = 1.0\n",
        ["controller", "'max_rate_rad_s'"],
    ),
    "unknown robot": (changed('"icme2008"', '"icme2009"'), ["icme2009", "did you mean 'icme2008'"]),
    "missing key": (changed("stiffness_N_m = 2.0e5", ""), ["process", "stiffness_N_m", "missing"]),
    "home too short": (changed("60.0, 0.0]", "60.0]"), ["home_deg", "expected 6 angles", "got 5"]),
    "unreachable": (
        changed("position_m = [1.6, 0.1, 0.8]", "position_m = [5.0, 0.1, 0.8]"),
        ["sample 1", "out of reach", "mm away", "joint"],
    ),
    "not TOML": ("[robot", ["not valid TOML"]),
    "csv that is not there": (
        changed('kind     = "line"', 'kind = "csv"\nfile = "none.csv"')
        .replace("points_m", "# points_m")
        .replace("feed_m_s", "# feed_m_s")
        .replace("blend_s", "# blend_s")
        .replace("sample_s", "# sample_s"),
        ["none.csv", "cannot be read"],
    ),
}


@pytest.mark.parametrize("name", BAD_CASES)
def test_a_bad_case_is_one_message_status_2_and_nothing_written(tmp_path, name):
    text, words = BAD_CASES[name]
    case = tmp_path / "bad.toml"
    case.write_text(text)
    done = command("compensate", case, "-o", tmp_path / "out" / "run")
    said = " ".join(done.stderr.split())
    assert done.returncode == 2, done.stdout + done.stderr
    assert [word for word in words if word not in said] == []
    assert "Traceback" not in said
    assert said.count("error:") == 1
    assert not (tmp_path / "out" / "run").exists()
    assert [f.name for f in tmp_path.rglob("*") if f.is_file()] == ["bad.toml"]


def test_a_missing_case_is_status_2(tmp_path):
    done = command("couple", tmp_path / "none.toml")
    assert done.returncode == 2
    assert "none.toml: cannot be read: No such file or directory" in " ".join(done.stderr.split())


def test_a_file_of_the_wrong_kind_is_named_as_what_it_is(tmp_path):
    from coupling.files.robot_file import RobotFileError, load_robot, shipped_robots

    (tmp_path / "case.toml").write_text(LINE.read_text())
    (tmp_path / "robot.urdf").write_text("<robot/>")
    with pytest.raises(CaseError, match="expected a case, got a robot file"):
        load_case(shipped_robots()["icme2008"])
    with pytest.raises(CaseError, match=r"got a folder: give the case\.toml in it"):
        load_case(tmp_path)
    with pytest.raises(RobotFileError, match="expected a robot file, got a case"):
        load_robot(tmp_path / "case.toml")
    with pytest.raises(RobotFileError, match=r"elastic-robot init cell --robot \S+robot\.urdf"):
        load_robot(tmp_path / "robot.urdf")


def test_a_broken_robot_in_a_case_names_both_files(tmp_path):
    from coupling.files.robot_file import shipped_robots

    robot = shipped_robots()["icme2008"].read_text().replace("mass      = 700.0", "mass = -1.0")
    (tmp_path / "my.toml").write_text(robot)
    (tmp_path / "case.toml").write_text(changed('"icme2008"', '"my.toml"'))
    done = command("couple", tmp_path / "case.toml")
    assert done.returncode == 2
    assert "case.toml: robot: description:" in done.stderr
    assert "joint 1: mass: expected a finite number >= 0 [kg], got -1.0" in " ".join(
        done.stderr.split()
    )


def test_joint_limits_are_errors_and_rates_are_warnings(tmp_path):
    from coupling.files.robot_file import shipped_robots

    text = shipped_robots()["icme2008"].read_text()
    first = "origin    = [0.0, 0.0, 0.0]"
    (tmp_path / "slow.toml").write_text(text.replace(first, first + "\nmax_rate = 0.001", 1))
    (tmp_path / "short.toml").write_text(text.replace(first, first + "\nlimits = [-1.0, 0.0]", 1))
    for robot in ("slow", "short"):
        (tmp_path / f"{robot}_case.toml").write_text(changed('"icme2008"', f'"{robot}.toml"'))
    slow = command("couple", tmp_path / "slow_case.toml", "-o", tmp_path / "out")
    assert slow.returncode == 0, slow.stderr
    assert "Warning: joint 1 moves at" in slow.stdout
    assert "its maximum rate is 0.001 rad/s" in " ".join(slow.stdout.split())
    short = command("couple", tmp_path / "short_case.toml", "-o", tmp_path / "out2")
    assert short.returncode == 2
    assert "its limits are -57.30 to 0.00 deg" in " ".join(short.stderr.split())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "position_m =",
            "position_mm =",
            "did you mean 'position_m'? Convert the value to its unit",
        ),
        ("feed_m_s = 0.1", "feed_mm_min = 6000.0", "'feed_m_s'? Convert the value to its unit"),
        ("feed_m_s = 0.1", "feed = 0.1", "got unknown key 'feed'"),
        ("feed_m_s = 0.1", 'feed_m_s = "0.1 m/s"', "write it without quotation marks and unit"),
        ('"line"', '"C:\\parts"', "Unescaped '\\' in a string (at line"),
    ],
)
def test_units_and_paths_of_newcomers_are_told_what_to_write(tmp_path, old, new, said):
    case = tmp_path / "bad.toml"
    case.write_text(changed(old, new))
    with pytest.raises(CaseError) as caught:
        load_case(case)
    assert said in str(caught.value)
    assert ("Convert" in str(caught.value)) == ("Convert" in said)
