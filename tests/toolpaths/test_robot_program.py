"""A robot program as a tool path: the same points in KRL, RAPID and G-code are the same path."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.files.toml_file import validate
from coupling.path.frame import Frame
from coupling.toolpaths.gcode import GcodePath
from coupling.toolpaths.robot_program import ProgramPath

PART = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("z", 0.3))
POINTS = [(0, 0, 5), (0, 0, -1), (40, 0, -1), (80, 4, -1), (80, 50, -1)]


def krl(points=POINTS, extra: str = "", speed: str = "$VEL.CP=0.05") -> str:
    lines = [f"LIN {{X {x},Y {y},Z {z},A 0,B 90,C 0}} C_DIS" for x, y, z in points[1:]]
    x, y, z = points[0]
    start = f"PTP {{X {x},Y {y},Z {z},A 0,B 90,C 0}}"
    return "\n".join(["DEF WAY()", speed, start, *lines, extra, "END"])


def rapid(points=POINTS) -> str:
    half = "0.70710678118654757"
    rest = f"[{half},0,{half},0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    targets = [f"[[{x},{y},{z}],{rest}" for x, y, z in points]
    first, *others = targets
    moves = [f"MoveL {target},[50,500,5000,1000],z0,tool0;" for target in others]
    lines = [f"MoveJ {first},[50,500,5000,1000],fine,tool0;", *moves]
    return "\n".join(["MODULE way", "PROC way()", *lines, "ENDPROC", "ENDMODULE"])


def gcode(points=POINTS) -> str:
    lines = [f"X{x} Y{y} Z{z}" for x, y, z in points]
    return "\n".join(["G21 G90 F3000", f"G0 {lines[0]}", "G1", *lines[1:]])


def path(folder, name: str, text: str, **keys: object):
    (folder / name).write_text(text)
    table = GcodePath if name.endswith(".ngc") else ProgramPath
    kind = "gcode" if table is GcodePath else "program"
    data = {"kind": kind, "file": str(folder / name), **keys}
    return validate(data, table, CaseError, "tool_path").path(PART)


def test_the_same_points_are_the_same_path_in_every_language(tmp_path):
    """B 90 is the upright tool: its x axis points along -z of the part."""
    expected = path(tmp_path, "way.ngc", gcode())
    for name, text in (("way.src", krl()), ("way.mod", rapid())):
        found = path(tmp_path, name, text)
        np.testing.assert_allclose(found.time, expected.time, atol=1e-12)
        np.testing.assert_allclose(found.position, expected.position, atol=1e-12)
        turn = found.rotations[0] * expected.rotations[0].inv()
        assert turn.magnitude().max() < 1e-9


def test_a_tool_with_z_along_it_is_upright_where_its_z_points_down(tmp_path):
    """The quaternion 0, 0, 1, 0 turns z, and x, about y by half a turn."""
    half = "0.70710678118654757"
    text = rapid().replace(f"[{half},0,{half},0]", "[0,0,1,0]")
    expected = path(tmp_path, "way.ngc", gcode())
    found = path(tmp_path, "way.mod", text, approach="z")
    np.testing.assert_allclose(found.position, expected.position, atol=1e-12)
    turn = found.rotations[0] * expected.rotations[0].inv()
    assert turn.magnitude().max() < 1e-9
    for keys, is_told in (({}, True), ({"approach": "x"}, False), ({"approach": "z"}, False)):
        data = {"kind": "program", "file": str(tmp_path / "way.mod"), **keys}
        remarks = validate(data, ProgramPath, CaseError, "tool_path").task(PART).remarks
        assert any('write approach = "z"' in remark for remark in remarks) == is_told


def test_a_part_that_is_not_where_the_program_has_its_base_is_told(tmp_path):
    base = "$BASE={X 1000,Y 200,Z 500,A 90,B 0,C 0}"
    there = Frame.of_rpy([1.0, 0.2, 0.5], [0.0, 0.0, 0.5 * np.pi])
    turned = Frame(there.position, Rotation.identity())
    for set_base, part, is_told in (
        (base, there, False),
        (base, PART, True),
        (base, turned, True),
        ("", PART, False),
    ):
        (tmp_path / "way.src").write_text(krl(speed=f"{set_base}\n$VEL.CP=0.05"))
        data = {"kind": "program", "file": str(tmp_path / "way.src")}
        remarks = validate(data, ProgramPath, CaseError, "tool_path").task(part).remarks
        said = "position_m = [1, 0.2, 0.5], rpy_deg = [0, 0, 90] from the robot's"
        assert any(said in remark for remark in remarks) == is_told


def test_joint_motions_between_lines_are_the_rapids_of_g_code_if_they_may_be(tmp_path):
    """Those that lead to the start and away from the end are left out; joint angles have no pose."""
    points = [*POINTS, (80, 50, 20), (0, 10, 20), (0, 10, -1), (40, 10, -1)]
    lines = krl(points).replace("LIN {X 80,Y 50,Z 20", "PTP {X 80,Y 50,Z 20")
    lines = lines.replace("LIN {X 0,Y 10,Z 20", "PTP {X 0,Y 10,Z 20").replace(
        "\nEND", "\nPTP {X 0}\nEND"
    )
    with pytest.raises(
        CaseError, match=r"line 8: expected linear moves .* a joint one: give rapid_m_s"
    ):
        path(tmp_path, "way.src", lines)
    blocks = [f"X{x} Y{y} Z{z}" for x, y, z in points]
    ngc = ["G21 G90 F3000", f"G0 {blocks[0]}", *(f"G1 {block}" for block in blocks[1:5])]
    ngc += [*(f"G0 {block}" for block in blocks[5:7]), *(f"G1 {block}" for block in blocks[7:])]
    expected = path(tmp_path, "way.ngc", "\n".join(ngc), rapid_m_s=0.2)
    found = path(tmp_path, "way.src", lines, rapid_m_s=0.2)
    np.testing.assert_allclose(found.time, expected.time, atol=1e-7)
    np.testing.assert_allclose(found.position, expected.position, atol=1e-7)
    angles = lines.replace("PTP {X 0,Y 10", "PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\nPTP {X 0,Y 10")
    with pytest.raises(CaseError, match=r"line 9: .* a joint one, to joint angles: write a line"):
        path(tmp_path, "way.src", angles, rapid_m_s=0.2)


def test_the_same_arc_is_the_same_path_in_every_language(tmp_path):
    """Half a circle of 20 mm behind a line that meets it along its tangent."""
    tail = (
        "PTP {X 0,Y -30,Z 0,A 0,B 90,C 0}\nLIN {X 0,Y 0} C_DIS\nCIRC {X 20,Y 20},{X 40,Y 0} C_DIS"
    )
    expected = path(tmp_path, "way.ngc", "G21 G90 F3000\nG0 X0 Y-30 Z0\nG1 Y0\nG2 X40 Y0 I20")
    line = rapid([(0, -30, 0), (0, 0, 0)])
    start, *_, last = line.split("\n")[3].removeprefix("MoveL ").partition(",[50")
    via, end = (start.replace("0,0,0", place, 1) for place in ("20,20,0", "40,0,0"))
    modul = line.replace("ENDPROC", f"MoveC {via},{end},[50{last}\nENDPROC")
    for name, text in (
        ("way.src", f"DEF WAY()\n$VEL.CP=0.05\n{tail}\nEND"),
        ("way.mod", modul),
    ):
        found = path(tmp_path, name, text)
        assert found.time[-1] == pytest.approx(expected.time[-1], abs=1e-5)
        at = np.linspace(0.0, expected.time[-1] - 1e-4, 400)
        for axis in range(3):
            way, exact = (np.interp(at, p.time, p.position[0][:, axis]) for p in (found, expected))
            np.testing.assert_allclose(way, exact, atol=2e-7)


def test_the_path_is_that_of_the_tool_and_base_of_its_lines_not_of_the_way_there(tmp_path):
    """From home by the flange in the world: lines of the tool in its base are what they were."""
    name, text = "way.mod", rapid()
    expected = path(tmp_path, name, text)
    data = (
        "PERS tooldata tq:=[TRUE,[[0,0,90],[0.6,0.8,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n"
        'PERS wobjdata wq:=[FALSE,TRUE,"",[[700,0,0],[0.6,0,0,0.8]],[[0,0,0],[1,0,0,0]]];\n'
    )
    first = text.split("\n")[2].replace("[[0,0,5]", "[[900,0,900]")
    head, _, lines = text.replace("tool0;", "tq\\WObj:=wq;").partition("MoveJ")
    homed = head.replace("PROC", f"{data}PROC") + f"{first}\nMoveJ{lines}"
    found = path(tmp_path, name, homed.replace("ENDPROC", f"{first}\nENDPROC"))
    np.testing.assert_allclose(found.position, expected.position, atol=1e-9)
    assert (found.rotations[0] * expected.rotations[0].inv()).magnitude().max() < 1e-6


def test_the_tool_turns_evenly_with_the_way(tmp_path):
    text = krl(POINTS[:2], "LIN {X 100,Y 0,Z -1,A 0,B 60,C 0}")
    found = path(tmp_path, "way.src", text)
    x = PART.coordinates(found.position[0])[:, 0]
    tool = PART.rotation.inv() * found.rotations[0]
    lean = (tool * Rotation.from_euler("y", -np.pi / 2)).magnitude()
    np.testing.assert_allclose(lean, np.deg2rad(30.0) * np.clip(x / 0.1, 0.0, 1.0), atol=1e-9)


def test_a_tool_turns_in_place_between_two_rests(tmp_path):
    """30 deg at 90 deg/s with starts and stops of 0.2 s: 1/3 s and 0.2 s more, with the tip at rest."""
    text = krl(extra="LIN {X 80,Y 50,Z -1,A 0,B 60,C 0}\nLIN {X 80,Y 0,Z -1,A 0,B 60,C 0}")
    found = path(tmp_path, "way.src", text, max_turn_deg_s=90.0)
    without = path(tmp_path, "way.src", krl(extra="LIN {X 80,Y 0,Z -1,A 0,B 90,C 0}"))
    assert found.time[-1] - without.time[-1] == pytest.approx(1.0 / 3.0 + 0.2, abs=1e-9)
    rate = (found.rotations[0][1:] * found.rotations[0][:-1].inv()).magnitude() / np.diff(
        found.time
    )
    turning = rate > 1e-6
    assert rate.max() == pytest.approx(np.pi / 2, rel=1e-3)
    assert np.ptp(found.position[0][1:][turning], axis=0).max() < 1e-12


def test_a_feed_is_lower_where_the_tool_would_turn_too_fast(tmp_path):
    """60 deg within 4 mm at 50 mm/s would be 750 deg/s."""
    text = krl(POINTS[:2], "LIN {X 100,Y 0,Z -1,A 0,B 90,C 0}\nLIN {X 104,Y 0,Z -1,A 0,B 30,C 0}")
    found = path(tmp_path, "way.src", text)
    rate = (found.rotations[0][1:] * found.rotations[0][:-1].inv()).magnitude() / np.diff(
        found.time
    )
    assert rate.max() == pytest.approx(np.pi, rel=1e-3)
    speed = np.linalg.norm(np.diff(found.position[0], axis=0), axis=1) / np.diff(found.time)
    assert speed.max() == pytest.approx(0.05, rel=1e-3)


def test_points_with_a_speed_each_are_passed_without_a_rest(tmp_path):
    lines = [
        f"$VEL.CP={0.02 + 0.001 * (k % 3)}\nLIN {{X {k},Y 0,Z 0,A 0,B 90,C 0}} C_VEL"
        for k in range(1, 41)
    ]
    text = "\n".join(["DEF WAY()", "PTP {X 0,Y 0,Z 0,A 0,B 90,C 0}", *lines, "END"])
    found = path(tmp_path, "way.src", text)
    assert 0.040 / 0.022 + 0.2 < found.time[-1] < 0.040 / 0.020 + 0.2 + 1e-6


def timed(language: str) -> tuple[str, str]:
    """Return name and text of 100 mm in 2 s, a turn of 30 deg in 3 s, and 100 mm at 50 mm/s."""
    if language == "krl":
        poses = [(0, 90), (100, 90), (100, 60), (0, 60)]
        start, *lines = [f"{{X {x},Y 0,Z 0,A 0,B {b},C 0}}" for x, b in poses]
        block = ["TIME_BLOCK START", f"SLIN {lines[0]}", "TIME_BLOCK PART=2", f"SLIN {lines[1]}"]
        ends = ["TIME_BLOCK PART=3", "TIME_BLOCK END=5", "ENDSPLINE", f"LIN {lines[2]}", "END"]
        return "way.src", "\n".join(
            ["DEF WAY()", "$VEL.CP=0.05", f"PTP {start}", "SPLINE", *block, *ends]
        )
    if language == "rapid":
        turns = [Rotation.from_euler("y", angle, degrees=True).as_quat() for angle in (90, 60)]
        upright, tilted = (f"[{w:.9f},{x:.9f},{y:.9f},{z:.9f}]" for x, y, z, w in turns)
        rest = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
        moves = [
            f"MoveJ [[0,0,0],{upright},{rest},v50,fine,tool0;",
            f"MoveL [[100,0,0],{upright},{rest},v50\\T:=2,fine,tool0;",
            f"MoveL [[100,0,0],{tilted},{rest},v50\\T:=3,fine,tool0;",
            f"MoveL [[0,0,0],{tilted},{rest},v50,fine,tool0;",
        ]
        return "way.mod", "\n".join(["MODULE way", "PROC way()", *moves, "ENDPROC", "ENDMODULE"])
    poses = [(0, 90), (100, 90), (100, 60), (0, 60)]
    data = [
        f"P[{k}]{{\nGP1:\nUF : 0, UT : 1,\nX = {x} mm, Y = 0 mm, Z = 0 mm,\nW = 0 deg, P = {p} deg,"
        " R = 0 deg\n};"
        for k, (x, p) in enumerate(poses, start=1)
    ]
    moves = ["J P[1] 100% FINE", "L P[2] 2sec FINE", "L P[3] 3000msec FINE", "L P[4] 50mm/sec FINE"]
    lines = [f"{k}: {move} ;" for k, move in enumerate(moves, start=1)]
    return "way.ls", "\n".join(["/PROG WAY", "/MN", *lines, "/POS", *data, "/END"])


def straight(language: str, end: str, wait: str) -> tuple[str, str]:
    """Return name and text of 100 mm at 50 mm/s, a point that ends in some way, a wait, and 100 mm."""
    if language == "krl":
        start, half, whole = (f"{{X {x},Y 0,Z 0,A 0,B 90,C 0}}" for x in (0, 100, 200))
        lines = [f"PTP {start}", f"LIN {half}{end}", wait, f"LIN {whole}", "END"]
        return "way.src", "\n".join(["DEF WAY()", "$VEL.CP=0.05", *lines])
    if language == "rapid":
        name, text = timed("rapid")
        target = text.split("MoveL ")[1].partition(",v50")[0]
        whole = target.replace("100,0,0", "200,0,0")
        lines = [f"MoveL {target},v50,{end},tool0;", wait, f"MoveL {whole},v50,fine,tool0;"]
        head, _, _ = text.partition("MoveL")
        return name, "\n".join([head, *lines, "ENDPROC", "ENDMODULE"])
    name, text = timed("fanuc")
    head, _, data = text.partition("2: ")
    data = data.partition("/POS")[2].replace("X = 0 mm", "X = 200 mm").replace("200", "0", 1)
    lines = [f"2: L P[2] 50mm/sec {end} ;", f"3: {wait} ;", "4: L P[4] 50mm/sec FINE ;", "/POS"]
    return name, head + "\n".join(lines) + data.replace("P = 60", "P = 90")


@pytest.mark.parametrize(
    ("language", "end", "wait", "more"),
    [
        ("krl", " C_DIS", "", 0.0),
        ("krl", "", "", 0.2),
        ("krl", " C_DIS", "WAIT SEC 0.25+0.25", 0.7),
        ("krl", " C_DIS", "WAIT FOR $IN[1]", 0.2),
        ("krl", " C_DIS", "CONTINUE\nWAIT FOR $IN[1]", 0.0),
        ("krl", " C_DIS", "$OUT[1]=TRUE", 0.2),
        ("krl", " C_DIS", "CONTINUE\n$OUT[1]=TRUE", 0.0),
        ("krl", " C_DIS", "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE", 0.0),
        ("rapid", "z10", "", 0.0),
        ("rapid", "fine", "", 0.2),
        ("rapid", "z10", "WaitTime 0.5;", 0.7),
        ("fanuc", "CNT100", "", 0.0),
        ("fanuc", "FINE", "", 0.2),
        ("fanuc", "CNT0", "", 0.2),
        ("fanuc", "CNT100", "WAIT .50(sec)", 0.7),
    ],
)
def test_a_robot_rests_at_exact_stops_and_waits_though_the_way_is_straight(
    tmp_path, language, end, wait, more
):
    """200 mm at 50 mm/s take 4 s; each start with its stop costs 0.2 s."""
    found = path(tmp_path, *straight(language, end, wait))
    assert found.position[0, -1] == pytest.approx(PART.points(np.array([[0.2, 0.0, 0.0]]))[0])
    assert found.time[-1] == pytest.approx(4.2 + more, abs=1e-6)


def test_a_wait_of_an_endless_loop_is_that_of_its_first_pass(tmp_path):
    name, text = straight("krl", " C_DIS", "WAIT SEC 1")
    body = text.partition("0.05\n")[2].removesuffix("\nEND")
    once, again = path(tmp_path, name, text), f"DEF WAY()\n$VEL.CP=0.05\nLOOP\nWAIT SEC 9\n{body}"
    looped = path(tmp_path, name, f"{again}\nENDLOOP\nEND")
    assert looped.time[-1] == pytest.approx(once.time[-1], abs=1e-12)


@pytest.mark.parametrize("language", ["krl", "rapid", "fanuc"])
def test_a_programmed_time_is_that_of_its_way_before_starts_and_stops(tmp_path, language):
    """100 mm in 2 s is 50 mm/s, 30 deg in 3 s 10 deg/s; each start with its stop costs 0.2 s."""
    found = path(tmp_path, *timed(language))
    assert found.time[-1] == pytest.approx(2.0 + 3.0 + 2.0 + 3 * 0.2, abs=1e-6)
    steps = np.diff(found.time)
    speed = np.linalg.norm(np.diff(found.position[0], axis=0), axis=1) / steps
    turn = (found.rotations[0][1:] * found.rotations[0][:-1].inv()).magnitude() / steps
    assert speed.max() == pytest.approx(0.05, rel=1e-3)
    assert np.rad2deg(turn.max()) == pytest.approx(10.0, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            krl(extra="PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}\nLIN {X 0,Y 0,Z 9,A 0,B 90,C 0}"),
            "way.src: line 8: expected linear moves to poses, got a joint one",
        ),
        (krl(speed=""), "expected a speed, a time, or feed_m_s"),
        (krl(speed="$VEL.CP=0.0000001"), "at most 2000000 samples"),
        (krl(POINTS[:1]), "expected linear moves from one point"),
        (krl(extra="CIRC {X 1},{X 2}"), "line"),
        ("\x00\xff" * 50, "way.src"),
    ],
)
def test_what_is_not_a_path_is_told(tmp_path, text, said):
    with pytest.raises(CaseError, match=said) as told:
        path(tmp_path, "way.src", text)
    assert "\n" not in str(told.value)


def test_a_way_back_by_joints_is_left_out(tmp_path):
    home = "PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}"
    with_home = path(tmp_path, "way.src", krl(extra=home))
    assert len(with_home.time) == len(path(tmp_path, "way.src", krl()).time)


def test_a_speed_in_another_unit_is_refused(tmp_path):
    with pytest.raises(CaseError, match=r"way\.src: line 4: expected at most 10 m/s, got 50 m/s"):
        path(tmp_path, "way.src", krl(speed="$VEL.CP=50"))
