"""Files as devices write them: any names, units and separators, traces of a controller, bags of ROS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from coupling.errors import LearnError
from coupling.identification.runs.measurement import Measurement, read_measurement
from coupling.identification.runs.recorded_columns import ColumnChoice

ROWS = 60
TIME = 0.01 * np.arange(ROWS)
POSITION = np.column_stack([1.6 + 0.1 * np.sin(TIME), 0.05 * TIME, 0.8 - 0.02 * TIME**2])


def same(found: Measurement) -> None:
    np.testing.assert_allclose(found.time - found.time[0], TIME, atol=2e-6)
    np.testing.assert_allclose(found.position, POSITION, atol=1e-6)


def cells(scale: float = 1e3, decimal: str = ".") -> list[list[str]]:
    return [[f"{scale * value:.6f}".replace(".", decimal) for value in row] for row in POSITION]


def written(folder: Path, lines: list[str], encoding: str = "utf-8") -> Path:
    file = folder / "device.txt"
    file.write_bytes("\n".join(lines).encode(encoding))
    return file


def clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds, 3), 60.0)
    return f"11:{int(minutes):02d}:{rest:06.3f}"


TABLES = {
    "a tracker, with lines above, a point's name and a time of day": (
        [
            "Tracker: AT960  Serial 550123",
            "Job;Cell 4",
            "",
            "Point;Timestamp;X [mm];Y [mm];Z [mm];RMS",
            *(
                f"P{k};{clock(t + 5)};{';'.join(c)};0.01"
                for k, (t, c) in enumerate(zip(TIME, cells(), strict=True))
            ),
        ],
        None,
        "utf-8",
    ),
    "decimal commas, and a line of units": (
        [
            "Zeit\tX\tY\tZ",
            "ms\tmm\tmm\tmm",
            *(
                "\t".join([f"{1e3 * t:.1f}".replace(".", ","), *c])
                for t, c in zip(TIME, cells(decimal=","), strict=True)
            ),
        ],
        None,
        "utf-16",
    ),
    "columns that are named, a German code page": (
        [
            "Messung;Größe",
            "t;Ost;Nord;Höhe;Güte",
            *(f"{t:.2f};{';'.join(c)};gut" for t, c in zip(TIME, cells(), strict=True)),
        ],
        ColumnChoice.of("time=t,x=Ost,y=Nord,z=Höhe", "mm,s"),
        "cp1252",
    ),
    "numbers without a head, between blanks": (
        [" ".join([f"{t:.2f}", *c]) for t, c in zip(TIME, cells(), strict=True)],
        ColumnChoice.of("time=1,x=2,y=3,z=4", "mm,s"),
        "utf-8",
    ),
    "a program of trackers, with dates in whole seconds and a rate": (
        [
            "// SpatialAnalyzer",
            "// AXES = CARTESIAN: X,  Y,  Z (mm)",
            *(
                f"Path,  P1,  {k},  {',  '.join(c)},  02/12/25 16:56:08"
                for k, c in enumerate(cells())
            ),
        ],
        ColumnChoice.of("time=100Hz,x=4,y=5,z=6", "mm"),
        "utf-8",
    ),
    "motion capture, whose titles stand twice and whose units are words": (
        [
            "Format Version,1.23,Capture Frame Rate,100,Length Units,Millimeters",
            ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position",
            "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z",
            *(
                f"{k},{t:.6f},0,0,0,1,{','.join(c)}"
                for k, (t, c) in enumerate(zip(TIME, cells(), strict=True))
            ),
        ],
        ColumnChoice.of("x=7,y=8,z=9", "mm"),
        "utf-8",
    ),
    "motion capture of a body and its marker, whose unit stands in the first line": (
        [
            "Format Version,1.23,Take Notes,,Rotation Type,Quaternion,Length Units,Millimeters",
            "",
            f",Type{4 * ',Rigid Body'}{3 * ',Rigid Body Marker'}{3 * ',Rigid Body'}",
            f",Name{4 * ',Tool'}{3 * ',Tool:Marker1'}{3 * ',Tool'}",
            ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position,Position,Position",
            "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z",
            *(
                f"{k},{t:.6f},0,0,0.6,0.8,,,,{','.join(c)}"
                if k == 7
                else f"{k},{t:.6f},0,0,0.6,0.8,1,2,3,{','.join(c)}"
                for k, (t, c) in enumerate(zip(TIME, cells(), strict=True))
            ),
        ],
        None,
        "utf-8",
    ),
    "a camera, with titles in a comment": (
        [
            "# of camera 2",
            "# timestamp tx ty tz qx qy qz qw",
            *(
                f"{1.7e9 + t:.6f} {' '.join(c)} 0 0 0 1"
                for t, c in zip(TIME, cells(1.0), strict=True)
            ),
        ],
        ColumnChoice.of("x=tx,y=ty,z=4", "s,m"),
        "utf-8",
    ),
    "a logger, with dates of a zone": (
        [
            "Timestamp,X (Millimeters),Y (Millimeters),Z (MM)",
            *(
                f"2025-07-03T{hour}:59:{59 + t:09.6f}+0{zone}:00,{','.join(c)}"
                for k, (t, c) in enumerate(zip(TIME, cells(), strict=True))
                for hour, zone in [(14, 2) if k % 2 else (13, 1)]
            ),
        ],
        None,
        "utf-8",
    ),
    "a logger, with halves of the day": (
        [
            "Time;X [mm];Y [mm];Z [mm]",
            *(
                f"7/3/2025 {'11:59' if 59.7 + t < 60 else '12:00'}:{(59.7 + t) % 60:06.3f}"
                f" {'AM' if 59.7 + t < 60 else 'PM'};{';'.join(c)}"
                for t, c in zip(TIME, cells(), strict=True)
            ),
        ],
        None,
        "utf-8",
    ),
    "a German date with a quote": (
        [
            "X  [mm],Y  [mm],Z  [mm],Temp [°C],Time Stamp,OTG,Delete",
            *(
                f"{','.join(c)},23.7,'08.11.2022 16:{clock(1079.7 + t)[3:]},FALSE,"
                for t, c in zip(TIME, cells(), strict=True)
            ),
        ],
        None,
        "cp1252",
    ),
    "a topic that was printed": (
        [
            "%time,field.header.seq,field.pose.position.x,field.pose.position.y,field.pose.position.z",
            *(
                f"{round(1e9 * t) + 10**9},{k},{','.join(c)}"
                for k, (t, c) in enumerate(zip(TIME, cells(1.0), strict=True))
            ),
        ],
        ColumnChoice.of(None, "ns,m"),
        "utf-8",
    ),
    "a separator at the end of each line": (
        ["time(us),posX(um),posY(um),posZ(um),"]
        + [",".join([f"{1e6 * t:.0f}", *c, ""]) for t, c in zip(TIME, cells(1e6), strict=True)],
        None,
        "utf-8",
    ),
}


@pytest.mark.parametrize("name", TABLES)
def test_a_table_of_any_device_is_read_as_it_is(name, tmp_path):
    lines, choice, encoding = TABLES[name]
    found = read_measurement(written(tmp_path, lines, encoding), choice)
    same(found)
    assert found.understood.rows == ROWS
    assert found.understood.rate == pytest.approx(100.0, rel=1e-3)


def test_of_motion_capture_a_rotation_is_no_position_and_one_of_two_bodies_has_to_be_named(
    tmp_path,
):
    """The number of a rotation's column is easily taken for a position's, as both are called X."""
    name = "motion capture of a body and its marker, whose unit stands in the first line"
    lines = TABLES[name][0]
    found = read_measurement(written(tmp_path, lines), ColumnChoice())
    assert found.rotation is not None
    turn = np.tile([0.0, 0.0, 0.6, 0.8], (ROWS, 1))
    np.testing.assert_allclose(found.rotation.as_quat(), turn, atol=1e-12)
    with pytest.raises(LearnError, match=r"column qx: expected a unit of m, .* got '1'"):
        read_measurement(written(tmp_path, lines), ColumnChoice.of("x=3,y=4,z=5", "mm"))
    two = [
        line.replace("Tool:Marker1", "Hand").replace("Rigid Body Marker", "Rigid Body")
        for line in lines
    ]
    with pytest.raises(LearnError, match="got Hand position X, Tool position X"):
        read_measurement(written(tmp_path, two), ColumnChoice())


def test_times_that_are_too_coarse_are_refused_with_the_way_out(tmp_path):
    lines = TABLES["a program of trackers, with dates in whole seconds and a rate"][0]
    with pytest.raises(LearnError, match="the same in 59 of 60 rows: give the rate of the rows"):
        read_measurement(written(tmp_path, lines), ColumnChoice.of("time=7,x=4,y=5,z=6", "mm"))


HEAD = "time_s;x_mm;y_mm;z_mm"


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            [f"{k / 8};1,{234 + k};2.5;3" for k in range(30)],
            "one decimal mark, got '1,234' and '0.0'",
        ),
        (
            [f'{k},"1,{234 + k}",2,3' for k in range(30)],
            "one decimal mark, got '1,234' and 'commas between cells'",
        ),
        (
            [*(f"{k};1;2;3" for k in range(30)), HEAD, "30;1;2;3", "31;1;2;3"],
            "a row of numbers '0 1 2 3' above",
        ),
        (
            [*(f"{k};1;2;3" for k in range(60)), HEAD, "60;1;2;3"],
            "row 61 of the table, got 'time_s'",
        ),
        ([f"{(k * 7) % 30};1;2;3" for k in range(30)], "expected more than"),
    ],
)
def test_marks_between_thousands_second_heads_and_shuffled_rows_are_refused(tmp_path, lines, said):
    head = HEAD.replace(";", ",") if '"' in lines[0] else HEAD
    with pytest.raises(LearnError, match=said):
        read_measurement(written(tmp_path, [head, *lines]))


def test_titles_that_stand_twice_are_told_apart_by_their_numbers(tmp_path):
    """A column that is not read may stand twice; of two for one coordinate one is to be named."""
    rows = [f"{k};{k};{k};{k};{k};{k}" for k in range(60)]
    twice = [HEAD + ";i_1;i_1", *rows]
    assert read_measurement(written(tmp_path, twice)).understood.rows == 60
    with pytest.raises(LearnError, match=r"one column of x, got x \(2\), x \(5\): name it"):
        read_measurement(written(tmp_path, [HEAD + ";x_mm;i_1", *rows]))


@pytest.mark.parametrize("head", ["time,px,py,pz,x,y,z,w", "t_s;px;py;pz;x;y;z;w"])
def test_a_quaternion_called_x_y_z_w_is_no_position(tmp_path, head):
    """The columns of others: positions px, py, pz beside an orientation x, y, z, w."""
    mark = "," if "," in head else ";"
    rows = [mark.join(map(str, (k, 100 + k, 2, 3, 0.6, 0.0, 0.8, 0.0))) for k in range(60)]
    file = written(tmp_path, [head, *rows])
    for choice in (None, ColumnChoice.of(None, "mm")):
        if choice is not None or mark == ",":
            with pytest.raises(LearnError, match="got unit quaternions in x, y, z, w: name"):
                read_measurement(file, choice)
    names = "x=px,y=py,z=pz,qx=x,qy=y,qz=z,qw=w" + (",time=time" if mark == "," else "")
    measured = read_measurement(file, ColumnChoice.of(names, "mm,s" if mark == "," else "mm"))
    assert measured.position[5, 0] == pytest.approx(0.105)
    assert measured.rotation.as_quat()[5] == pytest.approx([0.6, 0.0, 0.8, 0.0])


def test_columns_left_out_of_a_table_with_the_names_of_the_page_are_told(tmp_path):
    """What is not read may be what was meant."""
    rows = [f"{k},1,2,3,1.001,0.5,0.1" for k in range(60)]
    head = "time,x,y,z,x_measured,motor[1],sd.motor[1]"
    told = read_measurement(written(tmp_path, [head, *rows])).understood.sentence
    assert told.endswith("left out: the columns x_measured")


def test_a_coordinate_with_marks_between_thousands_is_named(tmp_path):
    rows = [f"{k};1,{234 + k}.5;2;3" for k in range(60)]
    with pytest.raises(LearnError, match=r"of x, got .*texts x .*thousands, as '1,234\.5'"):
        read_measurement(written(tmp_path, [HEAD, *rows]))


def test_rows_whose_values_are_nan_are_left_out(tmp_path):
    lines = [HEAD, *(f"{k};{'NaN' if k in (1, 50) else k};2;3" for k in range(60))]
    assert read_measurement(written(tmp_path, lines)).understood.rows == 58


def test_columns_without_titles_are_asked_for_at_once_and_groups_of_rows_are_told(tmp_path):
    """As a tracker's program writes them; its last row is of another measurement."""
    rows = [f"Path,  P1,  {k},  {',  '.join(c)}" for k, c in enumerate(cells())]
    rows[-1] = rows[-1].replace("P1", "Set 2")
    file = tmp_path / "tracker.txt"
    file.write_text("\n".join(rows))
    with pytest.raises(
        LearnError, match=r"of time and of x and of y and of z, got 3 \(first 0\), 4"
    ):
        read_measurement(file, ColumnChoice())
    with pytest.raises(LearnError, match="--columns time=NAME,y=NAME, or the rate of its rows"):
        read_measurement(file, ColumnChoice.of("x=4,z=6", "mm"))
    choice = ColumnChoice.of("time=100Hz,x=4,y=5,z=6", "mm")
    told = read_measurement(file, choice).understood.sentence
    assert f"left out: the texts 1, 2 (changes to 'Set 2' in row {len(rows)})" in told


