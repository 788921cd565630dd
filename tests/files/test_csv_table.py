"""Tables with a header line."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.errors import CaseError
from coupling.files.csv_table import read_table, write_table


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
