"""What the command line says of an exception that ends a command."""

from __future__ import annotations

import os
import traceback
from pathlib import Path

from coupling.errors import CouplingError, reason_of

_PACKAGE = Path(__file__).parents[1]
_REPORT = "please report it, with what the same command shows with --debug"


def describe_failure(error: Exception) -> str:
    """Return one sentence for an exception.

    Errors of this package tell the user what to do.  Others are the machine's, such as a full disk, or
    this program's own faults, which the sentence calls so.

    Example:
        >>> describe_failure(FileNotFoundError(2, "No such file or directory", "line.toml"))
        'line.toml: No such file or directory'
        >>> describe_failure(ZeroDivisionError("float division by zero"))[:71]
        'a fault of this program (ZeroDivisionError: float division by zero): pl'
    """
    from elastic_robot.errors import ElasticRobotError

    match error:
        case CouplingError() | ElasticRobotError():
            return str(error)
        case OSError():
            return _of_the_system(error)
        case MemoryError():
            return (
                "expected more memory than this machine has left: end other programs, or take a"
                " shorter path or fewer samples" + (f" ({error})" if str(error) else "")
            )
        case UnicodeEncodeError():
            return (
                f"expected a system whose encoding has {error.object[error.start]!a}, got"
                f" {error.encoding}: set PYTHONUTF8=1"
            )
        case RecursionError():
            return (
                f"expected a file that is nested less deeply, got too many levels{_where(error)}: if"
                f" it is not nested, {_REPORT}"
            )
    words = f"{type(error).__name__}: {error}".removesuffix(": ")
    return f"a fault of this program ({words}{_where(error)}): {_REPORT}"


def _of_the_system(error: OSError) -> str:
    """Return which file or resource the system refuses, and why."""
    try:
        os.getcwd()
    except OSError:
        return "the working folder is no longer there: change to one that is"
    names = [os.fsdecode(name) for name in (error.filename, error.filename2) if name is not None]
    if names:
        return f"{' to '.join(names)}: {reason_of(error)}"
    return (
        f"the system refused what was asked of it: {type(error).__name__}: {error}{_where(error)}"
    )


def _where(error: BaseException) -> str:
    """Return the last line of this package that an exception came through."""
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename).is_relative_to(_PACKAGE)
    ]
    return f", {os.path.basename(frames[-1].filename)} line {frames[-1].lineno}" if frames else ""