def test_what_was_understood_and_left_out_is_told(tmp_path):
    lines = list(TABLES["a tracker, with lines above, a point's name and a time of day"][0])
    lines[20] = lines[20].rsplit(";", 3)[0] + ";;;0.01"
    del lines[40:48]
    said = read_measurement(written(tmp_path, lines)).understood.sentence
    assert "Timestamp [s] is time, X [mm] is x, Y [mm] is y, Z [mm] is z" in said
    assert "1 gaps, the longest 0.09 s at 0.35" in said
    for words in (
        "2 lines above the table",
        "texts Point",
        "1 rows with empty cells",
        "columns RMS",
    ):
        assert words in said


def trace(folder: Path, *, kind: str = "REAL64", cut: int = 0) -> Path:
    """A head and a file of numbers, as a KUKA controller writes them."""
    channels = []

    def channel(**entries: object) -> None:
        channels.append("#BEGINCHANNELHEADER")
        channels.extend(f"{key[1:]},{value}" for key, value in entries.items())
        channels.append("#ENDCHANNELHEADER")

    channel(k200="Zeit", k202="s", k210="IMPLIZIT", k220=ROWS, k240="0", k241="0.01")
    for place, axis in enumerate("XYZ", start=1):
        channel(
            k200=f"{axis}_Act",
            k202="mm",
            k210="EXPLIZIT",
            k211="run.r64",
            k213="BLOCK",
            k214=kind,
            k220=ROWS,
            k221=place,
            k240="0",
            k241="1000",
        )
    content = POSITION.astype({"REAL64": "<f8", "REAL32": "<f4"}[kind]).tobytes()
    (folder / "run.r64").write_bytes(content[: len(content) - cut])
    head = folder / "run.dat"
    head.write_text("\n".join(["DIAEXTENDED HEADER", *channels]))
    return head


