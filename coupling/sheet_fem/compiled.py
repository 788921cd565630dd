"""The compiler of the inner loops and the BLAS that they call; packages of the extra `fem`."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from filelock import FileLock

from coupling.errors import CaseError
from coupling.native.cache import cache_folder

try:
    import numba
    import numba.core.event
    import numba.extending
    import threadpoolctl
except ImportError as cause:
    raise CaseError(
        f"process: sheet-fem needs the package {cause.name}, which is not installed: install the"
        " extra, pip install 'elastic-robot-fmu[fem]', or pip install numba meshio threadpoolctl"
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


class _CompilationTurn(numba.core.event.Listener):
    """Lets one process compile at a time: others wait, and read what it has kept.

    numba numbers the files of a function's code by their index: two that read it at once would take the
    same number for the code of different arguments.
    """

    def __init__(self) -> None:
        self._lock = FileLock(cache_folder() / "sheet_fem.lock")

    def on_start(self, event: object) -> None:
        self._lock.acquire()

    def on_end(self, event: object) -> None:
        self._lock.release()


_forget_older_code()
# numba's lock between threads is held while code is looked for, compiled and kept.
_register: Any = numba.core.event.register
_register("numba:compiler_lock", _CompilationTurn())


# Sums may be reordered; the code runs without Python's lock; C never calls it.
_OPTIONS: Any = {
    "error_model": "numpy",
    "nogil": True,
    "no_cfunc_wrapper": True,
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
}


def compile_function(function: Callable[P, R], **options: Any) -> Callable[P, R]:
    """Compile a function of numbers and arrays; the code is kept beside the source."""
    return numba.njit(cache=True, **_OPTIONS, **options)(function)


def internal(function: Callable[P, R], **options: Any) -> Callable[P, R]:
    """Compile a function that only compiled code calls: what Python needs for that takes long."""
    return compile_function(function, no_cpython_wrapper=True, **options)


def compile_inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile an internal function of the innermost loops into each that calls it.

    There its arrays on the stack are known by their numbers.
    """
    return internal(function, forceinline=True)


def inlined_as(function: Callable[P, R]) -> Callable[[Callable[..., object]], None]:
    """Tell what stands for a plain function in compiled code, and compile it into each that calls it.

    The decorated function is called with numba's types of the arguments, while a caller is compiled,
    and returns the compiled function for them.
    """

    def register(choose: Callable[..., object]) -> None:
        options: Any = {**_OPTIONS, "no_cpython_wrapper": True, "forceinline": True}
        numba.extending.overload(function, jit_options=options, strict=False)(choose)

    return register


def with_blas_on_one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Keep BLAS to one thread while a function runs.

    The loops that call it are on all cores themselves, with small matrices: its threads would only wait
    for each other, and an evaluation would take two to three times as long.
    """
    limited: Any = threadpoolctl.threadpool_limits.wrap(limits=1, user_api="blas")(function)
    return limited
