"""State of an FMU instance, and its bytes.

The bytes are a header that says what they are, a SHA-256 of the rest, and an NPZ archive of plain
arrays.  They belong to FMUs of one fingerprint: the same robot and the same model sources.
"""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass

import numpy as np

from elastic_robot.commands import LastStep
from elastic_robot.errors import StateError
from elastic_robot.fmi.lifecycle import Phase
from elastic_robot.parameters import Parameters
from elastic_robot.snapshot import Snapshot
from elastic_robot.trajectory import Trajectory

_HEADER = b"elastic-robot FMU state 3\n"
_DIGEST = hashlib.sha256().digest_size
_MODEL = "model."
_PAST = "past."


@dataclass(frozen=True)
class FmuState:
    """State of an instance.

    Attributes:
        fingerprint: Fingerprint of the FMU that it belongs to.
        start: Start of the experiment [s]; the model's time is that since then.
        time: Start of the next step [s].
        stop: Stop of the experiment [s], infinite if there is none.
        tolerance: Relative tolerance of the experiment; 0 where it is not given.
        phase: State of the instance's life cycle.
        parameters_changed: `values` has parameters that the model takes with the next step.
        values: Values of all real variables, any unit, (variables,).
        jerk: Rates of qdd_cmd that the master has given [rad/s^3], (n,); nan where it has not.
        strings: Values of the string variables.
        model: State of the model; None before the initial state is computed.
        past: The last step of drives that follow the inputs; None where there is none.
        trajectory: Motion of the drives; None where they follow the inputs, and in a state made
            from bytes, where the instance reads it anew.
        trajectory_digest: Digest of that trajectory; empty: the drives follow the inputs.
    """

    fingerprint: str
    start: float
    time: float
    stop: float
    tolerance: float
    phase: Phase
    parameters_changed: bool
    values: np.ndarray
    jerk: np.ndarray
    strings: tuple[str, ...]
    model: Snapshot | None
    past: LastStep | None
    trajectory: Trajectory | None
    trajectory_digest: str

    def to_bytes(self) -> bytes:
        """Return the state as bytes; equal states give equal bytes."""
        arrays = {
            "fingerprint": np.array(self.fingerprint),
            "clock": np.array([self.start, self.time, self.stop, self.tolerance]),
            "flags": np.array([self.phase, self.parameters_changed]),
            "values": self.values,
            "jerk": self.jerk,
            "strings": np.array(self.strings),
            "trajectory": np.array(self.trajectory_digest),
        }
        if self.model is not None:
            arrays |= {f"{_MODEL}{key}": value for key, value in self.model.to_arrays().items()}
        if self.past is not None:
            arrays |= {f"{_PAST}{key}": np.array(value) for key, value in vars(self.past).items()}
        archive = io.BytesIO()
        np.savez(archive, allow_pickle=False, **arrays)
        content = archive.getvalue()
        return _HEADER + hashlib.sha256(content).digest() + content


@dataclass(frozen=True)
class PackedState:
    """A state that arrived as bytes; what they hold is known when an FMU opens them.

    Attributes:
        data: Bytes of `FmuState.to_bytes`, or whatever else a host took for it.
    """

    data: bytes

    def to_bytes(self) -> bytes:
        """Return the bytes it came from."""
        return self.data

    def _archive(self) -> bytes:
        if not self.data.startswith(_HEADER):
            raise StateError(
                "state: expected one that an FMU of an elastic robot has saved, got"
                f" {len(self.data)} bytes that begin with {self.data[:12]!r}"
            )
        start = len(_HEADER) + _DIGEST
        archive = self.data[start:]
        if hashlib.sha256(archive).digest() != self.data[len(_HEADER) : start]:
            raise StateError(
                f"state: expected an unchanged copy, got {len(self.data)} damaged bytes"
            )
        return archive

    def open(self, fingerprint: str, parameters: Parameters) -> FmuState:
        """Return the state.

        Args:
            fingerprint: Fingerprint of the FMU that asks.
            parameters: Parameters of its robot; their tables are used.

        Raises:
            StateError: If the bytes are no state, damaged, or belong to another FMU.
        """
        with np.load(io.BytesIO(self._archive()), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        found = str(arrays["fingerprint"])
        require_own(found, fingerprint)
        of_model, of_past = (_beginning(arrays, prefix) for prefix in (_MODEL, _PAST))
        start, time, stop, tolerance = arrays["clock"].tolist()
        phase, parameters_changed = arrays["flags"].tolist()
        return FmuState(
            fingerprint=found,
            start=start,
            time=time,
            stop=stop,
            tolerance=tolerance,
            phase=Phase(phase),
            parameters_changed=bool(parameters_changed),
            values=arrays["values"],
            jerk=arrays["jerk"],
            strings=tuple(arrays["strings"].tolist()),
            model=Snapshot.from_arrays(of_model, parameters) if of_model else None,
            past=_past(of_past) if of_past else None,
            trajectory=None,
            trajectory_digest=str(arrays["trajectory"]),
        )


def _past(arrays: dict[str, np.ndarray]) -> LastStep:
    end, rate, acceleration = (arrays[key] for key in ("end", "rate", "acceleration"))
    return LastStep(float(arrays["length"]), end, rate, acceleration)


def _beginning(arrays: dict[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Return the arrays whose names begin with a prefix, without it."""
    return {
        name.removeprefix(prefix): array
        for name, array in arrays.items()
        if name.startswith(prefix)
    }


def require_own(found: str, fingerprint: str) -> None:
    """Raise a StateError unless a state's fingerprint is that of the FMU that it is given to."""
    if found != fingerprint:
        raise StateError(
            f"state: expected one with fingerprint {fingerprint}, of the same robot and version, got"
            f" {found}"
        )
