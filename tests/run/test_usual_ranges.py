"""Every number of case and robot files has a usual range; forces that pull a tool are remarked."""

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from line_case import changed_text, moving_line
from places import CASES, LINE_CASE

from coupling.case.file import CaseFile, load_case
from coupling.files.csv_table import write_table
from coupling.files.robot_file import find_robot
from coupling.files.robot_schema import RobotFile, UrdfRobotFile
from coupling.files.toml_file import Schema
from coupling.path.histories import WrenchHistory
from coupling.process import PROCESSES
from coupling.run.execute import run_compensation, run_coupling
from coupling.run.mistaken_units import MISTAKEN, remark
from coupling.run.plausibility import remarks
from coupling.run.usual_ranges import EXPECTED, range_key
from coupling.solve import METHODS
from coupling.toolpaths import TOOL_PATHS
from coupling.toolpaths.tilt import APPROACH

Node = Mapping[str, Any]
VARIANTS = {"tool_path": TOOL_PATHS, "process": PROCESSES, "compensation": METHODS}
COLUMNS = ("joint.torque_table", "joint.balancer.torque_table")
# Force on a tool along its approach and across: in forming by a program, in milling with helical edges.
FORCES = {
    "pushes": (-300.0, 90.0, False),
    "pulls": (300.0, 90.0, True),
    "a helical mill": (40.0, 100.0, False),
    "none": (0.0, 0.0, False),
}


def numeric_keys(schema: type[Schema], before: str = "") -> Iterator[str]:
    """Yield the places of all keys of a schema that take a number."""
    whole = schema.model_json_schema()
    for key, node in whole["properties"].items():
        if before + key in VARIANTS:
            for variant in VARIANTS[before + key].values():
                yield from numeric_keys(variant, f"{key}.")
        else:
            yield from _within(node, whole, before + key)


def _within(node: Node, whole: Node, place: str) -> Iterator[str]:
    for part in (*node.get("anyOf", ()), *node.get("allOf", ())):
        yield from _within(part, whole, place)
    if "$ref" in node:
        table = whole["$defs"][node["$ref"].rpartition("/")[2]]
        for key, part in table.get("properties", {}).items():
            yield from _within(part, whole, f"{place}.{key}")
    elif node.get("type") == "array" and place not in COLUMNS:
        yield from _within(node["items"], whole, place)
    elif node.get("type") in ("number", "integer"):
        yield place
    elif place in COLUMNS:
        yield from (f"{place}.{column}" for column in ("angle", "torque"))


# Keys for whose numbers no range makes sense, and why.
_DIRECTION = "a direction: its length has no meaning"
_COUNT = "a choice of the user's: it costs time and cannot be in another unit"
_SHARE = "a share, which its schema bounds"
NO_RANGE = {
    "process.normal": _DIRECTION,
    "joint.axis": _DIRECTION,
    "joint.tilt.axis": _DIRECTION,
    "process.retries": _COUNT,
    "process.layers": _COUNT,
    "process.yield_exponent": _COUNT,
    "coupling.max_evaluations": _COUNT,
    "compensation.max_rounds": _COUNT,
    "compensation.max_passes": _COUNT,
    "study.samples": _COUNT,
    "study.seed": _COUNT,
    "study.deviation": "a spread, which may be as small as it likes",
    "place.settings": _COUNT,
    "place.seed": _COUNT,
    "place.cases": _COUNT,
    "process.support_share": _SHARE,
    "compensation.gain": _SHARE,
    "study.coverage": _SHARE,
    "place.clear_share": _SHARE,
    "joint.gear.efficiency": _SHARE,
    "process.parameters": "start values of the user's FMU, in its own units",
    "joint.drive.servo.rate_gain": "judged by the rate loop's bandwidth, joint.drive.rate_bandwidth",
    "joint.drive.servo.rate_bandwidth_Hz": "likewise",
    "joint.drive.servo.integral_gain": "refused where the loop swings up; any smaller one is used",
}
FILES = (CaseFile, RobotFile, UrdfRobotFile)
KEYS = {range_key(key) for schema in FILES for key in numeric_keys(schema)}


