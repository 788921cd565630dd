"""The command line: elastic-robot build | ssp | couple | compensate | study | place | report | store."""

from __future__ import annotations

import os
import signal
import sys
import threading
from types import FrameType

# Small matrices: more BLAS threads only wait for each other.  Set before NumPy is loaded.
for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_library, "1")


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


# A batch system's announcement of the end is taken as an interrupt by hand, here as in `main`.
_before = (
    signal.signal(signal.SIGTERM, _interrupt)
    if threading.current_thread() is threading.main_thread()
    else None
)
try:
    from coupling.cli.main import app, main
except KeyboardInterrupt:  # the libraries take a second or two
    print("stopped; nothing was written", file=sys.stderr)
    raise SystemExit(130) from None
finally:
    if _before is not None:
        signal.signal(signal.SIGTERM, _before)

__all__ = ["app", "main"]
