"""APT cutter locations as a tool path: points and axes again, one sentence for what is not read."""

import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.files.toml_file import validate
from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.toolpaths.apt import AptPath
from coupling.toolpaths.apt_program import read_program
from coupling.toolpaths.roll import upright

PART = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("z", 0.3))
NX = """TOOL PATH/FINISH,TOOL,BALL_6
TLDATA/MILL,6.0000,3.0000,50.0000,0.0000,0.0000
MSYS/0.0,0.0,0.0,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000
$$ centerline data
PAINT/PATH
LOADTL/1
SPINDL/RPM,8000,CLW
RAPID
GOTO/0.0,0.0,20.0,0.0,0.0,1.0
FEDRAT/MMPM,1200.0
GOTO/0.0,0.0,0.0
GOTO/50.0,0.0,0.0,0.1,0.0,0.995
GOTO/50.0,30.0,-2.0,0.3,-0.2,0.932738
END-OF-PATH
"""
CATIA = """$$ -----------------
PARTNO  PLATE $ 7
PPRINT/ OPERATION NAME : Sweeping
UNITS / MM
CUTTER/ 10.000000,  5.000000
TLAXIS/ 0.000000, 0.000000, 1.000000
MULTAX
FEDRAT/ 1200.0000,MMPM
GOTO  /    0.00000,   0.00000,  20.00000, $ the start
      0.000000, 0.000000, 1.000000
GOTO  /    0.00000,   0.00000,   0.00000
goto  /   50.00000,   0.00000,   0.00000, 0.1, 0.0, 0.995
GODLTA/ 0,30.,-2.
COOLNT/OFF
FINI
GOTO/ 999,0,0
"""


def file_of(folder, text: str | bytes):
    file = folder / "part.cls"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


def program(folder, text: str):
    return read_program(file_of(folder, text))


def table(folder, text: str, **keys: object) -> AptPath:
    data = {"kind": "apt", "file": str(file_of(folder, text)), **keys}
    return validate(data, AptPath, CaseError, "tool_path")


def holder(path, part: Frame, reach: float) -> np.ndarray:
    """Where a tool of some length is held, in the part, from poses: its approach is x."""
    tip, tool = path.position[0], path.rotations[0].as_matrix()
    return part.coordinates(tip - reach * tool[:, :, 0])


def located(text: str) -> np.ndarray:
    """Points and unit axes of GOTO with six numbers or three, read apart from the package [mm]."""
    rows, axis = [], [0.0, 0.0, 1.0]
    for found in re.findall(r"^GOTO/(.*)$", text, re.MULTILINE):
        numbers = [float(word) for word in found.split(",")]
        axis = numbers[3:] or axis
        rows.append([*numbers[:3], *(np.array(axis) / np.linalg.norm(axis))])
    return np.array(rows)


def test_tip_and_holder_pass_where_the_file_says(tmp_path):
    """0.1 m of tool: its tip at the points, its holder along the axes from there, in this order."""
    path = table(tmp_path, NX, sample_s=0.004).path(PART)
    tip, held = PART.coordinates(path.position[0]), holder(path, PART, 0.1)
    row = 0
    for point in located(NX):
        away = np.linalg.norm(tip[row:] - 1e-3 * point[:3], axis=1)
        row += int(np.argmin(away))
        assert away.min() < 1e-12
        there = 1e-3 * point[:3] + 0.1 * point[3:]
        np.testing.assert_allclose(held[row], there, atol=1e-9)
    assert row == len(tip) - 1


def test_dialects_say_the_same(tmp_path):
    """Spaces, units behind the number, continuation, increments; nothing behind FINI."""
    nx, catia = program(tmp_path, NX), program(tmp_path, CATIA)
    np.testing.assert_allclose(catia.position, nx.position, atol=1e-15)
    np.testing.assert_allclose(catia.axis[:3], nx.axis[:3], atol=1e-15)
    np.testing.assert_allclose(catia.feed[1:], 0.02, rtol=1e-15)
    assert nx.assumptions == ("without UNITS, lengths are in millimetres as the feeds, MMPM",)
    assert catia.assumptions == ()
    assert catia.left_out == {"PARTNO": 1, "PPRINT": 1, "CUTTER": 1, "COOLNT": 1}


