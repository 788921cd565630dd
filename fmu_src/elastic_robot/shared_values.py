"""The FMU's real values in memory that `python_host` sets and reads without calling Python."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from enum import IntEnum

import numpy as np

from elastic_robot.fmi.interface import Block
from elastic_robot.fmi.real_variables import RealVariables
from elastic_robot.robot import ElasticRobot

# Of the 6x6 compliance the translations' symmetric block is given: xx xy xz yy yz zz.
_UPPER = np.triu_indices(3)


class State(IntEnum):
    """What may be done with a value, as python_host's shared.h has it."""

    ASK = 0
    SETTABLE = 1
    READABLE = 2
    WAS_READ = 3


class SharedValues:
    """A state for each real value, a byte each; who reads a value marks it.

    Outputs that were read after one step are computed with the next one, the others when they are
    read.

    Args:
        reals: The values.
        table: Their blocks.
    """

    def __init__(self, reals: RealVariables, table: Mapping[str, Block]) -> None:
        self._reals = reals
        # A parameter can always be read; that it was is of no interest.
        self._states = bytearray([State.WAS_READ]) * len(reals)
        self._outputs = {k: reals.slice(k) for k, b in table.items() if b.causality == "output"}
        self._inputs = reals.slice("wrench", "qdd_cmd")
        self._all_outputs = reals.slice("tcp", "deflection")
        self._not_computed = bytes(self._all_outputs.stop - self._all_outputs.start)
        # The states when a step has ended, the outputs to compute then, and the states after that.
        self._read = self._renewed_states = b""
        self._renewed: tuple[tuple[slice, str], ...] = ()
        self.forget_outputs()
        self.let_inputs_be_set(False)

    def let_inputs_be_set(self, final: bool) -> None:
        """Let inputs be set without a call; not before the initial state is final: they change it."""
        state = State.SETTABLE if final else State.ASK
        self._states[self._inputs] = bytes([state]) * (self._inputs.stop - self._inputs.start)

    def forget_outputs(self) -> None:
        """Have no output computed."""
        self._states[self._all_outputs] = self._not_computed

    def is_computed(self, key: str) -> bool:
        """Return whether the outputs of a block are there."""
        return self._states[self._outputs[key].start] != State.ASK

    def compute(self, key: str, model: ElasticRobot) -> None:
        """Compute the outputs of a block."""
        value, place = getattr(model, key)(), self._outputs[key]
        self._reals.values[place] = value[_UPPER] if key == "compliance" else value
        self._states[place] = bytes([State.READABLE]) * (place.stop - place.start)

    def mark_read(self, key: str) -> None:
        """Remember that outputs of a block were read."""
        self._states[self._outputs[key].start] = State.WAS_READ

    def renew_outputs(self, model: ElasticRobot) -> None:
        """Compute anew what was read since the last step; the rest when it is read."""
        states, values = self._states, self._reals.values
        if states != self._read:
            self._learn_what_is_read()
        self.forget_outputs()
        try:
            for place, output in self._renewed:
                values[place] = getattr(model, output)()
        except Exception:  # the step is done; what is wrong is told when the output is read
            return
        states[:] = self._renewed_states

    def _learn_what_is_read(self) -> None:
        states, renewed = bytearray(self._states), []
        states[self._all_outputs] = self._not_computed
        for key, place in self._outputs.items():
            # Who reads the compliance at times shall not pay for it at every step.
            if State.WAS_READ in self._states[place] and key != "compliance":
                renewed.append((place, key))
                states[place] = bytes([State.READABLE]) * (place.stop - place.start)
        self._read, self._renewed = bytes(self._states), tuple(renewed)
        self._renewed_states = bytes(states)

    def place(self) -> str:
        """Return the addresses of values and states, and their number."""
        states = ctypes.addressof(ctypes.c_char.from_buffer(self._states))
        return f"{self._reals.values.ctypes.data} {states} {len(self._reals)}"
