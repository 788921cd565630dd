"""The command line, elastic-robot."""

import os
import signal
import threading

# Small matrices: more BLAS threads only wait for each other.  Set before NumPy is loaded.
for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_library, "1")

_INTERRUPTED = 130


def _end(*_: object) -> None:
    os._exit(_INTERRUPTED)


# While the commands are imported nothing has begun that an interrupt by hand would have to tell of.
_is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
if _is_usual and threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, _end)

from coupling.cli.main import app, main

if signal.getsignal(signal.SIGINT) is _end:
    signal.signal(signal.SIGINT, signal.default_int_handler)

__all__ = ["app", "main"]
