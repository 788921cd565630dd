"""measurements.csv: what is read, and how everything else is refused."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.errors import IdentifyError
from coupling.identification.static.measurements import read_measurements

HEADER = "q1,q2,fx,fy,fz,dx,dy,dz"
ROW = "0.1,-0.2,10,20,-300,1e-4,2e-4,-3e-3"


def read(tmp_path, text: str | bytes, joints: int = 2):
    file = tmp_path / "measured.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_measurements(file, joints)


def test_a_plain_table_is_measured_at_the_tcp_without_deviations(tmp_path):
    found = read(tmp_path, f"{HEADER}\n{ROW}\n{ROW}\n")
    assert found.names == ("line 2", "line 3")
    np.testing.assert_array_equal(found.q, [[0.1, -0.2]] * 2)
    np.testing.assert_array_equal(found.wrench, [[10, 20, -300, 0, 0, 0]] * 2)
    np.testing.assert_array_equal(found.deflection, [[1e-4, 2e-4, -3e-3]] * 2)
    assert not found.load_point.any()
    assert not found.measured_point.any()
    assert np.isnan(found.deflection_deviation).all()


def test_marks_of_windows_comments_quotes_and_other_columns_do_no_harm(tmp_path):
    text = (
        "\ufeff# measured on a Friday\r\n\r\n"
        " when ,name,q1, q2,fx,fy,fz,dx,dy,dz,q3\r\n"
        f'noon,"left, low",{ROW},9\r\n  # the cable slipped here\r\n'
        f"one,,{ROW},not a number\r\n"
    )
    found = read(tmp_path, text)
    assert found.names == ("left, low", "line 6")
    np.testing.assert_array_equal(found.deflection[1], [1e-4, 2e-4, -3e-3])
    assert found.remarks == ("columns q3 are not used: the robot has 2 joints",)


def test_moments_rotations_points_and_deviations_are_read_where_they_are(tmp_path):
    more = "mx,my,mz,drx,dry,drz,load.x,load.y,load.z,point.x,point.y,point.z,sd.dx,sd.fz"
    found = read(tmp_path, f"{HEADER},{more}\n{ROW},1,2,3,4,5,6,7,8,9,10,11,12,0.5,2\n")
    np.testing.assert_array_equal(found.wrench, [[10, 20, -300, 1, 2, 3]])
    np.testing.assert_array_equal(found.deflection, [[1e-4, 2e-4, -3e-3, 4, 5, 6]])
    np.testing.assert_array_equal(found.load_point, [[7, 8, 9]])
    np.testing.assert_array_equal(found.measured_point, [[10, 11, 12]])
    assert found.deflection_deviation[0, 0] == 0.5
    assert np.isnan(found.deflection_deviation[0, 1:]).all()
    assert found.wrench_deviation[0, 2] == 2.0


# What the file holds, and what the message must say.
MISTAKES = {
    "nothing": ("", ["at least one row", "0 lines"]),
    "names only": (f"{HEADER}\n", ["at least one row", "1 lines"]),
    "a missing column": (f"{HEADER[:-3]}\n{ROW[:-6]}\n", ["dz", "missing"]),
    "another robot": (f"q1,{HEADER[6:]}\n{ROW[4:]}\n", ["q2", "missing"]),
    "semicolons": (
        f"{HEADER}\n{ROW}\n".replace(",", ";"),
        ["missing", "separate them with commas"],
    ),
    "a column twice": (f"{HEADER},fx\n{ROW},1\n", ["one column 'fx'", "two"]),
    "half a loop": (f"{HEADER},loop\n{ROW},1.5\n{ROW},1.5\n", ["line 2: loop", "whole number"]),
    "a loop of one row": (
        f"{HEADER},loop\n{ROW},1\n{ROW},1\n{ROW},2\n",
        ["line 4: loop", "two rows or more"],
    ),
    "loops that are mixed": (
        f"{HEADER},loop\n" + "".join(f"{ROW},{n}\n" for n in (1, 1, 2, 2, 1, 1)),
        ["line 6: loop", "one after the other"],
    ),
    "one loop": (f"{HEADER},loop\n{ROW},1\n{ROW},1\n", ["loop", "two loops or more"]),
    "a loop that moves": (
        f"{HEADER},loop\n{ROW},1\n{ROW.replace('0.2', '0.3')},1\n{ROW},2\n{ROW},2\n",
        ["line 3: q2", "as in the first row of its loop, -0.2"],
    ),
    "half a moment": (f"{HEADER},mx\n{ROW},1\n", ["mx, my, mz", "or none", "got mx"]),
    "half a rotation": (f"{HEADER},drx,drz\n{ROW},1,1\n", ["drx, dry, drz", "or none"]),
    "half a point": (f"{HEADER},load.y\n{ROW},1\n", ["load.x, load.y, load.z"]),
    "NaN": (f"{HEADER}\n{ROW}\nnan{ROW[3:]}\n", ["line 3", "q1", "finite number", "'nan'"]),
    "infinity": (f"{HEADER}\n-inf{ROW[3:]}\n", ["line 2", "q1", "'-inf'"]),
    "a number beyond all": (f"{HEADER}\n1e300{ROW[3:]}\n", ["line 2", "1e300"]),
    "a word": (f"{HEADER}\n# c\n{ROW[:-4]}much\n", ["line 3", "dz", "much'"]),
    "an empty cell": (f"{HEADER}\n{ROW[:-5]}\n", ["line 2", "dz", "''"]),
    "a short row": (f"{HEADER}\n{ROW[4:]}\n", ["line 2", "8 cells", "got 7"]),
    "a long row": (f"{HEADER}\n{ROW},1\n", ["line 2", "8 cells", "got 9"]),
    "a negative deviation": (f"{HEADER},sd.dy\n{ROW},-1\n", ["sd.dy", ">= 0", "-1"]),
    "an open quote": (f'{HEADER},name\n{ROW},"left\n{ROW},"right"\n', ["CSV"]),
    "bytes": (bytes(range(256)), ["cannot be read"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_refused_with_its_place(tmp_path, mistake):
    text, words = MISTAKES[mistake]
    with pytest.raises(IdentifyError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(str(tmp_path / "measured.csv"))
    assert "\n" not in message
    assert [word for word in words if word not in message] == []


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(IdentifyError, match="cannot be read"):
        read_measurements(tmp_path / "none.csv", 2)
    with pytest.raises(IdentifyError, match="cannot be read"):
        read_measurements(tmp_path, 2)
