"""How a slave tells PythonFMU of an error, alike for every slave."""

from __future__ import annotations

import ctypes
import sys

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
        may_retry: Whether another value may do; an error may say so by itself.
    """
    text = f"{slave.instance_name}: {error}"
    print(text, file=sys.stderr, flush=True)
    # PythonFMU's binary gives up its references to these three at every exception, and once more
    # when the instance is freed; without others that is a use after free.
    for owned in (slave, type(slave), slave.log_queue):
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(owned))
    return RefusedError(f"{_DISCARD if getattr(error, 'may_retry', may_retry) else ''}{text}")