def test_inches_are_the_same_path(tmp_path):
    metric = "FEDRAT/MMPM,254\nGOTO/0,0,0\nGOTO/25.4,0,50.8\n"
    first = program(tmp_path, metric)
    for word in ("UNITS/INCHES", "UNIT/INCH"):
        second = program(tmp_path, f"{word}\nFEDRAT/10\nGOTO/0,0,0\nGOTO/1,0,2\n")
        np.testing.assert_allclose(first.position, second.position, atol=1e-16)
        np.testing.assert_allclose(first.feed, second.feed, rtol=1e-14)


@given(
    st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 2, st.floats(-0.9, 1.0)), min_size=1, max_size=20)
)
def test_the_tool_turns_the_shortest_way_from_upright(vectors):
    """Rodrigues' formula from z to the axis, I + K + K K/(1 + cos), before the untilted tool."""
    axis = np.array(vectors) + np.array([0.0, 0.0, 1e-3])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    untilted = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    axis = axis[axis[:, 2] > -0.999]
    for vector, tool in zip(axis, upright(axis).as_matrix(), strict=True):
        x, y, z = np.cross([0.0, 0.0, 1.0], vector)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        expected = (np.eye(3) + cross + cross @ cross / (1.0 + vector[2])) @ untilted
        np.testing.assert_allclose(tool, expected, atol=1e-11)
        np.testing.assert_allclose(tool[:, 0], -vector, atol=1e-11)


@pytest.mark.parametrize("roll", ["upright", "parallel"])
def test_a_tool_that_comes_back_to_its_axis_has_turned_about_it_as_its_roll_says(tmp_path, roll):
    """One round of a cone of axes: by nothing, or by the solid angle within, 2 pi (1 - cos)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 2001)
    axes = np.column_stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), np.full(2001, np.sqrt(0.75))])
    rows = axes.round(12).tolist()
    lines = [f"GOTO/{k},0,0,{x:.12f},{y:.12f},{z:.12f}" for k, (x, y, z) in enumerate(rows)]
    text = "\n".join(["FEDRAT/MMPM,60000", *lines])
    tools = table(tmp_path, text, roll=roll).path(AT_THE_ORIGIN).rotations[0]
    turned = (tools[0].inv() * tools[-1]).as_rotvec()
    expected = 0.0 if roll == "upright" else 2.0 * np.pi * (1.0 - np.sqrt(0.75))
    np.testing.assert_allclose(np.abs(turned), [expected, 0.0, 0.0], atol=2e-6)


def test_an_axis_may_go_all_around_a_shaft(tmp_path):
    """About the part's x axis, from below and on for two rounds, without a turn about itself."""
    rows = [(k, np.sin(a), np.cos(a)) for k, a in enumerate(np.linspace(np.pi, 5.0 * np.pi, 200))]
    lines = [f"GOTO/{k},{50 * y:.12f},{50 * z:.12f},0,{y:.12f},{z:.12f}" for k, y, z in rows]
    text = "\n".join(["FEDRAT/MMPM,600", *lines])
    found = table(tmp_path, text, roll="parallel", corner_deg=30.0).path(AT_THE_ORIGIN)
    # Chords of the tip leave its circle by 0.1 mm; the tool's z axis stays along the shaft.
    held = holder(found, AT_THE_ORIGIN, 0.05)[:, 1:]
    np.testing.assert_allclose(np.linalg.norm(held, axis=1), 0.1, atol=2e-4)
    along = found.rotations[0].apply([0.0, 0.0, 1.0])[:, 0]
    np.testing.assert_allclose(along, 1.0, atol=1e-9)
    with pytest.raises(CaseError, match="straight down, got one at point 1: set roll"):
        table(tmp_path, text).path(AT_THE_ORIGIN)


