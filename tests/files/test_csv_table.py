"""Tables with a header line."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.errors import CaseError
from coupling.files.csv_table import read_table


def test_a_column_that_stands_there_twice_is_refused(tmp_path):
    """Which of the two is meant is not known; others than the wanted ones may be anything."""
    file = tmp_path / "path.csv"
    file.write_text("time,x,note,note,x\n0,1,2,3,4\n")
    with pytest.raises(CaseError, match=r"path\.csv: expected each column once, got x 2 times"):
        read_table(file, ("time", "x"), CaseError)
    assert np.array_equal(read_table(file, ("time",), CaseError), [[0.0]])
