"""Compiled code, which processes share."""

from __future__ import annotations

import subprocess
import sys

import pytest
from filelock import FileLock

from coupling.native.cache import cache_folder

SCRIPT = """
from coupling.sheet_fem.compiled import compile_function
print("begun", flush=True)
@compile_function
def twice(x):
    return x + x
print(twice(1.5), flush=True)
"""


def test_a_process_compiles_when_no_other_does(tmp_path):
    """numba itself would let both write their code under the same name."""
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    with FileLock(cache_folder() / "sheet_fem.lock"):
        process = subprocess.Popen(
            [sys.executable, str(tmp_path / "script.py")], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(2.0)
    assert process.stdout.read() == "3.0\n"
    assert process.wait() == 0
