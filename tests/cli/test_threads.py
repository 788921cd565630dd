"""The command line computes on one thread: its matrices are small, more threads wait for each other."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

LIBRARIES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
# Tells what stands in the environment at the moment at which NumPy is looked for.
WATCHED = f"""
import os, sys

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy":
            print(*(os.environ.get(library, "none") for library in {LIBRARIES!r}))

sys.meta_path.insert(0, Finder())
import coupling.cli
import numpy
"""


@pytest.mark.parametrize("wanted", [None, "3"])
def test_threads_are_limited_before_numpy_is_loaded_unless_the_user_says_how_many(wanted):
    environment = {name: value for name, value in os.environ.items() if name not in LIBRARIES}
    if wanted is not None:
        environment |= dict.fromkeys(LIBRARIES, wanted)
    done = subprocess.run(
        [sys.executable, "-c", WATCHED], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [wanted or "1"] * 3