def test_a_rapid_is_for_one_point_and_ends_at_rest(tmp_path):
    head = "UNITS/MM\nFEDRAT/600\nGOTO/0,0,0\n"
    found = program(tmp_path, f"{head}RAPID\nGOTO/50,0,0\nGOTO/60,0,0\n")
    np.testing.assert_array_equal(np.isnan(found.feed), [True, True, False])
    path = table(tmp_path, f"{head}RAPID\nGOTO/50,0,0\nGOTO/60,0,0\n").path(AT_THE_ORIGIN)
    assert path.time[-1] == pytest.approx(0.05 / 0.1 + 0.2 + 0.01 / 0.01 + 0.2, abs=1e-12)
    waited = table(tmp_path, f"{head}RAPID\nGOTO/50,0,0\nDELAY/1.5\nGOTO/60,0,0\n")
    assert waited.path(AT_THE_ORIGIN).time[-1] - path.time[-1] == pytest.approx(1.5, abs=1e-12)


def test_the_tool_turns_at_most_as_fast_as_it_may(tmp_path):
    """In place by 60 deg, and over 1 mm by 60 deg back."""
    tilted = f"{np.sin(np.pi / 3)},0,{np.cos(np.pi / 3)}"
    text = f"FEDRAT/MMPM,600\nGOTO/0,0,0\nGOTO/50,0,0\nGOTO/50,0,0,{tilted}\nGOTO/51,0,0,0,0,1\n"
    path = table(tmp_path, text, max_turn_deg_s=60.0).path(AT_THE_ORIGIN)
    rate = (path.rotations[0][1:] * path.rotations[0][:-1].inv()).magnitude() / np.diff(path.time)
    assert rate.max() == pytest.approx(np.pi / 3, rel=1e-3)
    assert path.time[-1] == pytest.approx(5.0 + 0.2 + 1.0 + 0.2 + 1.0 + 0.2, abs=1e-6)


def test_a_jump_of_the_angular_velocity_is_told(tmp_path):
    """30 deg over 50 mm at 10 mm/s, 6 deg/s, begin where the tool did not turn."""
    tilted = f"{np.sin(np.pi / 6)},0,{np.cos(np.pi / 6)}"
    text = f"FEDRAT/MMPM,600\nGOTO/0,0,0\nGOTO/50,0,0\nGOTO/100,0,0,{tilted}\n"
    remarks = table(tmp_path, text).task(AT_THE_ORIGIN).remarks
    assert remarks[-1].endswith("the tool's angular velocity jumps, by up to 6 deg/s")
    still = table(tmp_path, "FEDRAT/MMPM,600\nGOTO/0,0,0\nGOTO/50,0,0\nGOTO/90,1,0\n")
    assert len(still.task(AT_THE_ORIGIN).remarks) == 1


def test_points_of_several_frames_are_in_the_first(tmp_path):
    """The second frame lies 100 mm along the first one's y and is turned by 90 deg about z."""
    first = "MSYS/10,20,0,1,0,0,0,1,0\nGOTO/0,0,5\nGOTO/1,0,0\n"
    second = "MSYS/10,120,0,0,1,0,-1,0,0\nGOTO/2,3,4,0.6,0,0.8\n"
    found = program(tmp_path, f"FEDRAT/MMPM,600\n{first}{second}")
    np.testing.assert_allclose(1e3 * found.position[2], [-3.0, 102.0, 4.0], atol=1e-12)
    np.testing.assert_allclose(found.axis[2], [0.0, 0.6, 0.8], atol=1e-15)
    assert "the part frame is MSYS" in found.assumptions[1]


