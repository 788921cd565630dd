"""The command line, elastic-robot."""

from __future__ import annotations

import os

# Small matrices: more BLAS threads only wait for each other.  Set before NumPy is loaded.
for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_library, "1")

from coupling.cli.main import app, main

__all__ = ["app", "main"]