def test_every_numeric_key_has_a_range_or_is_told_why_it_has_none():
    assert len(KEYS) > 100
    missing = KEYS - set(EXPECTED) - set(NO_RANGE)
    assert not missing, f"give each a range in usual_ranges.py, or a reason here: {sorted(missing)}"


def test_no_key_has_both_and_no_reason_is_for_a_key_that_is_gone():
    assert not set(EXPECTED) & set(NO_RANGE)
    # Values of a table that takes any name.
    assert set(NO_RANGE) - KEYS == {"process.parameters", "study.deviation"} - KEYS


def test_what_is_no_key_follows_from_several():
    derived = {"robot", "milling", "answer"}
    for key in set(EXPECTED) - KEYS:
        assert (
            key.split(".")[0] in derived
            or "_over_" in key
            or key
            in (
                "joint.inertia_excess",
                "joint.drive.rate_bandwidth",
            )
        ), key


@pytest.mark.parametrize("key", EXPECTED)
def test_a_range_holds_its_ends_and_every_unit_that_is_named_leads_into_it(key):
    usual = EXPECTED[key]
    assert 0.0 <= usual.low < usual.high
    assert usual.holds(usual.low)
    assert remark("", key, usual.high) == ""
    assert remark("", key, 1.001 * usual.high) != ""
    middle = np.sqrt(usual.low * usual.high)
    for unit, factor in MISTAKEN.get(usual.unit, {}).items():
        given = middle / factor
        assert usual.holds(given) or f"({given:.6g} {unit})" in remark("", key, given)


# A line of the file of a robot in place of another, and what its only remark has.
JOINT_2 = "origin    = [0.35, 0.0, 0.75]         # in body 1\n"
DRIVE = (
    "drive = {{ rotor_inertia_kg_m2 = 5e-3, gear_ratio = 200.0, friction = {{ {} }}, servo = {{"
    " position_gain = 20.0, rate_bandwidth_Hz = 30.0{} }}{} }}\n"
)


def drive(friction: str = "coulomb_Nm = 200.0", servo: str = "", more: str = "") -> tuple[str, str]:
    return JOINT_2, JOINT_2 + DRIVE.format(friction, servo, more)


PAYLOAD = "[payload]\nmass = {}\ncom = [0.2, 0.0, 0.0]\ninertia = [1.0, 1.0, 1.0]\n[sources]\n"
ROBOTS = {
    "payload above the rating": (
        ("[sources]\n", PAYLOAD.format(800.0)),
        "payload: mass of 800 kg: expected 0 to 1.001 of the rated load",
    ),
    "gravity in cm/s2": (
        ("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, -981.0]"),
        "did you mean 9.81 m/s2 (981 cm/s2)?",
    ),
    "gravity upward": (
        ("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, 9.81]"),
        "expected one that points down in the world, got 9.81 m/s2 along z",
    ),
    "centre of mass in mm": (
        ("com       = [0.10, 0.0, 0.45]", "com       = [100.0, 0.0, 450.0]"),
        "joint 1: com: expected 0 to 5 m (centres of mass in or beside their link), got 450 m: did"
        " you mean 0.45 m (450 mm)",
    ),
    "limits in degrees": (
        (JOINT_2, JOINT_2 + "limits = [-185.0, 185.0]\n"),
        "joint 2: limits: expected 0 to 20 rad",
    ),
    "tool in degrees": (
        ("rpy      = [0.0, 0.0, 0.0]", "rpy      = [0.0, 90.0, 0.0]"),
        "tcp: rpy: expected 0 to 6.3 rad (up to one turn), got 90 rad: did you mean",
    ),
    "feed-forward in percent": (
        drive(servo=", rate_feed_forward = 95.0"),
        "rate_feed_forward: expected 0 to 1.2 (1 is the whole rate), got 95: did you mean 0.95 (95 %)?",
    ),
    "integral time in ms": (
        drive(servo=", integral_time_s = 20.0"),
        "integral_time_s: expected 0.001 to 5 s (rate loops of machine axes), got 20 s: did you mean"
        " 0.02 s (20 ms)?",
    ),
    "presliding in arc seconds": (
        drive("coulomb_Nm = 200.0, presliding_rad = 6.0"),
        "did you mean 2.909e-05 rad (6 arcsec)",
    ),
    "friction of the motor": (
        drive("coulomb_Nm = 1.0"),
        "friction at rest: expected 0.05 to 300 rad/s2",
    ),
    "viscous friction of the motor": (
        drive("coulomb_Nm = 200.0, viscous_Nm_s = 0.01"),
        "viscous friction: expected 0.02 to 100 1/s",
    ),
    "torque of the motor": (
        drive(more=", max_torque_Nm = 300.0"),
        "max_torque_Nm: expected 2 to 1e+04 rad/s2",
    ),
    "balancer in degrees": (
        (
            JOINT_2,
            JOINT_2
            + "balancer.torque_table = [[-90.0, -900.0], [0.0, 0.0], [60.0, 800.0], [90.0, 900.0]]\n",
        ),
        "balancer: torque_table: angle: expected 0 to 7 rad (angles of a joint), got 90 rad",
    ),
    "balancer in kN m": (
        (JOINT_2, JOINT_2 + "balancer.torque_table = [[-2.0, -8.5], [0.0, 0.0], [2.0, 8.5]]\n"),
        "got 8.5 N m: did you mean 8500 N m (8.5 kN m)?",
    ),
}


