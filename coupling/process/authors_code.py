"""Running a user's code: whatever ends it is an error, even what would end the whole command."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

from coupling.errors import CouplingError


@contextmanager
def authors_code(said: Callable[[str], CouplingError]) -> Iterator[None]:
    """Turn what ends a user's code into an error.

    That includes `sys.exit` and `os._exit`, by which a command would end with the status of a result
    that it has not; processes that the code has forked end by them as ever.  The `exit` of a library in
    C cannot be caught.

    Args:
        said: Returns the error for what happened, with its line in the code.

    Example:
        >>> try:
        ...     with authors_code(lambda what: CouplingError(f"mine: {what}")):
        ...         os._exit(0)
        ... except CouplingError as error:
        ...     print(str(error).partition(" (")[0])
        mine: SystemExit: 0
    """
    process, end = os.getpid(), os._exit

    def end_code(status: int) -> NoReturn:
        if os.getpid() != process:
            end(status)
        raise SystemExit(status)

    os._exit = end_code
    try:
        yield
    except (CouplingError, KeyboardInterrupt):
        raise
    except BaseException as cause:
        lines = [
            line
            for line in traceback.extract_tb(cause.__traceback__)
            if line.filename != __file__ and not line.filename.startswith("<frozen importlib")
        ]
        where = f" ({Path(lines[-1].filename).name}, line {lines[-1].lineno})" if lines else ""
        raise said(f"{type(cause).__name__}: {cause}{where}") from cause
    finally:
        os._exit = end
