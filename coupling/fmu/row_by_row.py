"""An instance of an FMU is set, stepped and read row by row, in C."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException

from coupling.fmu.job import FmuError

# Status of FMI 2 and 3: the highest of a call that did what it was asked, and of a log message that
# reports no refusal.
WARNING = 1
# ER_STEPS_STOPPED of desk/fmi_steps.h.
_STOPPED = 4


class Series(ctypes.Structure):
    """Reals that are set before each step or read behind it: er_series of desk/fmi_steps.h.

    Attributes:
        reference: Value references of the variables.
        references: Number of these.
        width: Number of their values.
    """

    _fields_ = (
        ("reference", ctypes.POINTER(ctypes.c_uint32)),
        ("references", ctypes.c_uint64),
        ("width", ctypes.c_uint64),
    )


class _Steps(ctypes.Structure):
    """An instance that is stepped: er_steps of desk/fmi_steps.h."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("instance", "set", "step", "get")),
        ("inputs", Series),
        ("outputs", Series),
        *((name, ctypes.c_int64) for name in ("number", "status", "has_ended")),
    )


@dataclass(frozen=True)
class StepFunctions:
    """What a version of FMI steps an instance with.

    Attributes:
        version: Version of FMI, "2" or "3".
        names: Names of its functions that set reals, step and get reals.
        counted: Whether those of reals take the number of values as well.
    """

    version: str
    names: tuple[str, str, str]
    counted: bool


class Stepper:
    """Sets, steps and reads an instance of an FMU, row by row, in C.

    A call of Python for each costs more than a step of a fast FMU.

    Args:
        functions: Functions by which its version of FMI steps it.
        slave: FMPy's FMU, which has an instance.
        library: The desk library.
        inputs, outputs: Value references of real variables.
        widths: Numbers of the values of these, an array counts as all its elements.
    """

    def __init__(
        self,
        functions: StepFunctions,
        slave: Any,
        library: ctypes.CDLL,
        inputs: Sequence[int],
        outputs: Sequence[int],
        widths: tuple[int, int],
    ) -> None:
        self._functions, self._dll, self._counted = functions.names, slave.dll, functions.counted
        self._call = library[f"er_fmi{functions.version}_steps"]
        self._call.restype = ctypes.c_int64
        addresses = [
            ctypes.cast(slave.dll[name], ctypes.c_void_p).value for name in functions.names
        ]
        # ctypes keeps the arrays that a structure points to.
        series = [
            Series((ctypes.c_uint32 * len(references))(*references), len(references), width)
            for references, width in zip((inputs, outputs), widths, strict=True)
        ]
        self._steps = _Steps(slave.component, *addresses, *series)

    def set_inputs(self, row: np.ndarray) -> None:
        """Set the inputs, any unit, (inputs,)."""
        self._move(0, self._steps.inputs, row)

    def read(self) -> np.ndarray:
        """Return the outputs, any unit, (outputs,)."""
        row = np.empty(self._steps.outputs.width)
        self._move(2, self._steps.outputs, row)
        return row

    def advance(self, time: np.ndarray, rows: np.ndarray, answers: np.ndarray) -> None:
        """Take steps.

        Args:
            time: Their starts, and the end of the last one [s], (n + 1,).
            rows: Inputs over each of them, any unit, (n, inputs), in C order.
            answers: Filled with the outputs at their ends, any unit, (n, outputs), in C order.

        Raises:
            FmuError: If the FMU has ended its simulation.
            FMICallException: If it refuses a call.
        """
        steps, arrays = self._steps, [array.ctypes.data for array in (time, rows, answers)]
        count = ctypes.c_int64(len(rows))
        end = self._call(ctypes.byref(steps), count, *map(ctypes.c_void_p, arrays))
        if end == _STOPPED:
            raise FmuError(
                f"has ended its simulation at {time[steps.number]:.6g} s, before the end of the path"
            )
        if end:
            raise FMICallException(function=self._functions[end - 1], status=steps.status)

    def _move(self, function: int, series: Series, row: np.ndarray) -> None:
        count = (ctypes.c_size_t(series.width),) if self._counted else ()
        status = self._dll[self._functions[function]](
            ctypes.c_void_p(self._steps.instance),
            series.reference,
            ctypes.c_size_t(series.references),
            ctypes.c_void_p(row.ctypes.data),
            *count,
        )
        if status > WARNING:
            raise FMICallException(function=self._functions[function], status=status)