def test_a_trace_of_a_controller_is_read_with_its_units(tmp_path):
    same(read_measurement(trace(tmp_path)))


@pytest.mark.parametrize("cut", [8, 800, 1440])
def test_a_trace_that_is_cut_short_is_refused(tmp_path, cut):
    with pytest.raises(LearnError, match=r"run\.r64: expected 60 values of each channel, got"):
        read_measurement(trace(tmp_path, cut=cut))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: text.replace("220,60", "220,1e9", 1),
        lambda text: text.replace("220,60", "220,-1", 1),
        lambda text: text.replace("211,run.r64", "211,../../none.r64"),
        lambda text: text.replace("221,2", "221,9"),
        lambda text: text.replace("REAL64", "REAL63"),
        lambda text: text[:200],
    ],
)
def test_a_damaged_head_is_refused_in_a_sentence(tmp_path, spoil):
    head = trace(tmp_path)
    head.write_text(spoil(head.read_text()))
    with pytest.raises(LearnError) as refusal:
        read_measurement(head)
    assert "expected" in str(refusal.value) or "cannot be read" in str(refusal.value)
    assert "\n" not in str(refusal.value)


def bag(folder: Path, topics: tuple[str, ...] = ("/tcp",)) -> Path:
    """A bag of ROS 2, with poses in metres and a topic of text."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    kinds = store.types
    pose_kind, text_kind = "geometry_msgs/msg/PoseStamped", "std_msgs/msg/String"
    with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = [writer.add_connection(name, pose_kind, typestore=store) for name in topics]
        text = writer.add_connection("/state", text_kind, typestore=store)
        for time, (x, y, z) in zip(TIME, POSITION, strict=True):
            nanoseconds = 1_700_000_000_000_000_000 + round(1e9 * time)
            stamp = kinds["builtin_interfaces/msg/Time"](
                sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9
            )
            message = kinds[pose_kind](
                header=kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="base"),
                pose=kinds["geometry_msgs/msg/Pose"](
                    position=kinds["geometry_msgs/msg/Point"](x=x, y=y, z=z),
                    orientation=kinds["geometry_msgs/msg/Quaternion"](x=0.0, y=1.0, z=0.0, w=0.0),
                ),
            )
            content = store.serialize_cdr(message, pose_kind)
            for connection in connections:
                writer.write(connection, nanoseconds, content)
        writer.write(
            text, nanoseconds, store.serialize_cdr(kinds[text_kind](data="end"), text_kind)
        )
    return folder / "bag"


def test_a_bag_is_read_as_folder_and_as_file(tmp_path):
    folder = bag(tmp_path)
    (file,) = folder.glob("*.mcap")
    for place in (folder, file):
        found = read_measurement(place)
        same(found)
        np.testing.assert_allclose(
            found.rotation.as_quat(), np.tile([0.0, 1.0, 0.0, 0.0], (ROWS, 1))
        )
        assert "the topics /state" in found.understood.sentence


def test_one_of_several_topics_has_to_be_named(tmp_path):
    folder = bag(tmp_path, ("/tcp", "/flange"))
    with pytest.raises(LearnError, match=r"bag: /flange, /tcp: name it with --columns topic"):
        read_measurement(folder)
    same(read_measurement(folder, ColumnChoice.of("topic=/tcp", None)))


def test_a_bag_without_poses_is_told_what_is_read(tmp_path):
    said = r"a topic of measured poses, a PoseStamped, .* got /state \(String\): record or convert"
    with pytest.raises(LearnError, match=said):
        read_measurement(bag(tmp_path, ()))


def test_a_damaged_bag_is_refused_in_a_sentence(tmp_path):
    (file,) = bag(tmp_path).glob("*.mcap")
    content = file.read_bytes()
    for spoiled in (b"", content[:100], b"\xff" * 400, content[:3000] + b"\0" * 50):
        file.write_bytes(spoiled)
        with pytest.raises(LearnError, match=r"mcap: ") as refusal:
            read_measurement(file)
        assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("columns", "unit"),
    [
        ("time", None),
        ("u=1", None),
        ("time=", None),
        ("=a", None),
        (None, "deg"),
        (None, "mm,cm"),
        (None, ","),
    ],
)
def test_options_that_name_nothing_are_refused_by_their_name(columns, unit):
    with pytest.raises(LearnError, match="--columns: expected" if columns else "--unit: expected"):
        ColumnChoice.of(columns, unit)
