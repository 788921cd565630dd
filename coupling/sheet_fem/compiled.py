"""The compiler of the inner loops: numba, of the extra `fem`."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from coupling.errors import CaseError

try:
    import numba
    import numba.extending
except ImportError as cause:
    raise CaseError(
        "process: sheet-fem needs the package numba, which is not installed: install the extra,"
        " pip install 'elastic-robot-fmu[fem]', or pip install numba meshio"
    ) from cause

P = ParamSpec("P")
R = TypeVar("R")


def _forget_older_code() -> None:
    """Drop compiled code older than any source beside it.

    numba looks only at the file of a function, not at those of the functions that it calls.
    """
    folder = Path(__file__).parent
    newest = max(source.stat().st_mtime for source in folder.glob("*.py"))
    for index in folder.glob("__pycache__/*.nbi"):
        with suppress(FileNotFoundError):  # another process has been quicker
            if index.stat().st_mtime < newest:
                index.unlink()


_forget_older_code()


# Sums may be reordered; the code runs without Python's lock.
_OPTIONS: Any = {
    "error_model": "numpy",
    "nogil": True,
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
}


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function of numbers and arrays; the code is kept beside the source."""
    return numba.njit(cache=True, **_OPTIONS)(function)


def compiled_as(function: Callable[P, R]) -> Callable[[Callable[..., object]], None]:
    """Tell what stands for a plain function in compiled code.

    The decorated function is called with numba's types of the arguments, while a caller is compiled,
    and returns the compiled function for them.
    """

    def register(choose: Callable[..., object]) -> None:
        numba.extending.overload(function, jit_options=_OPTIONS, strict=False)(choose)

    return register