def test_a_circle_with_points_along_it_is_left_out(tmp_path):
    angle = np.linspace(0.0, np.pi / 2, 30)
    x, y = 10 * np.cos(angle), 10 * np.sin(angle)
    lines = [f"GOTO/{a:.6f},{b:.6f},0" for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    circle = "CIRCLE/0,0,0,0,0,1,10,0.06,0.5"
    text = "\n".join(["FEDRAT/MMPM,600", lines[0], circle, *lines[1:], "GOTO/0,50,0"])
    found = program(tmp_path, text)
    assert len(found.position) == 31
    assert found.left_out == {"CIRCLE": 1}


def test_a_comment_of_creo_goes_on_in_the_next_line(tmp_path):
    text = (
        "$$-> CSYS / 1.0, 0.0, 0.0, 0.0, $\n         0.0, 1.0, 0.0, 0.0\nUNITS / MM\n"
        "FEDRAT / 100.,  MMPM\nGOTO / 1., 2., 3.\nGOTO / 4.E1, -.5, 3.\n"
    )
    found = program(tmp_path, text)
    np.testing.assert_allclose(found.position, [[1e-3, 2e-3, 3e-3], [0.04, -5e-4, 3e-3]])


HEAD = "UNITS/MM\nFEDRAT/600\nGOTO/0,0,0\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"{HEAD}CYCLE/DRILL,5,MMPM,100,2\nGOTO/9,0,0", "line 4: expected no CYCLE, got a cycle"),
        (f"{HEAD}CUTCOM/LEFT,1\nGOTO/9,0,0", "line 4: expected no CUTCOM"),
        (f"{HEAD}AUXFUN/98\nGOTO/9,0,0", "line 4: expected no M98"),
        (f"{HEAD}COPY/1,TRANSL,9,0,0,3\nGOTO/9,0,0", "line 4: expected no COPY, got a repetition"),
        (f"{HEAD}INSERT G54\nGOTO/9,0,0", "line 4: expected no INSERT"),
        (f"{HEAD}TRACUT/1,0,0,0\nGOTO/9,0,0", "line 4: expected no TRACUT"),
        (f"{HEAD}TRACYL/5\nGOTO/9,0,0", "line 4: expected no TRACYL"),
        (f"{HEAD}ROTABL/ATANGL,90\nGOTO/9,0,0", "line 4: expected no ROTABL"),
        (f"{HEAD}FEDRAT/0.1,MMPR\nGOTO/9,0,0", "line 4: expected FEDRAT/ and a number, per minute"),
        (f"{HEAD}CIRCLE/0,5,0,0,0,1,5\nGOTO/0,10,0", "line 4: CIRCLE: expected points along it"),
        (f"{HEAD}CIRCLE/0,5,0,0,0,1,5\nGOTO/0,10,0\nGOTO/9,9,9", "CIRCLE: expected points"),
        (f"{HEAD}CIRCLE/0,5,0,0,0,1,5,TIMES,1\nGOTO/0,10,0", "expected no CIRCLE with TIMES"),
        (f"{HEAD}NURBS/1,2\nGOTO/0,10,0", "expected no NURBS, got a spline"),
        (f"{HEAD}P1=POINT/1,2,3\nGOTO/P1", "line 4: expected cutter locations, got the geometry"),
        (f"{HEAD}GOFWD/L1,PAST,L2", "line 4: expected cutter locations"),
        (f"{HEAD}GOTO/P1", "line 4: expected numbers, got 'P1'"),
        (f"{HEAD}GOTO/1,2", "line 4: expected x, y, z and i, j, k or not, got 2 numbers"),
        (f"{HEAD}GOTO/1,2,NAN", "line 4: expected numbers, got 'NAN'"),
        (f"{HEAD}GOTO/1,2,3,0,0,0", "line 4: expected a vector of length 1, got length 0"),
        (f"{HEAD}GOTO/1,2,3,0,0,-1", "do not point straight down, got one at point 2"),
        (f"{HEAD}MULTAX/OFF\nGOTO/1,2,3,0,0.6,0.8", "line 5: expected a tool axis that stays"),
        (f"{HEAD}GOHOME\nGOTO/9,0,0", "line 5: expected no motion behind GOHOME"),
        (f"{HEAD}GOTO/9,0,0\nFROM/0,0,0", "line 5: expected FROM before all motions"),
        (f"{HEAD}MSYS/0,0,0,1,0,0,0,1,0\nGOTO/9,0,0", "line 4: expected MSYS before the first"),
        (f"{HEAD}UNITS/INCHES\nGOTO/9,0,0", "line 4: expected UNITS/MM or UNITS/INCHES once"),
        (f"{HEAD}SPLINE/1,2\nGOTO/9,0,0", "line 4: expected a statement .* got 'SPLINE'"),
        (f"{HEAD}GOTO/1,2,3 $", "line 4: expected the statement to go on behind"),
        (f"{HEAD}GOTO/200000,2,3", "expected points within 100 m, got 200 m: look at UNITS"),
        (f"{HEAD}FEDRAT/6000000,MMPM\nGOTO/1,2,3", "FEDRAT: expected 1e-09 to 10 m/s, got 100 m/s"),
        (HEAD, "expected GOTO from one point to another, got none"),
        (f"{HEAD}GOTO/0,0,0.0000001", "expected GOTO from one point to another, got none"),
        ("UNITS/MM\nGOTO/0,0,0\nGOTO/1,0,0", "line 3: expected RAPID or FEDRAT before"),
        (
            "FEDRAT/600\nGOTO/0,0,0\nGOTO/1,0,0",
            "expected UNITS/MM or UNITS/INCHES, or feeds all in",
        ),
        ("", "expected GOTO"),
    ],
)
def test_what_is_not_read_is_told_with_its_line(tmp_path, text, said):
    with pytest.raises(CaseError, match=said) as told:
        table(tmp_path, text).path(AT_THE_ORIGIN)
    assert str(told.value).startswith(f"{tmp_path / 'part.cls'}: ")
    assert "\n" not in str(told.value)


