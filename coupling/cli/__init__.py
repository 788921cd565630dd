"""The command line: elastic-robot build | ssp | couple | compensate | study | place | report | store."""

from __future__ import annotations

import os
import sys

from coupling.cli.interrupts import termination_interrupts

# Small matrices: more BLAS threads only wait for each other.  Set before NumPy is loaded.
for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_library, "1")

try:
    with termination_interrupts():
        from coupling.cli.main import app, main
except KeyboardInterrupt:  # the libraries take a second or two
    print("stopped; nothing was written", file=sys.stderr)
    raise SystemExit(130) from None

__all__ = ["app", "main"]
