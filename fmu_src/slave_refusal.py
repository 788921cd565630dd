"""How a slave, whichever it is, tells of an error, and of a host that it cannot run in."""

from __future__ import annotations

import ctypes
import importlib
import sys
from collections.abc import Mapping

from pythonfmu import Fmi2Slave

# Begins the sentences of errors that leave the master another try; python_host takes it off.
_DISCARD = "[discard] "


class RefusedError(Exception):
    """What PythonFMU gets of an error; it logs the `repr`, formatted like printf, # as FMI has it."""

    def __repr__(self) -> str:
        return str(self).replace("%", "%%").replace("#", "##")


def refusal(slave: Fmi2Slave, error: object, may_retry: bool = False) -> RefusedError:
    """Return what to raise for an error; it is shown, as FMI passes on a status only.

    Args:
        slave: The slave.
        error: An error or its sentence.
        may_retry: Whether another value may do.
    """
    text = f"{slave.instance_name}: {error}"
    print(text, file=sys.stderr, flush=True)
    # PythonFMU's binary gives up its references to these three at every exception, and once more
    # when the instance is freed; without others that is a use after free.
    for owned in (slave, type(slave), slave.log_queue):
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(owned))
    return RefusedError(f"{_DISCARD if may_retry else ''}{text}")


def require_host(fmu: str, modules: Mapping[str, str], advice: str = "") -> None:
    """Raise unless the host's Python has what an FMU imports; who cannot instantiate is told why.

    Args:
        fmu: Name of the FMU.
        modules: Modules that it imports, and the names by which they are installed.
        advice: Where else to read.
    """
    needed, program = " ".join(modules.values()), sys.executable or sys.prefix
    try:
        if sys.version_info < (3, 11):  # noqa: UP036  (the host's Python may be any)
            raise ImportError("there is no support for so old a version")
        for name in modules:
            importlib.import_module(name)
    except ImportError as error:
        text = (
            f"{fmu}: the host of this FMU: expected Python 3.11 or newer with {needed}, got {program}"
            f" {sys.version.split()[0]} ({error}): {program} -m pip install {needed}{advice}"
        )
        print(text, file=sys.stderr, flush=True)
        raise RefusedError(text) from error
