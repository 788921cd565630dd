"""Frequency responses that were measured at the tool, by a hammer and an accelerometer for instance.

A CSV file has the columns `frequency_Hz` and, for each pair of directions, `xy_real_m_N` and
`xy_imag_m_N`: the displacement along x by a force along y. A file of type UFF58 has displacement,
velocity or acceleration over force, and its directions as numbers of axes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.errors import StabilityError
from coupling.files.bounded_file import require_bounded
from coupling.files.csv_table import read_header, read_table
from coupling.files.extras import extra
from coupling.results.modes_result import ResponseResult

_FREQUENCY = "frequency_Hz"
_COLUMN = re.compile(r"([xyz])([xyz])_(real|imag)_m_N")
_UFF = frozenset({".uff", ".unv", ".58"})
# No measured file is larger [bytes].
_MOST = 200_000_000
# UFF58: number of the function, quantities of its values by their codes, and how often they are derived.
_UFF_TYPE, _FRF, _FORCE = 58, 4, 13
_DERIVED = {8: 0, 11: 1, 12: 2}
_AXES = {1: "x", 2: "y", 3: "z"}
# Sizes of responses that no mistaken unit explains [m/N].
_LEAST_COMPLIANCE, _MOST_COMPLIANCE = 1e-20, 1e12
# Labels of units, without brackets, blanks and signs of powers: none, or of metres, seconds, newtons.
_SI = re.compile("none|null|unknown|n|(1/n)?(m(/s(2|/s)?)?)?(/n)?")
_SIGNS = re.compile(r"[\s()*^]")
# UFF164: the system of units by its number, metres and newtons.
_UNITS_TYPE, _SI_SYSTEM = 164, 1
# What else numbers may be: a factor and how often they were derived make displacement over force of it.
_READINGS = (
    ("motion and force have opposite signs", -1.0, 0),
    ("they are in mm/N", 1e-3, 0),
    ("they are in um/N", 1e-6, 0),
    ("they are of accelerations in g", 9.80665, 0),
    ("they are velocities over force", 1.0, 1),
    ("they are accelerations over force", 1.0, 2),
    ("they are accelerations over force, of opposite signs", -1.0, 2),
)


@dataclass(frozen=True)
class MeasuredResponse:
    """Dynamic compliance between two directions.

    Attributes:
        name: Directions of motion and of force, such as "xy".
        frequency: Rising frequencies [Hz], > 0, (n,).
        compliance: Displacement by force [m/N], complex, (n,).
    """

    name: str
    frequency: np.ndarray
    compliance: np.ndarray

    @property
    def stored(self) -> ResponseResult:
        """It as results have it."""
        return ResponseResult(
            name=self.name,
            frequency_Hz=tuple(self.frequency.tolist()),
            real_m_N=tuple(self.compliance.real.tolist()),
            imag_m_N=tuple(self.compliance.imag.tolist()),
        )


def other_readings(
    measured: Sequence[MeasuredResponse],
) -> Iterator[tuple[str, tuple[MeasuredResponse, ...]]]:
    """Yield in words what else the numbers of responses may be, and the responses of that."""
    yield (
        "their imaginary parts have the opposite sign",
        tuple(replace(r, compliance=r.compliance.conj()) for r in measured),
    )
    for words, factor, derived in _READINGS:
        yield (
            words,
            tuple(
                replace(r, compliance=r.compliance * factor / (2j * np.pi * r.frequency) ** derived)
                for r in measured
            ),
        )


def is_of_responses(file: Path) -> bool:
    """Return whether a file is one of frequency responses, by its name and columns."""
    if file.suffix.lower() in _UFF:
        return True
    return file.suffix.lower() == ".csv" and _FREQUENCY in read_header(file, StabilityError)


def read_responses(file: Path) -> tuple[MeasuredResponse, ...]:
    """Read all frequency responses of a file.

    Raises:
        StabilityError: If it cannot be read, or has none.
        RobotFileError: If it is of type UFF58 and pyuff is not installed.
    """
    responses = _read_uff(file) if file.suffix.lower() in _UFF else _read_csv(file)
    if not responses:
        raise StabilityError(
            f"{file}: expected frequency responses of displacement, velocity or acceleration over"
            " force along x, y or z, got none"
        )
    for response in responses:
        size = float(np.abs(response.compliance).max())
        if size and not _LEAST_COMPLIANCE <= size <= _MOST_COMPLIANCE:
            raise StabilityError(
                f"{file}: {response.name}: expected at most {_MOST_COMPLIANCE:g} m/N and a largest value"
                f" above {_LEAST_COMPLIANCE:g}, got {size:.3g}: no structure moves so"
            )
        if not np.any(response.compliance):
            raise StabilityError(
                f"{file}: {response.name}: expected a response, got 0 at all its frequencies: measure it"
                " again, or leave it out"
            )
    return responses


def _read_csv(file: Path) -> tuple[MeasuredResponse, ...]:
    header = read_header(file, StabilityError)
    wrong = [name for name in header if name != _FREQUENCY and not _COLUMN.fullmatch(name)]
    if wrong:
        raise StabilityError(
            f"{file}: expected the columns {_FREQUENCY} and pairs such as xx_real_m_N, xx_imag_m_N, got"
            f" {wrong[0]!r}: rename it, or leave it out"
        )
    names = list(dict.fromkeys(m[1] + m[2] for m in map(_COLUMN.fullmatch, header) if m))
    columns = [f"{name}_{part}_m_N" for name in names for part in ("real", "imag")]
    table = read_table(file, [_FREQUENCY, *columns], StabilityError)
    frequency = _rising(table[:, 0], file)
    return tuple(
        MeasuredResponse(name, frequency, table[:, 1 + 2 * k] + 1j * table[:, 2 + 2 * k])
        for k, name in enumerate(names)
    )


def _rising(frequency: np.ndarray, where: object) -> np.ndarray:
    """Return frequencies [Hz], (n,), that rise from above zero."""
    if len(frequency) < 2 or frequency[0] <= 0.0 or np.any(np.diff(frequency) <= 0.0):
        raise StabilityError(
            f"{where}: expected two frequencies at least that rise from above 0 Hz, got"
            f" {len(frequency)} that do not: sort them, and leave 0 Hz out"
        )
    return frequency


def _read_uff(file: Path) -> tuple[MeasuredResponse, ...]:
    require_bounded(file, _MOST, StabilityError)
    pyuff = extra("pyuff", "uff", f"{file}: a file of type UFF58")
    try:
        uff = pyuff.UFF(str(file))
        kinds = list(enumerate(uff.get_set_types()))
        sets = [uff.read_sets(k) for k, kind in kinds if kind == _UFF_TYPE]
        systems = [
            _number(uff.read_sets(k), "units_code") for k, kind in kinds if kind == _UNITS_TYPE
        ]
    except Exception as cause:  # pyuff raises bare exceptions of many kinds
        raise StabilityError(f"{file}: expected a file of type UFF58, got: {cause}") from cause
    if any(system != _SI_SYSTEM for system in systems):
        raise StabilityError(
            f"{file}: expected metres and newtons (units code {_SI_SYSTEM} of its set 164), got"
            f" {systems}: convert it"
        )
    return tuple(
        response for number, content in enumerate(sets, start=1)
        if (response := _of_set(content, f"{file}: set {number}")) is not None
    )  # fmt: skip


def _of_set(content: dict[str, object], where: str) -> MeasuredResponse | None:
    """Return the compliance of a set; None where it is no frequency response.

    Raises:
        StabilityError: If it is one, but not of a motion by a force along axes, in SI units.
    """
    if _number(content, "func_type") != _FRF:
        return None
    codes = [_number(content, f"{key}_spec_data_type") for key in ("ordinate", "orddenom")]
    derived = _DERIVED.get(codes[0])
    if derived is None or codes[1] != _FORCE:
        raise StabilityError(
            f"{where}: expected displacement (code 8), velocity (11) or acceleration (12) over force"
            f" ({_FORCE}), got the codes {codes[0]} over {codes[1]}: set them, or leave the set out"
        )
    directions = [_number(content, key) for key in ("rsp_dir", "ref_dir")]
    if any(abs(axis) not in _AXES for axis in directions):
        raise StabilityError(
            f"{where}: expected directions of response and force of 1 to 3, or -1 to -3, for x, y and z,"
            f" got {directions[0]} and {directions[1]}: set them, or leave the set out"
        )
    for key in ("ordinate", "orddenom"):
        unit = str(content.get(f"{key}_axis_units_lab", "")).strip()
        if not _SI.fullmatch(_SIGNS.sub("", unit.lower()).replace("\u00b2", "2")):
            raise StabilityError(
                f"{where}: expected values in m, m/s, m/s^2 and N, or no unit, got {unit!r}: convert"
                " them"
            )
    frequency, values = np.asarray(content["x"], float), np.asarray(content["data"], complex)
    above = frequency > 0.0
    frequency, values = _rising(frequency[above], where), values[above]
    if not np.isfinite(values).all():
        raise StabilityError(f"{where}: expected finite values, got some that are not")
    sign = np.prod(np.sign(directions))
    compliance = sign * values / (2j * np.pi * frequency) ** derived
    return MeasuredResponse("".join(_AXES[abs(axis)] for axis in directions), frequency, compliance)


def _number(content: dict[str, object], key: str) -> int:
    """Return a whole number of a set; -1 where it has none."""
    value = content.get(key)
    return int(value) if isinstance(value, int | float | np.integer | np.floating) else -1


def within(responses: Sequence[MeasuredResponse]) -> tuple[float, float]:
    """Return the lowest and the highest frequency of responses [Hz]."""
    return (
        float(min(response.frequency[0] for response in responses)),
        float(max(response.frequency[-1] for response in responses)),
    )
