"""Files that are given as what they are not are named as what they are; tables with a header line."""

import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError, ProgramError
from coupling.files.csv_table import read_table, write_table
from coupling.files.formats import other_format
from coupling.path.frame import Frame
from coupling.programs.languages import read_program
from coupling.toolpaths.apt_program import read_program as read_apt
from coupling.toolpaths.csv import CsvPath
from coupling.toolpaths.gcode_program import read_program as read_gcode

PART = Frame(np.zeros(3), Rotation.identity())
# First lines of files by their name in the message, and the kind that reads them.
FILES = {
    "a KRL program": (b"&ACCESS RVP\nDEF part ( )\nPTP {A1 0}\nEND\n", "program"),
    "a RAPID program": (b"%%%\n VERSION:1\n%%%\nMODULE M\nPROC main()\n", "program"),
    "a FANUC program": (b"/PROG A\n/MN\n1:L P[1] 10mm/sec FINE;\n/END", "program"),
    "a UR script": (b"def prog():\n  movej([0,0,0,0,0,0])\nend\n", None),
    "a Yaskawa job": (b"/JOB\n//NAME A\n", None),
    "a Kawasaki AS program": (b".PROGRAM a()\nLMOVE p\n.END\n", None),
    "a Heidenhain dialogue program": (b"0 BEGIN PGM A MM\n1 L X+10 Y+0 R0 FMAX\n", None),
    "a Denso PAC program": (b"PROGRAM PRO1\nTAKEARM\nMOVE L, P1\nEND\n", None),
    "an Epson SPEL+ program": (b"Function main\n  Go P1\nFend\n", None),
    "a KAREL, PDL2 or SCOL program": (b"PROGRAM a\nBEGIN\nMOVE TO p\nEND a\n", None),
    "a Hyundai program": (b"Program File Format Version : 1.6\nS1 MOVE P,S=100%\n", None),
    "a Mitsubishi MELFA program": (b"1 Ovrd 50\n2 Mvs P1\n3 End\n", None),
    "a Nachi program": (b"100 MOVEX A=1,M1J,P,(1,2,3)\n", None),
    "a Doosan program": (b"movel(posx(1, 2, 3, 0, 180, 0))\n", None),
    "a Staubli VAL 3 program": (
        b'<?xml version="1.0"?>\n<Programs xmlns="http://x.com/robotics/VAL3/Program/2">',
        None,
    ),
    "a list of ABB modules": (b"<?xml version='1.0'?><Program><Module>A.mod</Module>", None),
    "a file of Mastercam (NCI)": (b"1011\n0 0 0\n0\n0 1. 2. 3. -2. 0\n", None),
    "a STEP-NC program": (
        b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('INTEGRATED_CNC_SCHEMA'));\n",
        None,
    ),
    "a DSTV file": (b"ST\n** A.nc1\n  1\n", None),
    "a woodWOP program": (b'[H\nVERSION="4.0"\n', None),
    "an APT/CLDATA file": (b"TOOL PATH/ROUGH,TOOL,MILL\nRAPID\nGOTO/0.0,0.0,20.0\n", "apt"),
    "an HPGL plot": (b"IN;SP1;PU0,0;PD100,100;", None),
    "a STEP file": (b"ISO-10303-21;\nHEADER;\n", None),
    "an STL file": (b"solid a\n facet normal 0 0 1\n", None),
    "a DXF file": (b"0\r\nSECTION\r\n2\r\nHEADER\r\n", None),
    "an SVG drawing": (b'<?xml version="1.0"?>\n<svg>', None),
    "a Gerber file": (b"G04 x*\n%FSLAX34Y34*%\nX1Y1D2*", None),
    "an Excellon drill file": (b"M48\nINCH\nT1C0.01\n%\nX1Y1", None),
    "JSON": (b'{"a": 1}', None),
    "binary data": (80 * b"\0" + b"\x0c\0\0\0", None),
    "a binary FANUC program, which the control also writes as .ls": (
        b"\xfe\xef\0\x01\0\0\x02\x33",
        None,
    ),
    "a zip archive": (b"PK\x03\x04\x14\0", None),
    "text in UTF-16": ("G21\nG0 X1".encode("utf-16"), None),
    "G-code": (b"%\nO1 (A)\nG21 G90\nG0 X0 Y0 Z0\nG1 X1 F100\n", "gcode"),
    "a table of values": (b"time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n", "csv"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_of_another_kind_is_named_with_what_reads_it(tmp_path, name):
    content, kind = FILES[name]
    file = tmp_path / "part.dat"
    file.write_bytes(content)
    hint = f'kind = "{kind}"' if kind else ": "
    readers = {
        "gcode": (read_gcode, CaseError),
        "program": (read_program, ProgramError),
        "apt": (read_apt, CaseError),
        "csv": (lambda path: CsvPath(kind="csv", file=path).path(PART), CaseError),
    }
    for reader, (read, error) in readers.items():
        if reader == kind or (reader == "program" and kind == "csv"):
            assert other_format(content, [reader, kind]) is None
            continue
        with pytest.raises(error) as caught:
            read(file)
        said = str(caught.value)
        assert said.startswith(f"{file}: expected ")
        assert hint in said
        assert name in said


@pytest.mark.parametrize(
    "content", [b"", b"hello", b"1 2 3", b"\xff" * 50, b" " * 100_000, b"\n" * 100_000]
)
def test_what_is_not_known_is_not_named(content):
    """At once, whatever it repeats."""
    start = time.process_time()
    assert other_format(content, ["gcode"]) is None
    assert time.process_time() - start < 1.0


def test_a_column_that_stands_there_twice_is_refused(tmp_path):
    """Which of the two is meant is not known; others than the wanted ones may be anything."""
    file = tmp_path / "path.csv"
    file.write_text("time,x,note,note,x\n0,1,2,3,4\n")
    with pytest.raises(CaseError, match=r"path\.csv: expected each column once, got x 2 times"):
        read_table(file, ("time", "x"), CaseError)
    assert np.array_equal(read_table(file, ("time",), CaseError), [[0.0]])


def test_every_number_is_read_as_the_same(tmp_path):
    """A hundred thousand of any bits, in more rows than are written at once."""
    bits = np.random.default_rng(1).integers(0, 2**64, 105_000, dtype=np.uint64).view(float)
    numbers = np.append(
        bits[np.isfinite(bits)][:99_996], [0.0, -0.0, 5e-324, 1.7976931348623157e308]
    )
    file, table = tmp_path / "numbers.csv", numbers.reshape(-1, 4)
    write_table(file, ("a", "b", "c", "d"), table)
    found = read_table(file, ("a", "b", "c", "d"), CaseError)
    assert found.tobytes() == table.tobytes()
    assert b"\r" not in file.read_bytes()


def test_a_table_without_rows_is_a_header(tmp_path):
    file = tmp_path / "none.csv"
    write_table(file, ("a", "b"), np.empty((0, 2)))
    assert file.read_text() == "a,b\n"
    with pytest.raises(CaseError, match="expected rows of 2 numbers, one for each name, got none"):
        read_table(file, ("a", "b"), CaseError)


def test_what_is_no_number_stands_there_as_it_is_read(tmp_path):
    file = tmp_path / "bad.csv"
    write_table(file, ("a",), np.array([[1.0], [np.inf], [np.nan]]))
    assert np.array_equal(np.loadtxt(file, skiprows=1), [1.0, np.inf, np.nan], equal_nan=True)
    with pytest.raises(CaseError, match="a: expected a finite number, got inf in row 2"):
        read_table(file, ("a",), CaseError)