@pytest.mark.parametrize("slip", ROBOTS)
def test_a_slip_in_a_robot_file_is_remarked_upon_once(tmp_path, slip):
    (old, new), said = ROBOTS[slip]
    text = find_robot("icme2008").read_text()
    assert old in text
    (tmp_path / "robot.toml").write_text(text.replace(old, new, 1))
    (tmp_path / "line.toml").write_text(moving_line(('"icme2008"', '"robot.toml"')))
    texts = [text for text in remarks(load_case(tmp_path / "line.toml")) if "are ideal" not in text]
    assert len(texts) == 1, texts
    assert said in texts[0]


def remarks_of(folder: Path, *changes: tuple[str, str]) -> tuple[str, ...]:
    file = folder / "cone.toml"
    file.write_text(changed_text(CASES / "cone.toml", *changes))
    return remarks(load_case(file))


@pytest.mark.parametrize(
    ("written", "degrees"), [("3.14159", 180), ("1.5708", 90), ("-1.57", -90), ("0.7854", 45)]
)
def test_degrees_that_are_a_part_of_pi_are_remarked_upon(written, degrees):
    said = remark("part: rpy_deg", "part.rpy_deg", float(written))
    assert f"did you mean {degrees} deg ({float(written):.6g} rad)?" in said


@pytest.mark.parametrize("usual", [0.0, 0.5, 1.0, 2.0, 3.0, 5.5, 28.1, 90.0, -180.0])
def test_small_and_round_degrees_are_not(usual):
    assert remark("part: rpy_deg", "part.rpy_deg", usual) == ""


def test_a_part_turned_in_radians_is_remarked_upon(tmp_path):
    flat = "rpy_deg    = [0.0, 0.0, 0.0]"
    (said,) = remarks_of(tmp_path, (flat, "rpy_deg = [0.0, 0.0, 3.14159]"))
    assert said.startswith("part: rpy_deg: expected degrees, got 3.14159, a part of pi")


def test_a_part_inside_the_robots_column_is_remarked_upon(tmp_path):
    """5 cm beside the axis of joint 1, below the shoulder: no arm folds back to there."""
    said = remarks_of(tmp_path, ("position_m = [1.6, 0.0, 0.8]", "position_m = [0.05, 0.0, 0.4]"))
    assert any("distance of the forming tool from the column of joint 1" in text for text in said)
    above = remarks_of(tmp_path, ("position_m = [1.6, 0.0, 0.8]", "position_m = [0.05, 0.0, 2.4]"))
    assert not any("column" in text for text in above)


def test_a_rated_load_in_kilonewton_and_an_edge_a_thousand_times_too_hard_are_remarked():
    assert "2650 N (2.65 kN)" in remark("", "payload_N", 2.65)
    assert remark("", "process.K_te_N_m", 7e5)


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