@settings(
    max_examples=150,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    st.one_of(
        st.binary(max_size=200),
        st.text("GOTFEDRAUNIS/0123456789.,-+E $\nMRPLCX", max_size=150).map(str.encode),
    )
)
def test_any_bytes_are_points_or_one_sentence(tmp_path, content):
    file = file_of(tmp_path, HEAD.encode() + b"GOTO/1,0,0\n" + content)
    said = f"{file}: "
    try:
        assert np.all(np.isfinite(read_program(file).position))
    except CaseError as error:
        said = str(error)
    assert said.startswith(f"{file}: ")
    assert "\n" not in said


@pytest.mark.parametrize(
    "line", ["TOOL PATH/ROUGH,TOOL,BALL_9", "LOADTL/2,ADJUST,1", "TLDATA/MILL,9.0,3.0,50.0,0.0,0.0"]
)
def test_a_cut_by_another_tool_is_refused(tmp_path, line):
    """Points of each are those of its own tip, and forces of a process are those of one tool."""
    again = "TOOL PATH/LAST,TOOL,BALL_6\nLOADTL/1\nGOTO/50.0,40.0,0.0\n"
    assert len(read_program(file_of(tmp_path, NX + again)).position) == 5
    unused = f"{line}\nRAPID\nGOTO/0.0,0.0,20.0\n"
    assert len(read_program(file_of(tmp_path, NX + unused)).position) == 5
    with pytest.raises(CaseError, match=rf"line 18: .* one tool .* behind {line[:9]}.* in line 15"):
        read_program(file_of(tmp_path, f"{NX}{unused}GOTO/9.0,9.0,9.0\n"))


def test_a_tool_that_is_loaded_behind_a_cut_is_another_though_the_first_has_no_name(tmp_path):
    cut = "GOTO/10.0,0.0,0.0\n"
    with pytest.raises(CaseError, match="one tool for all moves, got a cut behind LOADTL/1"):
        read_program(file_of(tmp_path, f"{HEAD}GOTO/0,0,0\n{cut}LOADTL/1\nGOTO/20,0,0\n"))
